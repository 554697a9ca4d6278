//! The medial axis of free space: its nodes, and the lines between them.
//!
//! Nodes are those of the skeleton, and the rooms that a line passes: where it is widest between
//! two places that are narrower,
//!
//! ```text
//! D(room) >= widening · min D on the way back to the last room or node, and on the way on
//! ```
//!
//! A line that ends beside what was never observed does not end there: HSSH 2004, section III-A,
//! has the place explored before it is analysed; a map that is cut off, or not finished, is not.

use meetpoint_geometry::{Cell, GridInfo, Point2};
use meetpoint_occupancy::Raster;
use meetpoint_topology::{Clearance, FreeSpace, clearance, skeleton, voronoi};

use crate::local::params::LocalParams;

/// What a node of the axis is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum NodeKind {
    /// Three lines or more meet.
    Junction,
    /// A room that a line passes.
    Room,
    /// A line ends before walls.
    End,
    /// A line ends before what was never observed.
    Frontier,
}

/// A node of the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AxisNode {
    pub(crate) kind: NodeKind,
    /// Its cell, by index in the free space.
    pub(crate) cell: usize,
}

/// A line between two nodes, which may be the same.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct AxisLine {
    pub(crate) nodes: [usize; 2],
    /// Two at least, from the one to the other.
    pub(crate) cells: Vec<usize>,
}

/// Free space and its axis.
pub(crate) struct MedialAxis {
    /// Cells that a robot sees across: those that are free.
    pub(crate) space: FreeSpace,
    /// Distance to walls, furniture left out.
    pub(crate) clearance: Clearance,
    pub(crate) nodes: Vec<AxisNode>,
    pub(crate) lines: Vec<AxisLine>,
}

impl MedialAxis {
    /// Of the free cells of `raster`.
    pub(crate) fn new(raster: &Raster, params: &LocalParams) -> Self {
        let space = FreeSpace::from_raster(raster, FreeSpace::PROBABILITY_MAX);
        let open = space.without_islands(params.island_extent_max_m);
        let clearance = clearance(&open);
        let diagram = voronoi(&open, &clearance, &params.voronoi);
        let found = skeleton(&diagram, &clearance, params.arm_m);
        let mut axis = Self { space, clearance, nodes: vec![], lines: vec![] };
        let mut degrees = vec![0; found.nodes.len()];
        for node in found.lines.iter().flat_map(|line| line.nodes) {
            degrees[node] += 1;
        }
        for (&cell, degree) in found.nodes.iter().zip(degrees) {
            let kind = match degree {
                0 | 1 if axis.borders_on_unknown(raster, cell, params) => NodeKind::Frontier,
                0 | 1 => NodeKind::End,
                2 => NodeKind::Room,
                _ => NodeKind::Junction,
            };
            axis.nodes.push(AxisNode { kind, cell });
        }
        for line in found.lines {
            axis.add_line(line.nodes, &line.cells, params.neighborhood.room_widening_min);
        }
        axis
    }

    /// Adds a line, cut where it passes rooms.
    fn add_line(&mut self, [from, to]: [usize; 2], cells: &[usize], widening_min: f64) {
        let profile: Vec<f64> = cells.iter().map(|&cell| self.clearance.at_m(cell)).collect();
        let (mut first, mut begin) = (from, 0);
        for at in rooms(&profile, widening_min) {
            let room = self.nodes.len();
            self.nodes.push(AxisNode { kind: NodeKind::Room, cell: cells[at] });
            self.lines.push(AxisLine { nodes: [first, room], cells: cells[begin..=at].to_vec() });
            (first, begin) = (room, at);
        }
        self.lines.push(AxisLine { nodes: [first, to], cells: cells[begin..].to_vec() });
    }

    /// Whether the free cells around the end of a line border on what was never observed, along
    /// enough of a length: as far as the nearest wall, and a cell more.
    fn borders_on_unknown(&self, raster: &Raster, end: usize, params: &LocalParams) -> bool {
        let info = self.info();
        let resolution_m = info.frame.resolution_m();
        let middle = self.point(end);
        let reach_m = self.clearance.at_m(end) + 2.0 * resolution_m;
        let is_unknown = |cell: Cell| {
            raster.info.index_of(cell).is_none_or(|index| raster.log_odds[index].is_nan())
        };
        let is_frontier = |index: &usize| {
            self.space.is_free()[*index]
                && beside(cell_of(info, *index)).into_iter().any(is_unknown)
                && (self.point(*index) - middle).norm() <= reach_m
        };
        let n_cells = cells_around(info, end, reach_m).filter(is_frontier).count();
        params.frontier_min_m <= n_cells as f64 * resolution_m
    }

    /// Which cells.
    pub(crate) fn info(&self) -> GridInfo {
        self.space.info()
    }

    /// The middle of a cell, in metres.
    pub(crate) fn point(&self, index: usize) -> Point2<f64> {
        self.info().frame.center_of(cell_of(self.info(), index))
    }

    /// Distance to the walls at a node, in metres.
    pub(crate) fn clearance_at_m(&self, node: usize) -> f64 {
        self.clearance.at_m(self.nodes[node].cell)
    }

    /// Length of a line, in metres.
    pub(crate) fn length_m(&self, line: &AxisLine) -> f64 {
        line.cells.windows(2).map(|pair| (self.point(pair[1]) - self.point(pair[0])).norm()).sum()
    }
}

/// The name of the cell at a place of row-major data.
pub(crate) fn cell_of(info: GridInfo, index: usize) -> Cell {
    let width = (info.width as usize).max(1);
    let along = |first: i32, n: usize| first.saturating_add_unsigned(u32::try_from(n).unwrap_or(0));
    Cell { x: along(info.first.x, index % width), y: along(info.first.y, index / width) }
}

/// The four cells beside one.
pub(crate) fn beside(Cell { x, y }: Cell) -> [Cell; 4] {
    let [left, right] = [x.saturating_sub(1), x.saturating_add(1)];
    let [below, above] = [y.saturating_sub(1), y.saturating_add(1)];
    [Cell { x: right, y }, Cell { x, y: above }, Cell { x: left, y }, Cell { x, y: below }]
}

/// Places of the cells of a square around one, those inside of `info`, row by row.
pub(crate) fn cells_around(
    info: GridInfo,
    index: usize,
    reach_m: f64,
) -> impl Iterator<Item = usize> {
    #[expect(clippy::cast_possible_truncation, reason = "saturates, and is clipped below")]
    let reach = (reach_m / info.frame.resolution_m()).ceil() as i32;
    let middle = cell_of(info, index);
    let along = move |at: i32| at.saturating_sub(reach)..=at.saturating_add(reach);
    let cells = along(middle.y).flat_map(move |y| along(middle.x).map(move |x| Cell { x, y }));
    cells.filter_map(move |cell| info.index_of(cell))
}

/// Where along a line rooms are, given the clearance of its cells: the middles of the widest cells
/// between two that are narrower by the factor.
fn rooms(profile: &[f64], widening_min: f64) -> Vec<usize> {
    let mut rooms = vec![];
    let (mut narrowest, mut widest): (f64, Option<f64>) = (f64::INFINITY, None);
    let mut top = 0..=0;
    for (at, &clearance) in profile.iter().enumerate() {
        match widest {
            None => {
                narrowest = narrowest.min(clearance);
                if widening_min * narrowest <= clearance {
                    (widest, top) = (Some(clearance), at..=at);
                }
            }
            Some(most) if most <= clearance => {
                let begin = if most < clearance { at } else { *top.start() };
                (widest, top) = (Some(clearance), begin..=at);
            }
            Some(most) if widening_min * clearance <= most => {
                rooms.push(usize::midpoint(*top.start(), *top.end()));
                (widest, narrowest) = (None, clearance);
            }
            Some(_) => {}
        }
    }
    rooms
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rooms_lie_between_narrows() {
        let rooms = |profile: &[f64]| rooms(profile, 1.5);
        assert_eq!(rooms(&[2.0, 0.4, 0.4, 2.0]), [0; 0], "a door between two nodes");
        assert_eq!(rooms(&[2.0, 0.4, 1.0, 2.0, 2.0, 2.0, 0.4, 2.0]), [4], "the middle of one");
        assert_eq!(rooms(&[1.0, 1.0, 1.2, 1.0, 1.0]), [0; 0], "a corner of a corridor");
        assert_eq!(rooms(&[0.4, 1.0, 0.4, 3.0, 0.5, 9.0]), [1, 3], "two rooms, and the end");
    }
}
