//! Places around robots, what rings of sonars hear of them, and what is there.
//!
//! Half of the firings are of rings of 16 sonars and half of rings of 24. Where there is one building only,
//! squares of it are held out: what a network is judged by lies where it was never shown anything.

use std::f64::consts::TAU;

use meetpoint_geometry::Point2;
use meetpoint_occupancy::{Example, HeldOut, InverseCone, SonarRing};
use meetpoint_sim::{ChaCha8Rng, RoomParams, random_rooms};
use rand::{RngExt, SeedableRng};

use super::ground::{Ground, NoGround};

/// Places taken of a firing: a few, so that there are many firings.
const N_PER_FIRING: usize = 20;
/// Firings on a simulated floor.
const N_FIRINGS_PER_FLOOR: usize = 200;
/// Firings for each one that would do if all places were known and wanted, before it is given up.
const N_FIRINGS_PER_NEEDED: usize = 200;
/// Places are taken from so far to so far, in metres: the robot stands nearer, and cones are wider than doors
/// farther.
pub(super) const DISTANCE_M: std::ops::Range<f64> = 0.3..3.5;
/// Simulated floors, in metres.
pub(super) const FLOOR_M: (f64, f64) = (24.0, 16.0);
/// Edge of the squares that are held out or not, in metres: about a room.
const SQUARE_M: f64 = 4.0;
/// Of so many squares one is held out.
const N_SQUARES: i64 = 5;

/// Which part of a building places are taken from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Share {
    /// All but what is held out.
    Shown,
    /// What is held out: one of five squares of 4 m.
    HeldOut,
}

impl Share {
    pub(super) fn has(self, at: Point2<f64>) -> bool {
        #[expect(clippy::cast_possible_truncation, reason = "saturating")]
        let [column, row] = [at.x, at.y].map(|at_m| (at_m / SQUARE_M).floor() as i64);
        // Knight's moves: no two held out squares touch.
        let is_held_out = (column + 2 * row).rem_euclid(N_SQUARES) == 0;
        is_held_out == (self == Self::HeldOut)
    }
}

/// Places of floors with rooms that a seed determines.
///
/// # Errors
/// [`NoGround`] if a floor cannot be used, which its parameters rule out.
pub(crate) fn simulated(n: usize, seed: u64) -> Result<Vec<HeldOut>, NoGround> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut places = Vec::with_capacity(n);
    while places.len() < n {
        let floor = random_rooms(FLOOR_M, &RoomParams::OFFICES, &mut rng)?;
        let ground = Ground::of_building(floor);
        for index in 0..N_FIRINGS_PER_FLOOR {
            places.extend(firing(&ground, index, |_| true, &mut rng)?);
        }
    }
    places.truncate(n);
    Ok(places)
}

/// Places of one building.
///
/// # Errors
/// [`NoGround`] if no robot can be there, or little is known of where they are.
pub(crate) fn places(
    ground: &Ground,
    n: usize,
    share: Share,
    seed: u64,
) -> Result<Vec<HeldOut>, NoGround> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut places = Vec::with_capacity(n);
    let n_firings_max = N_FIRINGS_PER_NEEDED * n.div_ceil(N_PER_FIRING);
    for index in 0..n_firings_max {
        if n <= places.len() {
            places.truncate(n);
            return Ok(places);
        }
        places.extend(firing(ground, index, |at| share.has(at), &mut rng)?);
    }
    Err(NoGround::TooFewPlaces { n_found: places.len(), n_wanted: n })
}

/// Those of some places around a robot by lot that are wanted and known.
fn firing(
    ground: &Ground,
    index: usize,
    is_wanted: impl Fn(Point2<f64>) -> bool,
    rng: &mut ChaCha8Rng,
) -> Result<Vec<HeldOut>, NoGround> {
    let sonars = if index.is_multiple_of(2) {
        meetpoint_sim::SonarRing::RING_24
    } else {
        meetpoint_sim::SonarRing::RING_16
    };
    let robot = ground.pose(rng)?;
    let ranges_m = sonars.scan(ground.building(), robot, rng);
    let ring = declared(&sonars);
    let scan = ring.scan(&ranges_m);
    let frame = ground.building().info().frame;
    let mut found = Vec::new();
    for _ in 0..N_PER_FIRING {
        let place = place(rng);
        let at = robot * place;
        let known = is_wanted(at).then(|| ground.is_wall(frame.cell_at(at))).flatten();
        let (Some(is_occupied), Some(view)) = (known, scan.view(place)) else { continue };
        let by_cone = InverseCone::CLASSIC.evidence(&ring, &scan, place);
        found.push(HeldOut { example: Example { view, is_occupied }, by_cone });
    }
    Ok(found)
}

/// As many at every distance: near ones are asked more often than there is room for them.
fn place(rng: &mut ChaCha8Rng) -> Point2<f64> {
    let distance_m = rng.random_range(DISTANCE_M);
    let (sin, cos) = rng.random_range(0.0..TAU).sin_cos();
    Point2::new(distance_m * cos, distance_m * sin)
}

/// A simulated ring as robots declare it.
pub(crate) fn declared(sonars: &meetpoint_sim::SonarRing) -> SonarRing {
    SonarRing {
        robot_from_transducer: (0..sonars.n_sonars).map(|at| sonars.robot_from_sonar(at)).collect(),
        cone_rad: sonars.cone_rad,
        range_min_m: sonars.range_min_m,
        range_max_m: sonars.range_max_m,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use meetpoint_sim::hall;

    #[test]
    fn a_fifth_is_held_out_and_never_shown() {
        let at = |column: u8, row: u8| {
            Point2::new(4.0 * f64::from(column) + 1.0, 4.0 * f64::from(row) + 1.0)
        };
        let squares = (0..10).flat_map(|row| (0..10).map(move |column| at(column, row)));
        let n = squares.clone().filter(|&at| Share::HeldOut.has(at)).count();
        assert_eq!(n, 20, "of a hundred");
        let mut both = squares.filter(|&at| Share::HeldOut.has(at) == Share::Shown.has(at));
        assert_eq!(both.next(), None, "either shown or held out");
    }

    #[test]
    fn a_building_gives_as_many_places_as_asked_for() {
        let ground = Ground::of_building(hall().building);
        let found = places(&ground, 300, Share::HeldOut, 3).expect("a hall of 8 by 6 m");
        assert_eq!(found.len(), 300, "all of them");
        let n_occupied = found.iter().filter(|place| place.example.is_occupied).count();
        assert!(0 < n_occupied && n_occupied < 150, "{n_occupied} of 300 in walls");
        assert_eq!(
            places(&ground, 300, Share::HeldOut, 3),
            Ok(found),
            "the same from the same seed"
        );
    }
}
