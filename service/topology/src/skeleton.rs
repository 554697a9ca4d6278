//! The skeleton of free space: the Voronoi diagram as a graph, without its spurs.
//!
//! A node is where three lines or more meet, or where one ends; a line is the way along the diagram
//! from one node to the next. Cells of the diagram hang together along the axes, and diagonally
//! where no cell of the diagram joins the two. Nodes that touch each other are one. A ring that
//! meets nothing has its widest cell for a node. Time O(cells of the diagram) after the
//! spurs are taken off, space O(cells).

use std::collections::HashSet;

use crate::clearance::Clearance;
use crate::lattice::Lattice;
use crate::spurs::without_spurs;
use crate::voronoi::Voronoi;

/// From the end of a branch on, as far its slope tells whether it leads into a corner, in metres: no
/// more than is seen of the floor behind a door from before it.
const TAIL_M: f64 = 0.5;

/// Where lines meet or end, and the lines.
#[derive(Clone, Debug, PartialEq)]
pub struct Skeleton {
    /// Of every node its cell with the largest clearance, by its place in the free space's
    /// row-major data; in the order of their first cells.
    pub nodes: Vec<usize>,
    /// The lines, in the order of the nodes where they begin.
    pub lines: Vec<SkeletonLine>,
}

/// A line between two nodes, which may be the same.
#[derive(Clone, Debug, PartialEq)]
pub struct SkeletonLine {
    /// Where it begins and where it ends.
    pub nodes: [usize; 2],
    /// Its cells from the one to the other, a cell of each node included: two at least.
    pub cells: Vec<usize>,
}

/// The skeleton of a diagram. Branches shorter than `arm_m`, in metres, or into the corners of
/// walls, are left out.
pub fn skeleton(voronoi: &Voronoi, clearance: &Clearance, arm_m: f64) -> Skeleton {
    let pruned = without_spurs(voronoi, clearance, arm_m, TAIL_M);
    let mut tracing = Tracing::new(&pruned, clearance);
    tracing.meet();
    tracing.close_rings();
    let lines = tracing.lines();
    Skeleton { nodes: tracing.nodes, lines }
}

/// A cell that belongs to no node.
const ON_LINE: u32 = u32::MAX;

struct Tracing<'a> {
    lattice: Lattice,
    voronoi: &'a Voronoi,
    clearance: &'a Clearance,
    /// One a cell of the diagram, in its order.
    node_of: Vec<u32>,
    nodes: Vec<usize>,
    /// Cells of every node.
    members: Vec<Vec<usize>>,
}

impl<'a> Tracing<'a> {
    fn new(voronoi: &'a Voronoi, clearance: &'a Clearance) -> Self {
        let lattice = Lattice::new(voronoi.info());
        let node_of = vec![ON_LINE; voronoi.cells().len()];
        Self { lattice, voronoi, clearance, node_of, nodes: vec![], members: vec![] }
    }

    /// Cells that a step along the diagram leads to.
    fn neighbors(&self, index: usize) -> impl Iterator<Item = usize> + use<> {
        let around = self.lattice.around(index);
        let on = around.map(|neighbor| self.voronoi.is_on()[neighbor]);
        let leads =
            move |&at: &usize| on[at] && (at % 2 == 0 || (!on[at - 1] && !on[(at + 1) % 8]));
        (0..8).filter(leads).map(move |at| around[at])
    }

    fn node(&self, index: usize) -> Option<usize> {
        let at = self.voronoi.cells().binary_search(&index).ok()?;
        let node = self.node_of[at];
        (node != ON_LINE).then_some(node as usize)
    }

    fn make_node(&mut self, cells: Vec<usize>) {
        let widest = |&a: &usize, &b: &usize| {
            let [a_squared, b_squared] = [a, b].map(|cell| self.clearance.squared()[cell]);
            a_squared.cmp(&b_squared).then(b.cmp(&a))
        };
        let Some(index) = cells.iter().copied().max_by(widest) else { return };
        let node = u32::try_from(self.nodes.len()).unwrap_or(ON_LINE);
        for cell in &cells {
            if let Ok(at) = self.voronoi.cells().binary_search(cell) {
                self.node_of[at] = node;
            }
        }
        self.nodes.push(index);
        self.members.push(cells);
    }

    /// Nodes where lines meet or end.
    fn meet(&mut self) {
        for &start in self.voronoi.cells() {
            let degree = self.neighbors(start).count();
            if degree == 2 || self.node(start).is_some() {
                continue;
            }
            let mut cells = vec![start];
            let mut at = 0;
            while 3 <= degree && at < cells.len() {
                for next in self.neighbors(cells[at]) {
                    if 3 <= self.neighbors(next).count() && !cells.contains(&next) {
                        cells.push(next);
                    }
                }
                at += 1;
            }
            self.make_node(cells);
        }
    }

    /// A node on every ring that has none.
    fn close_rings(&mut self) {
        let mut passed: HashSet<usize> = HashSet::new();
        for members in &self.members {
            let mut open = members.clone();
            while let Some(index) = open.pop() {
                if passed.insert(index) {
                    open.extend(self.neighbors(index));
                }
            }
        }
        for &start in self.voronoi.cells() {
            let (mut ring, mut open) = (vec![], vec![start]);
            while let Some(index) = open.pop() {
                if passed.insert(index) {
                    ring.push(index);
                    open.extend(self.neighbors(index));
                }
            }
            let squared = |&index: &usize| self.clearance.squared()[index];
            ring.sort_unstable();
            if let Some(widest) = ring.iter().map(squared).max() {
                let first = ring.into_iter().find(|index| squared(index) == widest);
                self.make_node(first.into_iter().collect());
            }
        }
    }

    fn lines(&self) -> Vec<SkeletonLine> {
        let mut begun: HashSet<[usize; 2]> = HashSet::new();
        let mut lines = vec![];
        for (node, members) in self.members.iter().enumerate() {
            for &from in members {
                for next in self.neighbors(from) {
                    if self.node(next) != Some(node) && begun.insert([from, next]) {
                        let line = self.line(node, from, next);
                        if let [.., before, last] = line.cells[..] {
                            begun.insert([last, before]);
                        }
                        lines.push(line);
                    }
                }
            }
        }
        lines
    }

    fn line(&self, node: usize, from: usize, next: usize) -> SkeletonLine {
        let mut cells = vec![from, next];
        let (mut before, mut at) = (from, next);
        loop {
            if let Some(last) = self.node(at) {
                return SkeletonLine { nodes: [node, last], cells };
            }
            // A cell of no node has two neighbours; one of them is where the walk comes from.
            let onward = self.neighbors(at).find(|&next| next != before).unwrap_or(from);
            (before, at) = (at, onward);
            cells.push(at);
        }
    }
}
