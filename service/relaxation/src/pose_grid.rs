//! The grid of poses that beliefs live on (TBF98 section 5). Metres and radians become cells, and
//! cells metres and radians, in this file only.
//!
//! Positions are the nodes of a square lattice that has the frame's origin on it; headings are
//! equal parts of a turn, the x axis first, in a number that four divides, so that a quarter of a
//! turn carries the grid onto itself.

use std::f64::consts::{FRAC_PI_2, TAU};

use meetpoint_geometry::{Point2, Pose, wrap_angle};

use crate::spread::Spread;
use crate::window::Window;

/// Nodes a grid may have in the plane, so that no data from outside asks for more memory than that:
/// two thousand a side.
const N_NODES_MAX: u64 = 4_000_000;

/// Headings a grid may have: a quarter of a degree.
const N_HEADINGS_MAX: u32 = 1_440;

/// What was wrong with a grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum InvalidGrid {
    /// The distance of nodes was not finite and positive.
    Resolution(f64),
    /// Four does not divide the number of headings, or it is 0 or above 1,440.
    Headings(u32),
    /// The area is empty, not finite, or has more nodes than 4,000,000.
    Area,
}

impl std::fmt::Display for InvalidGrid {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Resolution(given) => write!(f, "resolution {given} m is not above 0"),
            Self::Headings(given) => {
                write!(f, "{given} headings: 4 must divide them, at most {N_HEADINGS_MAX}")
            }
            Self::Area => write!(f, "area is empty or has more than {N_NODES_MAX} nodes"),
        }
    }
}

impl std::error::Error for InvalidGrid {}

/// A rectangle of the plane, in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Area {
    /// Its lower-left corner.
    pub min: Point2<f64>,
    /// Its upper-right corner.
    pub max: Point2<f64>,
}

/// A pose of the grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct PoseCell {
    /// Index along x, from the frame's origin.
    pub x: i32,
    /// Index along y, from the frame's origin.
    pub y: i32,
    /// Which heading, from 0.
    pub heading: u32,
}

/// How poses and cells relate, and which cells there are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseGrid {
    resolution_m: f64,
    n_headings: u32,
    window: Window,
}

impl PoseGrid {
    /// A grid over an area, with nodes `resolution_m` metres apart.
    ///
    /// # Errors
    /// [`InvalidGrid`] says which number was out of bounds.
    #[expect(clippy::cast_possible_truncation, reason = "checked against the limit before")]
    pub fn new(area: Area, resolution_m: f64, n_headings: u32) -> Result<Self, InvalidGrid> {
        if !(resolution_m.is_finite() && 0.0 < resolution_m) {
            return Err(InvalidGrid::Resolution(resolution_m));
        }
        if n_headings == 0 || n_headings > N_HEADINGS_MAX || !n_headings.is_multiple_of(4) {
            return Err(InvalidGrid::Headings(n_headings));
        }
        let first = (area.min / resolution_m).map(f64::floor);
        let last = (area.max / resolution_m).map(f64::ceil);
        let reach = f64::from(i32::MAX / 4);
        let within = [first.x, first.y, last.x, last.y].iter().all(|index| index.abs() < reach);
        let (width, height) = (last.x - first.x + 1.0, last.y - first.y + 1.0);
        if !within || width < 1.0 || height < 1.0 || width * height > N_NODES_MAX as f64 {
            return Err(InvalidGrid::Area);
        }
        let window = Window {
            x: first.x as i32,
            y: first.y as i32,
            width: width as i32,
            height: height as i32,
        };
        Ok(Self { resolution_m, n_headings, window })
    }

    /// The area of the grid grown coarser: nodes and headings `factor` times as far apart, as far
    /// as four still divides the number of headings.
    pub fn coarser(&self, factor: u32) -> Self {
        let area = self.area();
        let n_headings = (self.n_headings / factor.max(1) / 4 * 4).max(4);
        let resolution_m = self.resolution_m * f64::from(factor.max(1));
        Self::new(area, resolution_m, n_headings).unwrap_or(*self)
    }

    /// Distance of neighbouring nodes, in metres.
    pub fn resolution_m(&self) -> f64 {
        self.resolution_m
    }

    /// Number of headings.
    pub fn n_headings(&self) -> u32 {
        self.n_headings
    }

    /// Angle between neighbouring headings, in radians.
    pub fn heading_step_rad(&self) -> f64 {
        TAU / f64::from(self.n_headings)
    }

    /// What the grid covers.
    pub fn area(&self) -> Area {
        let last = (self.window.right() - 1, self.window.top() - 1);
        Area {
            min: self.point_of(self.window.x, self.window.y),
            max: self.point_of(last.0, last.1),
        }
    }

    /// Number of nodes in the plane.
    pub fn n_nodes(&self) -> usize {
        self.window.n_cells()
    }

    /// Number of poses.
    pub fn n_cells(&self) -> usize {
        self.n_nodes() * self.n_headings as usize
    }

    /// The nodes.
    pub(crate) fn window(&self) -> Window {
        self.window
    }

    /// Where a node is, in metres.
    pub fn point_of(&self, x: i32, y: i32) -> Point2<f64> {
        Point2::new(f64::from(x) * self.resolution_m, f64::from(y) * self.resolution_m)
    }

    /// Which way a heading points, in (−π, π].
    pub fn heading_rad(&self, heading: u32) -> f64 {
        wrap_angle(f64::from(heading) * self.heading_step_rad())
    }

    /// The pose of a cell.
    pub fn pose_of(&self, cell: PoseCell) -> Pose {
        let point = self.point_of(cell.x, cell.y);
        Pose::new(point.x, point.y, self.heading_rad(cell.heading))
    }

    /// The cell nearest to a pose, inside the grid or not.
    #[expect(clippy::cast_possible_truncation, reason = "saturates far outside of any grid")]
    pub fn cell_at(&self, pose: Pose) -> PoseCell {
        let turns = (pose.theta_rad / self.heading_step_rad()).round() as i32;
        PoseCell {
            x: (pose.x_m / self.resolution_m).round() as i32,
            y: (pose.y_m / self.resolution_m).round() as i32,
            heading: self.turned(0, turns),
        }
    }

    /// The heading a number of steps further, to either side.
    #[expect(clippy::cast_possible_wrap, reason = "at most 1,440 headings")]
    pub fn turned(&self, heading: u32, steps: i32) -> u32 {
        (heading as i32 + steps).rem_euclid(self.n_headings as i32) as u32
    }

    /// How many quarters of a turn, and which heading of the first quarter, a heading is.
    pub(crate) fn quarter(&self, heading: u32) -> (u32, u32) {
        let n_quarter = self.n_headings / 4;
        (heading / n_quarter, heading % n_quarter)
    }

    /// The angle of the headings of one quarter, for those who build what the others share.
    pub(crate) fn quarter_headings(&self) -> impl Iterator<Item = f64> + use<> {
        let n_quarter = self.n_headings / 4;
        (0..n_quarter).map(move |heading| f64::from(heading) * FRAC_PI_2 / f64::from(n_quarter))
    }

    /// A displacement in metres and radians, counted in cells.
    pub(crate) fn in_cells(&self, spread: &Spread) -> (f64, f64, f64) {
        let Spread { x_m, y_m, turn_rad, .. } = *spread;
        (x_m / self.resolution_m, y_m / self.resolution_m, turn_rad / self.heading_step_rad())
    }

    /// Metres counted in nodes.
    pub(crate) fn in_nodes(&self, length_m: f64) -> f64 {
        length_m / self.resolution_m
    }

    /// Area that a node stands for, in square metres.
    pub(crate) fn node_area_m2(&self) -> f64 {
        self.resolution_m * self.resolution_m
    }

    /// Variance that splitting a displacement between neighbouring nodes adds on average, along
    /// each axis, in square metres: the mean of `f (1 - f)` for a fraction `f`.
    pub(crate) fn node_variance_m2(&self) -> f64 {
        self.node_area_m2() / 6.0
    }

    /// The same of splitting a turn between headings, in square radians.
    pub(crate) fn heading_variance_rad2(&self) -> f64 {
        self.heading_step_rad().powi(2) / 6.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn grid() -> PoseGrid {
        let area = Area { min: Point2::new(-10.2, -5.0), max: Point2::new(20.0, 5.1) };
        PoseGrid::new(area, 0.5, 72).expect("a grid")
    }

    #[test]
    fn the_origin_is_a_cell() {
        let cell = grid().cell_at(Pose::IDENTITY);
        assert_eq!(cell, PoseCell { x: 0, y: 0, heading: 0 }, "the lattice goes through it");
        assert_eq!(grid().pose_of(cell), Pose::IDENTITY, "exactly");
    }

    #[test]
    fn refuses_what_is_no_grid() {
        let area = Area { min: Point2::new(0.0, 0.0), max: Point2::new(1.0e9, 1.0) };
        assert_eq!(PoseGrid::new(area, 1.0, 72), Err(InvalidGrid::Area), "too large");
        assert_eq!(PoseGrid::new(grid().area(), 0.0, 72), Err(InvalidGrid::Resolution(0.0)), "0 m");
        assert_eq!(PoseGrid::new(grid().area(), 1.0, 70), Err(InvalidGrid::Headings(70)), "70");
        let nowhere = Area { min: Point2::new(f64::NAN, 0.0), max: Point2::new(1.0, 1.0) };
        assert_eq!(PoseGrid::new(nowhere, 1.0, 72), Err(InvalidGrid::Area), "not a number");
    }

    proptest! {
        #[test]
        fn a_cells_pose_is_its_own(x in -20..40, y in -10..10, heading in 0_u32..72) {
            let cell = PoseCell { x, y, heading };
            prop_assert_eq!(grid().cell_at(grid().pose_of(cell)), cell);
        }
    }
}
