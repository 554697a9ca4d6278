//! Four rooms around a crossing of walls, with a door between each and the next; a closet without a
//! door, beyond a strip that nobody saw.

use meetpoint_client::v1;
use v1::PlanCode as Code;

use crate::door::{Door, eventually};
use crate::imports::pgm;

/// Middles of the rooms, in metres: lower left, lower right, upper right, upper left.
pub(crate) const ROOMS: [v1::Point; 4] =
    [at(1.55, 1.55), at(4.65, 1.55), at(4.65, 4.75), at(1.55, 4.75)];
/// Within the closet.
pub(crate) const CLOSET: v1::Point = at(7.35, 5.75);
/// Never observed.
pub(crate) const STRIP: v1::Point = at(6.55, 1.0);

pub(crate) const fn at(x_m: f64, y_m: f64) -> v1::Point {
    v1::Point { x_m, y_m }
}

/// YAML and image: rooms of 3 m by 3 m, doors of 0.9 m, cells of 0.1 m.
pub(crate) fn four_rooms() -> (String, Vec<u8>) {
    let is_door = |along: usize| (10..19).contains(&along) || (41..50).contains(&along);
    let cell = |x: usize, y: usize| match (x, y) {
        (31, y) if is_door(y) => '.',
        (x, 31) if is_door(x) => '.',
        (0 | 31 | 62, _) | (0..=62, 0 | 31 | 62) | (67..=78, 0 | 11) | (67 | 78, 0..=11) => '#',
        (0..=62, _) | (67..=78, 0..=11) => '.',
        _ => '_',
    };
    let rows: Vec<String> = (0..63).map(|y| (0..79).map(|x| cell(x, y)).collect()).collect();
    let drawing: Vec<&str> = rows.iter().map(String::as_str).collect();
    let yaml = "image: rooms.pgm\nresolution: 0.1\norigin: [0, 0, 0]\nnegate: 0\n\
                occupied_thresh: 0.65\nfree_thresh: 0.196\n";
    (yaml.to_owned(), pgm(&drawing))
}

/// The rooms as map `rooms`, its published version.
pub(crate) async fn imported<D: Door>(door: &D) -> u64 {
    let (yaml, image) = four_rooms();
    door.import("rooms", &yaml, &image).await.expect("a good map").map_version
}

/// A question for the path between two points of map `rooms`.
pub(crate) fn asked(start: v1::Point, goal: v1::Point) -> v1::PlanPathRequest {
    let (start, goal) = (Some(start), Some(goal));
    v1::PlanPathRequest { map: "rooms".into(), start, goal, ..Default::default() }
}

/// The path between two points, which has to exist.
pub(crate) async fn path<D: Door>(door: &D, from: v1::Point, to: v1::Point) -> v1::PlannedPath {
    let reply = door.plan(asked(from, to)).await.expect("a good question");
    assert_eq!(reply.code(), Code::Ok, "{reply:?}");
    reply.path.expect("a path")
}

/// Waits until tables answer.
pub(crate) async fn tables_answer<D: Door>(door: &D) -> v1::PlanPathResponse {
    eventually("an answer by tables", || async {
        let reply = door.plan(asked(ROOMS[0], ROOMS[1])).await.expect("a good question");
        let by = reply.basis.as_ref().map(v1::PlanBasis::answered_by);
        (by == Some(v1::AnsweredBy::Tables)).then_some(reply)
    })
    .await
}

/// Ids of the arcs of a route.
pub(crate) fn arcs(path: &v1::PlannedPath) -> Vec<u64> {
    path.route.iter().skip(1).map(|step| step.arc).collect()
}
