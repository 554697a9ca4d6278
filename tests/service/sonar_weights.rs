//! New weights are trained, served, and told by the versions that they drew.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use meetpoint_client::v1;
use serde_json::Value;
use tempfile::TempDir;

use crate::door::{Door, finished};
use crate::drive::{opened, opening, send};
use crate::running::{Launch, empty_folder, meetpoint};
use crate::sonar::SonarDrive;

/// Two rooms of 7 by 6 m; a character is a quarter of a metre.
fn two_rooms() -> String {
    let wall = format!("{}\n", "#".repeat(60));
    let row = |door: char| format!("#{}{door}{}#\n", " ".repeat(29), " ".repeat(29));
    let rows = (0..24).map(|index| row(if (10..14).contains(&index) { ' ' } else { '#' }));
    rows.fold(wall.clone(), |drawing, row| drawing + &row) + &wall
}

/// Little is learnt, fast; enough to be sure of something.
fn train(folder: &Path, source: &[&str]) -> (PathBuf, Output) {
    let path = folder.join("weights.json");
    let output = path.to_str().expect("a temporary folder's name");
    let mut words = vec!["train", "--json", "--places", "4000", "--held-out", "1000"];
    words.extend(["--epochs", "30", "--output", output]);
    words.extend(source);
    let done = meetpoint(&words).output().expect("the binary under test starts");
    (path, done)
}

fn told(done: &Output) -> Value {
    let error = String::from_utf8_lossy(&done.stderr);
    assert!(done.status.success(), "{error}");
    serde_json::from_slice(&done.stdout).expect("JSON")
}

/// Weights trained in two rooms, and their name.
fn weights(folder: &TempDir) -> (PathBuf, String) {
    let drawing = folder.path().join("rooms.txt");
    fs::write(&drawing, two_rooms()).expect("the folder can be written");
    let drawing = drawing.to_str().expect("a temporary folder's name");
    let (path, done) = train(folder.path(), &["--drawing", drawing, "--way-places", "400"]);
    let body = told(&done);
    assert_eq!(body["purpose"], "drawing", "{body}");
    assert_eq!(body["held_out"]["n_places"], 1000, "{body}");
    assert_eq!(body["held_out"]["calibration"].as_array().map(Vec::len), Some(10), "tenths");
    let nats = |model: &str| body["held_out"][model]["cross_entropy_nats"].as_f64();
    assert!(nats("network") < nats("constant"), "something was learnt: {body}");
    (path, body["name"].as_str().expect("a name").to_owned())
}

async fn heard<D: Door>(door: &D) -> (v1::Grid, v1::MapVersion) {
    let heard = SonarDrive::through_the_hall();
    door.create_map("hall", 0.1).await.expect("a new map");
    let session = opened(door, opening("hall", "bat", &[SonarDrive::sensor()])).await;
    send(door, &session, &heard.batches()).await;
    finished(door, &session).await;
    let grid = door.grid("hall", 0, None).await.expect("a grid");
    let version = door.version("hall", grid.map_version).await.expect("its version");
    (grid, version)
}

#[tokio::test(flavor = "multi_thread")]
async fn versions_tell_by_which_weights_they_were_drawn() {
    let (folder, data, shipped_data) = (empty_folder(), empty_folder(), empty_folder());
    let (path, name) = weights(&folder);
    let service = Launch::at(data.path()).setting("mapping.sonar_weights", path.display()).start();
    let (grid, version) = heard(&service.grpc()).await;
    let drawn_by = |version: &v1::MapVersion| {
        let names = version.sonar_weights.split_once('+');
        names.map_or_else(String::new, |(drawing, _)| drawing.to_owned())
    };
    assert_eq!(drawn_by(&version), name, "as the file is named");
    let by_rest = service.rest().version("hall", version.number).await.expect("the same");
    assert_eq!(by_rest, version, "over REST too");
    let service_that_ships = Launch::at(shipped_data.path()).start();
    let (shipped, version) = heard(&service_that_ships.rest()).await;
    assert_ne!(drawn_by(&version), name, "those that come with the service");
    assert_ne!(drawn_by(&version), "", "they have a name, too");
    assert!(shipped.cells != grid.cells, "other weights, another map");
    let url = service.url();
    let (_, done) = train(folder.path(), &["--map", "hall", "--server", &url]);
    let body = told(&done);
    let trained_on = body["trained_on"].as_str().expect("a text");
    assert!(trained_on.contains("of map hall along session"), "{trained_on}");
}

#[test]
fn weights_that_are_none_are_refused_at_start() {
    let (folder, data) = (empty_folder(), empty_folder());
    let path = folder.path().join("weights.json");
    let launch = Launch::at(data.path()).setting("mapping.sonar_weights", path.display());
    let (status, told) = launch.refused();
    assert_eq!(status.code(), Some(1), "{told}");
    assert!(told.contains("mapping.sonar_weights") && told.contains("weights.json"), "{told}");
    fs::write(&path, "{\"weights\": 1}").expect("the folder can be written");
    let (_, told) = launch.refused();
    assert!(told.contains("this is not what `meetpoint train` writes"), "{told}");
    let (path, _) = weights(&folder);
    let setting = "mapping.sonar_following_weights";
    let (_, told) = Launch::at(data.path()).setting(setting, path.display()).refused();
    assert!(told.contains(setting) && told.contains("its weights are for drawing maps"), "{told}");
}

#[test]
fn a_grid_and_a_trajectory_of_files() {
    let folder = empty_folder();
    // 12 by 12 m of free cells in a wall of one pixel.
    let pixels = (0..240 * 240).map(|index| match (index % 240, index / 240) {
        (0 | 239, _) | (_, 0 | 239) => 0_u8,
        _ => 254,
    });
    let image = [b"P5 240 240 255\n".to_vec(), pixels.collect()].concat();
    fs::write(folder.path().join("room.pgm"), image).expect("the folder can be written");
    let yaml = "image: room.pgm\nresolution: 0.05\norigin: [-6.0, -6.0, 0.0]\nnegate: 0\n\
                occupied_thresh: 0.65\nfree_thresh: 0.196\n";
    let [grid, way] = ["room.yaml", "way.tum"].map(|name| folder.path().join(name));
    fs::write(&grid, yaml).expect("the folder can be written");
    let pose = |step: u8| format!("{step} {} 4.5 0 0 0 0 1", 0.2 * f64::from(step) - 5.0);
    let poses = (0..50).map(pose).collect::<Vec<_>>().join("\n");
    fs::write(&way, poses).expect("the folder can be written");
    let [grid, way] = [&grid, &way].map(|path| path.to_str().expect("a temporary folder's name"));
    let (_, done) = train(folder.path(), &["--grid", grid, "--trajectory", way]);
    let body = told(&done);
    assert_eq!(body["n_trained"], 4000, "all that were asked for: {body}");
    fs::write(way, "0 90 90 0 0 0 0 1\n").expect("the folder can be written");
    let (_, done) = train(folder.path(), &["--grid", grid, "--trajectory", way]);
    let error = String::from_utf8_lossy(&done.stderr);
    assert_eq!(done.status.code(), Some(1), "{error}");
    assert!(error.contains("none of 1 poses lies on free cells of the grid"), "{error}");
}
