//! Smooth paths: a path of cells pulled tight, so that it is no staircase.
//!
//! The string is laid along the cells (`smooth/slack.rs`) and pulled tight around the corners of
//! obstacles grown by the robot (`smooth/string.rs`, `smooth/outline.rs`). It never comes nearer to
//! an obstacle, a square, than the robot's radius (`smooth/obstacles.rs`), but within the cells of
//! start and goal if they do. Where weights say that a straight way is dearer than the path, the
//! path stands. Time O(corners of the path + turns * rows of cells between them).

mod obstacles;
mod outline;
mod slack;
mod stadium;
mod string;
mod terrain;

use meetpoint_geometry::Point2;

pub use self::obstacles::Obstacles;
use self::outline::Outline;
use self::slack::{corners_of, slack};
use self::string::TautString;
use self::terrain::Terrain;
use crate::space::Space;

/// Radius of a robot that is a point, in cells: it passes between no two squares that touch.
const POINT_RADIUS: f64 = 1e-3;
/// How much farther from obstacles than asked for strings are pulled, in cells: rounding.
const MARGIN: f64 = 1e-6;
/// No robot is larger, in cells.
const RADIUS_MAX: f64 = 1e6;
/// A point on the border of a cell may lie so far outside of it, in cells.
const ROUNDING: f64 = 1e-9;
/// Beyond this clearance is not asked for, in cells: 12.8 m at 0.05 m.
const CLEARANCE_MAX: f64 = 256.0;

/// What a path of cells is pulled tight for.
#[derive(Clone, Copy, Debug)]
pub struct Passage<'a> {
    /// What stands in the way.
    pub obstacles: &'a Obstacles,
    /// Of the robot, in metres; at least 0.
    pub radius_m: f64,
    /// What cells cost beyond their length; `None` if nothing.
    pub weights: Option<&'a Space>,
    /// Where the path starts, in metres: a point of its first cell.
    pub start: Point2<f64>,
    /// Where it ends, in metres: a point of its last cell.
    pub goal: Point2<f64>,
}

impl Passage<'_> {
    /// Whether the straight way between the centres of two cells, by index, is clear; never where
    /// weights might make another way cheaper.
    pub fn is_clear(&self, from: usize, to: usize) -> bool {
        let info = self.obstacles.info();
        let width = info.width as usize;
        let center =
            |cell: usize| Point2::new((cell % width) as f64 + 0.5, (cell / width) as f64 + 0.5);
        let radius = radius_cells(self.radius_m / info.frame.resolution_m()) + MARGIN;
        self.weights.is_none() && self.obstacles.is_clear(center(from), center(to), radius)
    }
}

/// A path of straight pieces.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SmoothPath {
    /// Where it starts, turns and ends, in metres. Start and goal as asked for, if they lie in the
    /// first and last cell, else the centres of these.
    pub points: Vec<Point2<f64>>,
    /// Its length, in metres.
    pub length_m: f64,
    /// From the path to the nearest obstacle, in metres: at least the robot's radius, unless start
    /// or goal are nearer. At most 256 cells.
    pub clearance_min_m: f64,
}

/// What pulling writes on.
#[derive(Clone, Debug, Default)]
pub struct SmoothScratch {
    corners: Vec<Point2<f64>>,
    string: TautString,
}

/// The path of `cells`, by index, pulled tight; empty if there are no cells.
///
/// The cells must be a path of the space that is enterable for the radius.
pub fn smooth(
    passage: &Passage,
    cells: impl Iterator<Item = usize>,
    scratch: &mut SmoothScratch,
) -> SmoothPath {
    let obstacles = passage.obstacles;
    let info = obstacles.info();
    let radius = radius_cells(passage.radius_m / info.frame.resolution_m());
    let terrain = Terrain { obstacles, radius: radius + MARGIN, weights: passage.weights };
    let SmoothScratch { corners, string } = scratch;
    corners_of(cells, info.width as usize, corners);
    let (Some(&first), Some(&last)) = (corners.first(), corners.last()) else {
        return SmoothPath::default();
    };
    let start = End::new(&terrain, passage.start, first);
    let goal = End::new(&terrain, passage.goal, last);
    if start.is_on_string() {
        corners.insert(0, start.point);
    }
    if goal.is_on_string() {
        corners.push(goal.point);
    }
    let kept = slack(&terrain, corners).into_iter().map(|at| corners[at]);
    string.lay(kept);
    string.pull(&terrain, &Outline::new(radius + 2.0 * MARGIN));
    let mut points: Vec<_> = string.points().collect();
    if start.is_off_string() {
        points.insert(0, start.point);
    }
    if goal.is_off_string() {
        points.push(goal.point);
    }
    measured(obstacles, radius, [&start, &goal], &points)
}

/// The radius that a string is pulled for; no number is a point.
fn radius_cells(asked: f64) -> f64 {
    if asked.is_nan() { POINT_RADIUS } else { asked.clamp(POINT_RADIUS, RADIUS_MAX) }
}

/// An end of a path.
struct End {
    /// In cells.
    point: Point2<f64>,
    /// The same in metres, as asked for; `None` if it is the centre of the cell instead.
    asked: Option<Point2<f64>>,
    /// Whether the way to the centre of its cell is clear.
    is_clear: bool,
}

impl End {
    /// The end asked for, in metres, of a path that has an end in the cell of that `center`.
    fn new(terrain: &Terrain, asked: Point2<f64>, center: Point2<f64>) -> Self {
        let point = terrain.obstacles.in_cells(asked);
        if (point - center).amax() <= 0.5 + ROUNDING {
            let is_clear = terrain.is_clear(point, center);
            Self { point, asked: Some(asked), is_clear }
        } else {
            Self { point: center, asked: None, is_clear: true }
        }
    }

    /// Whether the string starts here, and not at the centre of the cell.
    fn is_on_string(&self) -> bool {
        self.asked.is_some() && self.is_clear
    }

    /// Whether the string starts at the centre of the cell, and the path does not.
    fn is_off_string(&self) -> bool {
        self.asked.is_some() && !self.is_clear
    }
}

/// A path through points given in cells.
fn measured(
    obstacles: &Obstacles,
    radius: f64,
    ends: [&End; 2],
    points: &[Point2<f64>],
) -> SmoothPath {
    let resolution_m = obstacles.info().frame.resolution_m();
    let length: f64 = points.windows(2).map(|ends| (ends[1] - ends[0]).norm()).sum();
    let clearance = clearance(obstacles, radius, points);
    let mut points: Vec<_> = points.iter().map(|&point| obstacles.in_metres(point)).collect();
    let last = points.len() - 1;
    for (place, end) in [0, last].into_iter().zip(ends) {
        points[place] = end.asked.unwrap_or(points[place]);
    }
    SmoothPath {
        points,
        length_m: length * resolution_m,
        clearance_min_m: clearance * resolution_m,
    }
}

/// From the path to the nearest obstacle, in cells.
fn clearance(obstacles: &Obstacles, radius: f64, points: &[Point2<f64>]) -> f64 {
    let mut reach = radius + 1.0;
    loop {
        let nearest = |nearest: f64, [a, b]: [Point2<f64>; 2]| obstacles.distance(a, b, nearest);
        let alone = [points[0]; 2];
        let pieces = points.windows(2).map(|ends| [ends[0], ends[1]]);
        let found = std::iter::once(alone).chain(pieces).fold(reach, nearest);
        if found < reach || CLEARANCE_MAX <= reach {
            return found;
        }
        reach = (4.0 * reach).min(CLEARANCE_MAX);
    }
}
