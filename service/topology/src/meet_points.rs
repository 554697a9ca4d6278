//! Meet points: where the lines of the Voronoi diagram meet, turn, or end.
//!
//! ```text
//! junction   three lines or more meet            (degree 3 and above)
//! corner     a line turns by more than an angle  (degree 2)
//! dead end   a line ends                         (degree 1)
//! ```
//!
//! once the branches into the corners of walls are taken off, lest every corner of a room be a dead
//! end and every bend of a corridor a junction. A turn is measured between the two points that lie
//! an arm's length away along the diagram. B. Kuipers and Y.-T. Byun, "A robot exploration and mapping strategy based on a semantic
//! hierarchy of spatial representations", Robotics and Autonomous Systems 8 (1991), call such
//! places distinctive. Time O(cells of the diagram · arm).

use std::collections::HashSet;

use meetpoint_geometry::Point2;

use crate::bisectors::cosine;
use crate::clearance::Clearance;
use crate::lattice::Lattice;
use crate::neighborhood::Neighborhood;
use crate::spurs::without_spurs;
use crate::voronoi::Voronoi;
use crate::walk::Walk;

/// Tunables of [`meet_points`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeetPointParams {
    /// Length of the two arms between which a turn is measured, and of the shortest branch; within
    /// it, junctions count as one; in metres.
    pub arm_m: f64,
    /// A corner turns by at least this, in radians.
    pub turn_min_rad: f64,
}

impl MeetPointParams {
    /// Buildings for people: half a corridor's width of arm, half a right angle of turn.
    pub const INDOOR: Self = Self { arm_m: 0.8, turn_min_rad: std::f64::consts::FRAC_PI_4 };
}

/// What a line of the diagram does at a meet point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeetPointKind {
    /// Meets two others or more.
    Junction,
    /// Turns.
    Corner,
    /// Ends.
    DeadEnd,
}

/// A distinctive point of the diagram.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeetPoint {
    /// What it is.
    pub kind: MeetPointKind,
    /// The cell, by its place in the free space's row-major data.
    pub index: usize,
    /// Its middle, in the map's frame, in metres.
    pub position: Point2<f64>,
    /// Distance to the walls, in metres.
    pub clearance_m: f64,
}

/// The meet points of a diagram: junctions, then corners, then dead ends, each in the order of
/// their cells.
pub fn meet_points(
    voronoi: &Voronoi,
    clearance: &Clearance,
    params: &MeetPointParams,
) -> Vec<MeetPoint> {
    let info = voronoi.info();
    let lattice = Lattice::new(info);
    let arm = params.arm_m / info.frame.resolution_m();
    let voronoi = &without_spurs(voronoi, clearance, params.arm_m, f64::INFINITY);
    let of_degree = |is_wanted: fn(usize) -> bool| {
        let cells = voronoi.cells().iter().copied();
        cells.filter(move |&index| is_wanted(voronoi.degree(index)))
    };
    let junctions = thinned(voronoi, of_degree(|degree| 3 <= degree), arm, |index| {
        f64::from(clearance.squared()[index])
    });
    let turns: Vec<(usize, f64)> = of_degree(|degree| degree == 2)
        .filter_map(|index| Some((index, turn_rad(lattice, voronoi, index, arm)?)))
        .filter(|&(_, turn_rad)| params.turn_min_rad <= turn_rad)
        .collect();
    let turn_at = |index: usize| {
        turns.binary_search_by_key(&index, |turn| turn.0).map_or(0.0, |at| turns[at].1)
    };
    let corners = thinned(voronoi, turns.iter().map(|turn| turn.0), arm, turn_at);
    let ends: Vec<usize> = of_degree(|degree| degree == 1).collect();
    let of_kind = |kind, cells: Vec<usize>| {
        cells.into_iter().map(move |index| MeetPoint {
            kind,
            index,
            position: info.frame.center_of(lattice.cell(index)),
            clearance_m: clearance.at_m(index),
        })
    };
    of_kind(MeetPointKind::Junction, junctions)
        .chain(of_kind(MeetPointKind::Corner, corners))
        .chain(of_kind(MeetPointKind::DeadEnd, ends))
        .collect()
}

/// The cells that no better one lies near, ascending. Near is within `reach` cells along the
/// diagram.
fn thinned(
    voronoi: &Voronoi,
    cells: impl Iterator<Item = usize>,
    reach: f64,
    value: impl Fn(usize) -> f64,
) -> Vec<usize> {
    let mut order: Vec<usize> = cells.collect();
    order.sort_by(|&a, &b| value(b).total_cmp(&value(a)).then(a.cmp(&b)));
    let mut neighborhood = Neighborhood::new(voronoi);
    let (mut kept, mut near) = (vec![], HashSet::new());
    for index in order {
        if !near.contains(&index) {
            kept.push(index);
            near.extend(neighborhood.within(index, reach));
        }
    }
    kept.sort_unstable();
    kept
}

/// By how much the line turns at a cell, in radians; `None` if it is not that long on both sides.
fn turn_rad(lattice: Lattice, voronoi: &Voronoi, index: usize, arm: f64) -> Option<f64> {
    let mut walk = Walk::new(voronoi, index);
    let first = arm_end(voronoi, &mut walk, arm)?;
    let second = arm_end(voronoi, &mut walk.back_to(index), arm)?;
    let straight = cosine(lattice.offset(first, index), lattice.offset(index, second));
    Some(straight.clamp(-1.0, 1.0).acos())
}

/// Where a walk is after `arm` cells of way; `None` if the line ends or meets others before.
fn arm_end(voronoi: &Voronoi, walk: &mut Walk<'_>, arm: f64) -> Option<usize> {
    loop {
        let at = walk.step()?;
        if voronoi.degree(at) != 2 {
            return None;
        }
        if arm <= walk.length() {
            return Some(at);
        }
    }
}
