//! Places and all that a robot hears of them on its way through a building.
//!
//! A robot drives where people tell it to, or it comes near everything in the building: now nearer to walls and now
//! farther, and sometimes it turns around. What stands between robot and place is told, so that nothing is learnt
//! of what nobody can hear.

use std::f64::consts::TAU;

use meetpoint_geometry::{Cell, Pose};
use meetpoint_occupancy::{HeardPlace, HeardView, SonarScan};
use meetpoint_sim::{Building, ChaCha8Rng, RoomParams, SonarRing, random_rooms};
use rand::{RngExt, SeedableRng};

use super::ground::{Ground, NoGround};
use super::places::{DISTANCE_M, FLOOR_M, Share, declared};
use super::tour::tour;

/// A firing every so far along the way, in metres: what robots that map draw.
const FIRING_M: f64 = 0.2;
/// Robots leave the middle of the way by up to this along each axis, in metres...
const ASIDE_M: f64 = 0.15;
/// ...and its direction by up to this, in radians...
const ASKEW_RAD: f64 = 0.3;
/// ...but stay this far off walls, in metres: a small robot's radius.
const RADIUS_M: f64 = 0.27;
/// Draws of a pose beside the way, before the way itself is taken.
const N_DRAWS: u32 = 20;
/// Of so many firings one is followed by others while the robot turns.
const N_FIRINGS_PER_TURN: u32 = 25;
/// Firings while a robot turns, and the angle between them, in radians.
const TURN: (std::ops::Range<u32>, f64) = (3..12, 0.2);
/// Places taken of a simulated floor: one of ten cells.
const N_PER_FLOOR: usize = 4_000;
/// Of places that nobody can hear, and of which something is heard all the same, so many are taken.
const HIDDEN_SHARE: f64 = 0.5;
/// Cells looked at for each place wanted, before it is given up.
const N_CELLS_PER_NEEDED: usize = 200;

/// Poses [`FIRING_M`] apart along a way, and its length, in metres.
pub(crate) fn firings(way: &[Pose]) -> (Vec<Pose>, f64) {
    let mut poses = Vec::new();
    let (mut way_m, mut fired_m) = (0.0, f64::NEG_INFINITY);
    for (index, &pose) in way.iter().enumerate() {
        way_m += if index == 0 { 0.0 } else { way[index - 1].step_to(pose).distance_m() };
        if fired_m + FIRING_M <= way_m {
            fired_m = way_m;
            poses.push(pose);
        }
    }
    (poses, way_m)
}

/// Places of floors with rooms that a seed determines, by rings of 24 and 16 in turn.
///
/// # Errors
/// [`NoGround`] if a floor cannot be used, which its parameters rule out.
pub(crate) fn simulated_ways(n: usize, seed: u64) -> Result<Vec<HeardPlace>, NoGround> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut found = Vec::with_capacity(n);
    let mut rings = [SonarRing::RING_24, SonarRing::RING_16].into_iter().cycle();
    while found.len() < n {
        let ground = Ground::of_building(random_rooms(FLOOR_M, &RoomParams::OFFICES, &mut rng)?);
        let n_wanted = N_PER_FLOOR.min(n - found.len());
        let Some(sonars) = rings.next() else { break };
        found.extend(on_a_way(&ground, &sonars, n_wanted, |_| true, &mut rng)?);
    }
    Ok(found)
}

/// Places of one building, half of them by a ring of 24 and half by one of 16.
///
/// # Errors
/// [`NoGround`] if no robot can be there, or little is known of where they are.
pub(crate) fn heard_places(
    ground: &Ground,
    n: usize,
    share: Share,
    seed: u64,
) -> Result<Vec<HeardPlace>, NoGround> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut found = Vec::with_capacity(n);
    for (sonars, n_wanted) in [(SonarRing::RING_24, n.div_ceil(2)), (SonarRing::RING_16, n / 2)] {
        let is_wanted = |cell: Cell| share.has(ground.building().info().frame.center_of(cell));
        found.extend(on_a_way(ground, &sonars, n_wanted, is_wanted, &mut rng)?);
    }
    if found.len() < n {
        return Err(NoGround::TooFewPlaces { n_found: found.len(), n_wanted: n });
    }
    Ok(found)
}

/// As many places of cells by lot, of which something is heard on one way; fewer if they are hard to find.
fn on_a_way(
    ground: &Ground,
    sonars: &SonarRing,
    n_wanted: usize,
    is_wanted: impl Fn(Cell) -> bool,
    rng: &mut ChaCha8Rng,
) -> Result<Vec<HeardPlace>, NoGround> {
    let building = ground.building();
    let heard = heard_on_the_way(ground, sonars, rng)?;
    let info = building.info();
    let side = |n_cells: u32| 0..i32::try_from(n_cells).unwrap_or(i32::MAX);
    let mut found = Vec::with_capacity(n_wanted);
    for _ in 0..N_CELLS_PER_NEEDED * n_wanted {
        if found.len() == n_wanted {
            break;
        }
        let (x, y) = (rng.random_range(side(info.width)), rng.random_range(side(info.height)));
        let cell = Cell { x, y };
        let Some(is_occupied) = ground.is_wall(cell).filter(|_| is_wanted(cell)) else { continue };
        let views = views(building, cell, &heard);
        let is_seen = views.iter().any(|heard| heard.is_in_sight);
        if is_seen || (!views.is_empty() && rng.random_bool(HIDDEN_SHARE)) {
            found.push(HeardPlace { views, is_occupied });
        }
    }
    Ok(found)
}

/// Firings along a way, each with the pose it was heard from.
fn heard_on_the_way(
    ground: &Ground,
    sonars: &SonarRing,
    rng: &mut ChaCha8Rng,
) -> Result<Vec<(Pose, SonarScan)>, NoGround> {
    let building = ground.building();
    let ring = declared(sonars);
    let mut heard = Vec::new();
    let mut fire = |pose: Pose, rng: &mut ChaCha8Rng| {
        heard.push((pose, ring.scan(&sonars.scan(building, pose, rng))));
    };
    if !ground.poses().is_empty() {
        for pose in firings(ground.poses()).0 {
            fire(pose, rng);
        }
        return Ok(heard);
    }
    let way = tour(building).map_err(|_| NoGround::NowhereFree)?;
    for pose in firings(&way).0 {
        let pose = beside(building, pose, rng);
        let turns = rng.random_range(0..N_FIRINGS_PER_TURN) == 0;
        let n_firings = if turns { rng.random_range(TURN.0) } else { 1 };
        for step in 0..n_firings {
            let theta_rad = (pose.theta_rad + TURN.1 * f64::from(step)) % TAU;
            fire(Pose::new(pose.x_m, pose.y_m, theta_rad), rng);
        }
    }
    Ok(heard)
}

/// A pose beside one of the way that a robot can take.
fn beside(building: &Building, pose: Pose, rng: &mut ChaCha8Rng) -> Pose {
    for _ in 0..N_DRAWS {
        let mut off = |most: f64| rng.random_range(-most..most);
        let (x_m, y_m) = (pose.x_m + off(ASIDE_M), pose.y_m + off(ASIDE_M));
        let beside = Pose::new(x_m, y_m, pose.theta_rad + off(ASKEW_RAD));
        if building.is_free(beside.position(), RADIUS_M) {
            return beside;
        }
    }
    pose
}

/// What was heard of a cell's middle, in order of time.
fn views(building: &Building, cell: Cell, heard: &[(Pose, SonarScan)]) -> Vec<HeardView> {
    let frame = building.info().frame;
    let (at, edge_m) = (frame.center_of(cell), frame.resolution_m());
    let is_wall = building.is_wall(cell);
    let view = |(pose, scan): &(Pose, SonarScan)| {
        let line = at - pose.position();
        let distance_m = line.norm();
        let is_near = DISTANCE_M.contains(&distance_m);
        let view = is_near.then(|| scan.view(pose.inverse() * at)).flatten()?;
        let hit = building.hit(pose.position(), line.y.atan2(line.x), distance_m);
        // A wall's own face stands before its middle.
        let is_in_sight = hit.is_none_or(|hit| is_wall && distance_m < hit.range_m + edge_m);
        Some(HeardView { view, is_in_sight })
    };
    heard.iter().filter_map(view).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use meetpoint_sim::hall;

    #[test]
    fn a_hall_is_heard_all_over_and_nothing_behind_its_walls_is_in_sight() {
        let ground = Ground::of_building(hall().building);
        let found = heard_places(&ground, 400, Share::Shown, 3).expect("a hall of 8 by 6 m");
        assert_eq!(found.len(), 400, "as many as asked for");
        let n_free = found.iter().filter(|place| !place.is_occupied).count();
        let is_seen = |place: &&HeardPlace| place.views.iter().any(|heard| heard.is_in_sight);
        let n_seen = found.iter().filter(|place| !place.is_occupied).filter(is_seen).count();
        assert!(9 * n_free < 10 * n_seen, "{n_seen} of {n_free} free places are seen");
        let again = heard_places(&ground, 400, Share::Shown, 3).expect("the same");
        assert_eq!(found, again, "the same from the same seed");
    }
}
