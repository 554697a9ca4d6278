//! Regions and graphs of versions: what they are, how long their ids last, what becomes of them.

use std::collections::BTreeSet;

use meetpoint_client::v1;
use serde_json::Value;
use v1::get_region_response::State;

use crate::door::{Door, eventually, finished, refused};
use crate::drive::{SimulatedDrive, driven, opened, opening, send};
use crate::http::Http;
use crate::imports::pgm;
use crate::running::{Launch, Running, empty_folder, meetpoint};

/// Where a wall is drawn that is not there: 1.5 m from the left wall.
const FALSE_WALL_COLUMN: usize = 32;
const NONE: v1::GraphPruning = v1::GraphPruning::Unspecified;

/// Two rooms of 3 m by 3 m with a door of 0.9 m between them, cells of 0.1 m: YAML and image.
fn two_rooms() -> (String, Vec<u8>) {
    let wall = "#".repeat(63);
    let row = |is_door: bool| {
        let room = ".".repeat(30);
        format!("#{room}{}{room}#", if is_door { '.' } else { '#' })
    };
    let rows: Vec<String> = (0..30).map(|y| row((10..19).contains(&y))).collect();
    let drawing: Vec<&str> = std::iter::once(wall.as_str())
        .chain(rows.iter().map(String::as_str))
        .chain([wall.as_str()])
        .collect();
    let yaml = "image: rooms.pgm\nresolution: 0.1\norigin: [-1, -2, 0]\nnegate: 0\n\
                occupied_thresh: 0.65\nfree_thresh: 0.196\n";
    (yaml.to_owned(), pgm(&drawing))
}

/// Area that a ring goes around, in square metres; negative if clockwise.
fn ring_area_m2(ring: &v1::Ring) -> f64 {
    let next = ring.points.iter().cycle().skip(1);
    let cross = |(a, b): (&v1::Point, &v1::Point)| a.x_m * b.y_m - b.x_m * a.y_m;
    ring.points.iter().zip(next).map(cross).sum::<f64>() / 2.0
}

fn outline_area_m2(region: &v1::Region) -> f64 {
    region.outline.iter().map(ring_area_m2).sum()
}

async fn rooms_and_their_door<D: Door>(door: &D) {
    let (yaml, image) = two_rooms();
    door.import("rooms", &yaml, &image).await.expect("a good map");
    let graph = door.graph("rooms", 0, NONE, true).await.expect("a graph");
    assert_eq!((graph.map.as_str(), graph.map_version), ("rooms", 1), "named");
    let ids: Vec<u64> = graph.regions.iter().map(|region| region.id).collect();
    assert_eq!(ids, [1, 2], "two rooms, from 1 on");
    let cell_m2 = 0.01;
    for region in &graph.regions {
        assert!((8.9..9.2).contains(&region.area_m2), "a room: {region:?}");
        assert!(!region.is_speck && region.members.is_empty(), "{region:?}");
        let traced_m2 = outline_area_m2(region);
        assert!((traced_m2 - region.area_m2).abs() < 0.1 * cell_m2, "the outline: {region:?}");
        assert!((1.4..1.7).contains(&region.clearance_m), "half a room: {region:?}");
    }
    let [arc] = graph.arcs.as_slice() else { panic!("one door: {graph:?}") };
    assert_eq!((arc.id, arc.region_a, arc.region_b), (1, 1, 2), "{arc:?}");
    assert!((arc.width_m - 0.9).abs() < 0.11, "as wide as the door: {arc:?}");
    let at = arc.position.expect("it is somewhere");
    assert!((at.x_m - 2.15).abs() < 0.2 && (at.y_m + 0.45).abs() < 0.2, "in the door: {arc:?}");
    let plain = door.graph("rooms", 1, NONE, false).await.expect("a graph");
    let without = |region: &v1::Region| v1::Region { outline: Vec::new(), ..region.clone() };
    assert!(
        plain.regions.iter().eq(&graph.regions.iter().map(without).collect::<Vec<_>>()),
        "bare"
    );

    for pruning in [v1::GraphPruning::Pairs, v1::GraphPruning::Ends] {
        let joined = door.graph("rooms", 0, pruning, true).await.expect("a graph");
        assert_eq!(joined.pruning(), pruning, "told");
        let [both] = joined.regions.as_slice() else { panic!("one of two: {joined:?}") };
        assert_eq!(both.members, [1, 2], "{both:?}");
        assert_eq!((joined.arcs.len(), both.outline.len()), (0, 1), "no door is left");
        assert!((outline_area_m2(both) - both.area_m2).abs() < 0.1 * cell_m2, "{both:?}");
    }

    let one = door.region("rooms", 2, 0).await.expect("a region");
    assert_eq!(one.state, Some(State::Region(graph.regions[1].clone())), "the same, with outline");
    refused(door.region("rooms", 3, 0).await, "REGION_NOT_FOUND");
    refused(door.region("nowhere", 1, 0).await, "MAP_NOT_FOUND");
    refused(door.graph("rooms", 2, NONE, false).await, "VERSION_NOT_FOUND");
    door.create_map("empty", 0.05).await.expect("a new map");
    refused(door.graph("empty", 0, NONE, false).await, "NOTHING_PUBLISHED");
    let session = opened(door, opening("empty", "idler", &[])).await;
    finished(door, &session).await;
    refused(door.graph("empty", 0, NONE, false).await, "NOTHING_OBSERVED");
}

async fn ids<D: Door>(door: &D, map: &str, version: u64) -> BTreeSet<u64> {
    let graph = door.graph(map, version, NONE, false).await.expect("a graph");
    graph.regions.iter().map(|region| region.id).collect()
}

/// A grid as the files of a map, with a wall that is not there and cuts its left part off.
fn with_a_false_wall(grid: &v1::Grid) -> (String, Vec<u8>) {
    let v1::Grid { resolution_m, origin, width, height, cells, .. } = grid;
    let (origin, width) = (origin.expect("it has one"), *width as usize);
    let symbol = |(index, percent): (usize, &u8)| match percent {
        0..=30 if index == FALSE_WALL_COLUMN => '#',
        0..=30 => '.',
        70..=100 => '#',
        _ => '_',
    };
    let rows = cells.chunks(width).rev();
    let rows: Vec<String> = rows.map(|row| row.iter().enumerate().map(symbol).collect()).collect();
    let drawing: Vec<&str> = rows.iter().map(String::as_str).collect();
    assert_eq!(drawing.len(), *height as usize, "a row a row");
    let yaml = format!(
        "image: hall.pgm\nresolution: {resolution_m}\norigin: [{}, {}, 0]\nnegate: 0\n\
         occupied_thresh: 0.65\nfree_thresh: 0.196\n",
        origin.x_m, origin.y_m
    );
    (yaml, pgm(&drawing))
}

/// A hall of which a part was cut off by a wall that robots do not find.
async fn a_hall_becomes_one<D: Door>(door: &D) -> u64 {
    let drive = SimulatedDrive::through_the_hall(3);
    let batches = drive.batches(20);
    let session = driven(door, "hall", &drive, &batches).await;
    finished(door, &session).await;
    let (yaml, image) = with_a_false_wall(&door.grid("hall", 0, None).await.expect("a grid"));
    door.import("split", &yaml, &image).await.expect("a good map");
    let request = opening("split", "second", std::slice::from_ref(&drive.sensor));
    let session = opened(door, request).await;
    send(door, &session, &batches).await;
    finished(door, &session).await.complete_in_version
}

/// From version to version every region goes on or is told to have ended, and no id comes back.
async fn ids_last<D: Door>(door: &D) {
    let newest = a_hall_becomes_one(door).await;
    assert!(2 < newest, "several versions");
    let mut gone: BTreeSet<u64> = BTreeSet::new();
    let first = ids(door, "split", 1).await;
    let mut before = first.clone();
    for number in 2..=newest {
        let graph = door.graph("split", number, NONE, false).await.expect("a graph");
        let now: BTreeSet<u64> = graph.regions.iter().map(|region| region.id).collect();
        let ended: BTreeSet<u64> = graph.ended.iter().map(|ended| ended.region).collect();
        assert!(before.difference(&now).eq(&ended), "{before:?} {now:?} {ended:?}");
        gone.extend(&ended);
        assert!(gone.is_disjoint(&now), "no id comes back");
        for ended in graph.ended {
            assert_eq!(ended.map_version, number, "{ended:?}");
            let asked = door.region("split", ended.region, 0).await.expect("it was there");
            assert_eq!(asked.state, Some(State::Ended(ended)), "and is told");
        }
        before = now;
    }
    assert!(!gone.is_disjoint(&first), "the part is no more: {first:?} {gone:?}");

    door.publish("split", 1).await.expect("1 exists");
    assert_eq!(ids(door, "split", 0).await, first, "rolling back brings the old ids back");
    for region in gone.intersection(&first) {
        let asked = door.region("split", *region, 0).await.expect("it is there again");
        assert!(matches!(asked.state, Some(State::Region(_))), "{asked:?}");
    }
    door.publish("split", newest).await.expect("the newest");
    let job = door.create_job("split").await.expect("a job");
    let done = eventually("the job's end", || async {
        let now = door.job(&job.id).await.expect("it was made");
        now.done.then_some(now)
    })
    .await;
    let graph = async |version| door.graph("split", version, NONE, true).await.expect("a graph");
    let (old, new) = (graph(newest).await, graph(done.result_version).await);
    assert!(old.regions == new.regions && old.arcs == new.arcs, "a rebuilt map is the same place");
}

async fn too_large_is_mapped_and_has_none<D: Door>(door: &D) {
    let (yaml, image) = two_rooms();
    door.import("large", &yaml, &image).await.expect("a good map");
    let refusal = refused(door.graph("large", 0, NONE, false).await, "MAP_TOO_LARGE");
    assert_eq!(refusal.fact("limit_cells"), "2000", "{refusal:?}");
    refused(door.region("large", 1, 0).await, "MAP_TOO_LARGE");
    door.grid("large", 0, None).await.expect("the grid is there");
}

/// Versions often enough that a short drive has several.
fn started(data: &std::path::Path) -> Running {
    Launch::at(data).setting("mapping.snapshot_scans", 60).start()
}

#[tokio::test(flavor = "multi_thread")]
async fn over_grpc() {
    let data = empty_folder();
    let service = started(data.path());
    rooms_and_their_door(&service.grpc()).await;
    ids_last(&service.grpc()).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn over_rest() {
    let data = empty_folder();
    let service = started(data.path());
    rooms_and_their_door(&service.rest()).await;
    ids_last(&service.rest()).await;
    let (grpc, rest) = (service.grpc(), service.rest());
    let both = [
        grpc.graph("split", 0, NONE, true).await.expect("a graph"),
        rest.graph("split", 0, NONE, true).await.expect("a graph"),
    ];
    assert!(both[0] == both[1], "both doors say the same");
    features(&service.http());
    drawn(&service);
}

#[tokio::test(flavor = "multi_thread")]
async fn over_a_limit() {
    let data = empty_folder();
    let service = Launch::at(data.path()).setting("mapping.topology_cells_max", 2000).start();
    too_large_is_mapped_and_has_none(&service.grpc()).await;
}

/// After a crash ids go on where they were.
#[tokio::test(flavor = "multi_thread")]
async fn ids_survive_a_crash() {
    let data = empty_folder();
    let service = started(data.path());
    let drive = SimulatedDrive::through_the_hall(3);
    let batches = drive.batches(20);
    let (early, late) = batches.split_at(batches.len() / 2);
    let session = driven(&service.grpc(), "hall", &drive, early).await;
    eventually("a version", || async {
        let map = service.grpc().map("hall").await.expect("it was made");
        (0 < map.published_version).then_some(())
    })
    .await;
    let before = ids(&service.grpc(), "hall", 0).await;
    service.kill();
    let service = started(data.path());
    send(&service.grpc(), &session, late).await;
    finished(&service.grpc(), &session).await;
    let after = ids(&service.grpc(), "hall", 0).await;
    assert!(!before.is_disjoint(&after), "the hall is still the hall: {before:?} {after:?}");
    for region in before.difference(&after) {
        let asked = service.grpc().region("hall", *region, 0).await.expect("it was there");
        assert!(matches!(asked.state, Some(State::Ended(_))), "its end is told");
    }
}

fn features(http: &Http) {
    let map = "rooms";
    let path = format!("/v1/maps/{map}/graph?format=geojson&version=1&pruned=none");
    let reply = http.get(&path);
    assert_eq!(reply.status, 200, "{}", reply.text());
    assert_eq!(reply.header("meetpoint-map-version"), "1", "{:?}", reply.headers);
    let known = http.get_with(&path, &[("if-none-match", reply.header("etag"))]);
    assert_eq!(known.status, 304, "it is known");
    let collection = reply.json();
    assert_eq!(collection["type"], "FeatureCollection", "{collection}");
    assert_eq!(
        (&collection["frame"], &collection["unit"]),
        (&"map".into(), &"metre".into()),
        "own"
    );
    let features = collection["features"].as_array().expect("features");
    let kind = |feature: &Value| {
        let names = [&feature["properties"]["kind"], &feature["geometry"]["type"]];
        names.map(|name| name.as_str().unwrap_or_default().to_owned()).join(" ")
    };
    let kinds: Vec<String> = features.iter().map(kind).collect();
    let expected =
        ["region Polygon", "region Polygon", "center Point", "center Point", "arc LineString"];
    assert_eq!(kinds, expected, "{collection}");
    let ring = features[0]["geometry"]["coordinates"][0].as_array().expect("a ring");
    assert!(4 <= ring.len() && ring.first() == ring.last(), "closed: {ring:?}");
    assert_eq!(features[4]["properties"]["regions"], serde_json::json!([1, 2]), "all attributes");
    let wrong = http.get(&format!("/v1/maps/{map}/graph?format=xml"));
    assert_eq!(wrong.problem()["code"], "INVALID_QUERY", "{}", wrong.text());
}

fn drawn(service: &Running) {
    let folder = empty_folder();
    let run = |arguments: &[&str]| {
        let url = service.url();
        let all = [&["graph", "rooms", "--server", &url], arguments].concat();
        let done = meetpoint(&all).output().expect("the binary under test starts");
        let told = String::from_utf8_lossy(&done.stderr).into_owned();
        (done.status.code(), String::from_utf8_lossy(&done.stdout).into_owned(), told)
    };
    let file = |name: &str| folder.path().join(name).to_str().expect("plain text").to_owned();
    let (png, geojson, json) = (file("a.png"), file("a.geojson"), file("a.json"));
    for path in [&png, &geojson, &json] {
        let (status, table, told) = run(&["--out", path]);
        assert_eq!(status, Some(0), "{told}");
        assert!(table.starts_with("map rooms, version 1: 2 regions and 1 arcs, 18 m2"), "{table}");
        assert!(table.contains("2 (0."), "a way to the other room: {table}");
    }
    let bytes = std::fs::read(&png).expect("it was written");
    assert_eq!(&bytes[..8], b"\x89PNG\r\n\x1a\n", "by its signature");
    let read = |path| -> Value {
        serde_json::from_slice(&std::fs::read(path).expect("it was written")).expect("JSON")
    };
    assert_eq!(read(&geojson)["features"].as_array().map(Vec::len), Some(5), "features");
    assert_eq!(read(&json)["arcs"][0]["regions"], serde_json::json!([1, 2]), "as REST gives it");
    let (status, told, _) = run(&["--json", "--pruned", "ends"]);
    let told: Value = serde_json::from_str(&told).expect("JSON");
    assert_eq!(
        (status, &told["regions"], &told["arcs"]),
        (Some(0), &1.into(), &0.into()),
        "{told}"
    );
    let (status, _, told) = run(&["--out", &file("a.gif")]);
    assert_eq!(status, Some(1), "{told}");
    assert!(told.contains(".png, .geojson or .json"), "{told}");
}
