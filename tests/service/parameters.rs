//! Parameters of a map: decided before robots come, kept to, and changed by drawing the map anew.

use meetpoint_client::v1;

use crate::door::{Door, finished, job_done, refused};
use crate::drive::{SimulatedDrive, opened, opening, send};
use crate::running::{Launch, empty_folder, meetpoint};

/// Probability that no cell is beyond, in hundredths, as cells of grids are told.
const PERCENT_MAX: u8 = 80;

fn said(probability_max: Option<f64>) -> v1::MappingParameters {
    v1::MappingParameters { probability_max, ..v1::MappingParameters::default() }
}

/// Drives through the hall: the version that holds it.
async fn driven<D: Door>(door: &D, map: &str, robot: &str) -> v1::MapVersion {
    let drive = SimulatedDrive::through_the_hall(4);
    let session = opened(door, opening(map, robot, std::slice::from_ref(&drive.sensor))).await;
    send(door, &session, &drive.batches(40)).await;
    let number = finished(door, &session).await.complete_in_version;
    door.version(map, number).await.expect("it is there")
}

/// The cells of a version.
async fn cells<D: Door>(door: &D, map: &str, version: u64) -> Vec<u8> {
    door.grid(map, version, None).await.expect("a version").cells
}

/// The surest cell, in hundredths.
fn surest(cells: &[u8]) -> Option<u8> {
    cells.iter().copied().filter(|&cell| cell <= 100).max()
}

async fn a_map_keeps_to_its_parameters<D: Door>(door: &D) {
    for map in ["usual", "unsure"] {
        door.create_map(map, 0.05).await.expect("a new map");
    }
    let usual = door.parameters("unsure").await.expect("a map");
    assert_eq!((usual.name.as_str(), usual.map_version, usual.drawn), ("", 0, true), "{usual:?}");
    let before = usual.parameters.expect("all of them");
    assert_eq!((before.prior, before.decay), (Some(0.5), Some(0.9999)), "{before:?}");

    let unsure = said(Some(f64::from(PERCENT_MAX) / 100.0));
    let decided = door.set_parameters("unsure", unsure).await.expect("good parameters");
    let now = decided.parameters.expect("all of them");
    assert_eq!(now, v1::MappingParameters { probability_max: Some(0.8), ..before }, "that one");
    assert!(decided.drawn && !decided.name.is_empty(), "nothing is drawn yet: {decided:?}");
    let again = door.set_parameters("unsure", unsure).await.expect("the same");
    assert_eq!(again, decided, "nothing changed");

    let by_usual = driven(door, "usual", "first").await;
    let by_unsure = driven(door, "unsure", "second").await;
    assert_eq!(by_usual.mapping_parameters, "", "as the service has them");
    assert_eq!(by_unsure.mapping_parameters, decided.name, "the version names them");
    let usual_cells = cells(door, "usual", 0).await;
    assert!(Some(90) < surest(&usual_cells), "sure");
    let unsure_cells = cells(door, "unsure", 0).await;
    assert_eq!(surest(&unsure_cells), Some(PERCENT_MAX), "and no surer");

    let back = door.set_parameters("unsure", said(None)).await.expect("nothing said");
    assert_eq!((back.name.as_str(), back.drawn), ("", false), "the map is not: {back:?}");
    assert_eq!(cells(door, "unsure", 0).await, unsure_cells, "as it was");
    let job = door.create_job("unsure").await.expect("a rebuild");
    let job = job_done(door, &job.id).await;
    let rebuilt = door.version("unsure", job.result_version).await.expect("it made one");
    assert_eq!(rebuilt.mapping_parameters, "", "drawn by those in force");
    assert_eq!(cells(door, "unsure", rebuilt.number).await, usual_cells, "as the other map");
    assert!(door.parameters("unsure").await.expect("a map").drawn, "now it is");
    limits(door).await;
}

async fn limits<D: Door>(door: &D) {
    let wrong = door.set_parameters("usual", said(Some(1.0))).await;
    let wrong = refused(wrong, "INVALID_FIELD");
    assert!(wrong.message.contains("probability_max"), "{wrong:?}");
    refused(door.set_parameters("nowhere", said(None)).await, "MAP_NOT_FOUND");
    refused(door.parameters("nowhere").await, "MAP_NOT_FOUND");
}

#[tokio::test(flavor = "multi_thread")]
async fn over_grpc_and_after_a_restart() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    a_map_keeps_to_its_parameters(&service.grpc()).await;
    let unsure = said(Some(0.8));
    service.grpc().set_parameters("unsure", unsure).await.expect("good parameters");
    service.stop();
    let service = Launch::at(data.path()).start();
    let door = service.grpc();
    let kept = door.parameters("unsure").await.expect("a map");
    assert!(!kept.drawn && !kept.name.is_empty(), "decided, not drawn: {kept:?}");
    // What is drawn is drawn by one set of parameters, whatever was decided meanwhile.
    let version = driven(&door, "unsure", "third").await;
    assert_eq!(version.mapping_parameters, "", "as before");
}

#[tokio::test(flavor = "multi_thread")]
async fn over_rest_and_by_the_command() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    a_map_keeps_to_its_parameters(&service.rest()).await;
    let url = service.url();
    let run = |arguments: &[&str]| {
        let all = [&["parameters", "unsure", "--server", &url], arguments].concat();
        let done = meetpoint(&all).output().expect("the binary under test starts");
        let told =
            [done.stdout, done.stderr].map(|told| String::from_utf8_lossy(&told).into_owned());
        (done.status.success(), told.concat())
    };
    let (is_done, told) = run(&["--set", "probability_max=0.8", "--set", "prior=0.4"]);
    assert!(is_done && told.contains("probability_max = 0.8\n"), "{told}");
    assert!(told.contains("is drawn by others: meetpoint rebuild --map unsure"), "{told}");
    let (is_done, told) = run(&["--reset"]);
    assert!(is_done && told.contains("the service's own; version"), "{told}");
    assert!(told.contains("prior = 0.5\n") && told.contains("is drawn by them"), "{told}");
    let (is_done, told) = run(&["--set", "speed=3"]);
    assert!(!is_done && told.contains("no parameter `speed`"), "{told}");
}
