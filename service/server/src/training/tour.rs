//! A tour that comes near everything in a building: always on to the nearest place not seen yet, as far as one
//! who knows the floor plan sees it.
//!
//! Value iteration over the free cells (T98 2.5), with those not seen as its goals; a cell is seen from nearer
//! than [`SEEN_M`] in a line of sight.

use anyhow::Context;
use meetpoint_geometry::{Cell, Point2, Pose};
use meetpoint_planning::{Ground, ValueIteration};
use meetpoint_sim::Building;

/// The robot keeps this off walls, in metres: it passes between furniture and walls.
const CLEARANCE_M: f64 = 0.3;
/// What is nearer is seen, in metres: sonar tells well so far.
const SEEN_M: f64 = 2.5;
/// Steps of the way between looks.
const N_STEPS_PER_LOOK: usize = 3;
/// A pose looks to where the way goes so many steps on.
const N_STEPS_AHEAD: usize = 4;

/// Poses along the tour, a cell apart, until everything that can be seen was.
pub(crate) fn tour(building: &Building) -> anyhow::Result<Vec<Pose>> {
    let info = building.info();
    let edge_m = info.frame.resolution_m();
    #[expect(clippy::cast_possible_truncation, reason = "a length of some centimetres")]
    let ground = |cell: Cell| {
        let is_free = building.is_free(info.frame.center_of(cell), CLEARANCE_M);
        Ground { cost: if is_free { edge_m as f32 } else { f32::INFINITY }, is_goal: is_free }
    };
    let ground: Vec<Ground> = info.cells().map(ground).collect();
    let mut iteration = ValueIteration::new(info, &ground, std::f32::consts::SQRT_2)
        .map_err(|error| anyhow::anyhow!("{error}"))?;
    let first = ground.iter().position(|ground| ground.is_goal).context("a robot fits nowhere")?;
    let mut seen: Vec<bool> = ground.iter().map(|ground| !ground.is_goal).collect();
    let mut way = vec![first];
    loop {
        let here = way[way.len() - 1];
        look(building, here, &mut seen, |at| {
            iteration.set(at, Ground { is_goal: false, ..ground[at] });
        });
        iteration.settle(u32::MAX);
        let path = iteration.path(here);
        if !iteration.value(here).is_finite() || path.len() < 2 {
            break;
        }
        way.extend(path.into_iter().skip(1).take(N_STEPS_PER_LOOK));
    }
    let at = |index: usize| info.frame.center_of(iteration.cell(way[index.min(way.len() - 1)]));
    let pose = |index: usize| {
        let (here, ahead) = (at(index), at(index + N_STEPS_AHEAD));
        Pose::new(here.x, here.y, (ahead.y - here.y).atan2(ahead.x - here.x))
    };
    Ok((0..way.len()).map(pose).collect())
}

/// Marks what is seen from a cell, and tells each cell that is new.
fn look(building: &Building, from: usize, seen: &mut [bool], mut tell: impl FnMut(usize)) {
    let info = building.info();
    let width = info.width as usize;
    let index = |n: usize| i32::try_from(n).unwrap_or(i32::MAX);
    let here = Cell { x: index(from % width), y: index(from / width) };
    let eye = info.frame.center_of(here);
    #[expect(clippy::cast_possible_truncation, reason = "some cells")]
    let reach = (SEEN_M / info.frame.resolution_m()) as i32;
    let around = (-reach..=reach).flat_map(|y| (-reach..=reach).map(move |x| (x, y)));
    for (x, y) in around {
        let cell = Cell { x: here.x + x, y: here.y + y };
        let Some(at) = info.index_of(cell).filter(|&at| !seen[at]) else { continue };
        if is_in_sight(building, eye, info.frame.center_of(cell)) {
            seen[at] = true;
            tell(at);
        }
    }
}

fn is_in_sight(building: &Building, eye: Point2<f64>, place: Point2<f64>) -> bool {
    let line = place - eye;
    let distance_m = line.norm();
    distance_m <= SEEN_M
        && building
            .hit(eye, line.y.atan2(line.x), distance_m)
            .is_none_or(|hit| distance_m <= hit.range_m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use meetpoint_sim::hall;

    #[test]
    fn everything_in_a_hall_is_seen() {
        let building = hall().building;
        let poses = tour(&building).expect("a robot fits");
        let info = building.info();
        for cell in info.cells() {
            let place = info.frame.center_of(cell);
            let is_seen = |pose: &Pose| is_in_sight(&building, pose.position(), place);
            let is_free = building.is_free(place, CLEARANCE_M);
            assert!(!is_free || poses.iter().any(is_seen), "{place:?} was not seen");
        }
        let is_near = |pair: &[Pose]| pair[0].step_to(pair[1]).distance_m() < 0.4;
        assert!(poses.windows(2).all(is_near), "step by step");
    }
}
