//! A map that was drawn is parsed into places: a crossing, what it leads to, and a dead end.

use meetpoint_client::v1;
use serde_json::Value;

use crate::door::{Door, refused};
use crate::imports::pgm;
use crate::place_door::PlaceDoor;
use crate::running::{Launch, Running, empty_folder, meetpoint};

/// A corridor from west to east that a second one crosses and a third one leaves, a metre a character;
/// cells of 0.1 m.
const CORRIDORS: [&str; 10] = [
    "#########..###################",
    "#########..###################",
    "#########..###################",
    "#########..###################",
    ".............................#",
    ".............................#",
    "#########..#########..########",
    "#########..#########..########",
    "#########..#########..########",
    "#########..#########..########",
];

async fn drawn<D: Door>(door: &D) -> u64 {
    let wide = |row: &str| row.chars().flat_map(|sign| [sign; 10]).collect::<String>();
    let rows: Vec<String> =
        CORRIDORS.iter().flat_map(|row| std::iter::repeat_n(wide(row), 10)).collect();
    let drawing: Vec<&str> = rows.iter().map(String::as_str).collect();
    let yaml = "image: a.pgm\nresolution: 0.1\norigin: [0, 0, 0]\nnegate: 0\n\
                occupied_thresh: 0.65\nfree_thresh: 0.196\n";
    door.import("corridors", yaml, &pgm(&drawing)).await.expect("a good map").map_version
}

fn asked(version: u64) -> v1::ListPlacesRequest {
    v1::ListPlacesRequest { map: "corridors".to_owned(), version, ..Default::default() }
}

async fn corridors_are_parsed<D: PlaceDoor>(door: &D) -> v1::ListPlacesResponse {
    let version = drawn(door).await;
    let reply = door.grid_places(asked(0)).await.expect("a published map");
    assert_eq!(reply.map_version, version, "it is named");
    assert_eq!(reply.place_count as usize, reply.places.len(), "on one page");
    let mut stars: Vec<&str> = reply.places.iter().map(|place| place.star.as_str()).collect();
    stars.sort_unstable();
    assert_eq!(stars, ["a", "aba", "abab"], "dead end, junction, crossing: {reply:?}");
    assert_eq!((reply.edges, reply.paths), (2, 3), "{reply:?}");
    for place in &reply.places {
        let numbers = place.fragments.iter().map(|fragment| fragment.number);
        let mut numbers: Vec<u32> = numbers.collect();
        numbers.sort_unstable();
        assert!(numbers.chunks(2).all(|pair| pair[0] == pair[1]), "both directions: {place:?}");
        for (index, gateway) in (0..).zip(&place.gateways) {
            assert!((1.9..2.4).contains(&gateway.width_m), "a corridor of two metres: {gateway:?}");
            assert_eq!(gateway.law(), v1::TravelLaw::Midline, "{gateway:?}");
            if let Some(to) = gateway.to_place {
                let back = &reply.places[to as usize].gateways[gateway.to_gateway as usize];
                let led = (back.to_place, back.to_gateway);
                assert_eq!(led, (Some(place.number), index), "and back: {reply:?}");
            }
        }
    }
    pages(door, &reply).await;
    reply
}

async fn pages<D: PlaceDoor>(door: &D, reply: &v1::ListPlacesResponse) {
    let mut request = v1::ListPlacesRequest { page_size: 1, ..asked(0) };
    let mut paged = Vec::new();
    loop {
        let page = door.grid_places(request.clone()).await.expect("a page");
        assert_eq!(page.place_count, reply.place_count, "of all pages");
        paged.extend(page.places);
        request.page_token = page.next_page_token;
        if request.page_token.is_empty() {
            break;
        }
    }
    assert_eq!(paged, reply.places, "pages are the whole");
    let wrong = v1::ListPlacesRequest { page_token: "x".to_owned(), ..asked(0) };
    refused(door.grid_places(wrong).await, "INVALID_FIELD");
    refused(door.grid_places(asked(9)).await, "VERSION_NOT_FOUND");
    let elsewhere = v1::ListPlacesRequest { map: "nowhere".to_owned(), ..asked(0) };
    refused(door.grid_places(elsewhere).await, "MAP_NOT_FOUND");
    door.create_map("empty", 0.05).await.expect("a new map");
    let empty = v1::ListPlacesRequest { map: "empty".to_owned(), ..asked(0) };
    refused(door.grid_places(empty).await, "NOTHING_PUBLISHED");
}

fn by_command(service: &Running, options: &[&str]) -> String {
    let url = service.url();
    let words = [&["places", "corridors", "--server", &url], options].concat();
    let done = meetpoint(&words).output().expect("the binary under test starts");
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    String::from_utf8(done.stdout).expect("text")
}

#[tokio::test(flavor = "multi_thread")]
async fn over_grpc_and_by_command() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    let reply = corridors_are_parsed(&service.grpc()).await;
    let told = by_command(&service, &[]);
    assert!(told.contains("3 places, 2 ways between their gateways, 3 paths"), "{told}");
    let folder = empty_folder();
    let file = folder.path().join("places.png");
    let name = file.to_str().expect("a name");
    let body: Value =
        serde_json::from_str(&by_command(&service, &["--json", "--png", name])).expect("JSON");
    assert_eq!(body["places"].as_array().map(Vec::len), Some(reply.places.len()), "{body}");
    let bytes = std::fs::read(&file).expect("it was written");
    assert!(bytes.starts_with(b"\x89PNG"), "a picture");
}

#[tokio::test(flavor = "multi_thread")]
async fn over_rest() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    corridors_are_parsed(&service.rest()).await;
}
