//! Buildings that come with the crate, for demonstrations and tests.

use meetpoint_geometry::Point2;

use crate::building::Building;

/// A building and ways through it.
#[derive(Clone, Debug)]
pub struct World {
    /// Walls and places.
    pub building: Building,
    /// Waypoints of drives that are worth making, one list a robot.
    pub tours: Vec<Vec<Point2<f64>>>,
}

/// An office of 40 m by 25 m: a corridor in a loop, 21 rooms around and within it, furniture. Two
/// tours, both beginning in the corridor and both going once around it.
///
/// # Panics
/// Never: the drawing is part of the crate and tested.
pub fn office() -> World {
    world(include_str!("../worlds/office.txt"), &["ACQCGDHSBEJEFKFA", "BIBSDPDCNCAMRFEOEB"])
}

/// A room of 8 m by 6 m with a pillar and a table: for fast tests.
///
/// # Panics
/// Never: the drawing is part of the crate and tested.
pub fn hall() -> World {
    world(include_str!("../worlds/hall.txt"), &["ABCDA"])
}

/// Three rooms and a corridor, 9 m by 7 m, with room for two robots to start at A and B: for robots
/// that explore.
///
/// # Panics
/// Never: the drawing is part of the crate and tested.
pub fn rooms() -> World {
    world(include_str!("../worlds/rooms.txt"), &["AB"])
}

/// A lab at A with door 1 to a corridor at B, and another way there by the room beside it, 12 m by 6 m: for doors
/// that are found closed.
///
/// # Panics
/// Never: the drawing is part of the crate and tested.
pub fn lab() -> World {
    world(include_str!("../worlds/lab.txt"), &["ABDCABDCA"])
}

/// A corridor of 1.5 m around a block, 16 m by 10 m: the shortest drive that closes a loop.
///
/// # Panics
/// Never: the drawing is part of the crate and tested.
pub fn corridor_loop() -> World {
    world(include_str!("../worlds/loop.txt"), &["ABCDAB"])
}

/// Edge of a character of the drawings in `worlds/`, in metres.
const CHARACTER_M: f64 = 0.25;

fn world(drawing: &str, tours: &[&str]) -> World {
    let building =
        Building::from_drawing(drawing, CHARACTER_M).expect("the crate's own drawings are valid");
    let tour = |names: &&str| building.places(names).expect("tours name places that are drawn");
    let tours = tours.iter().map(tour).collect();
    World { building, tours }
}
