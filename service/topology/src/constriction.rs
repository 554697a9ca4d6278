//! Which critical lines are doors.
//!
//! Every uneven wall makes critical points, and every critical line makes two regions of one. A
//! line between the regions A and B is kept where space widens and opens on both sides,
//!
//! ```text
//! min(D(A), D(B)) >= widening · D(line)      D(A) = largest clearance in the region A
//! opening(line)   >= opening                 the run along the line, behind it, over its length
//! ```
//!
//! The first tells a door from a rough wall, the second a door from a corridor between two rooms.
//! Lines fall one by one, the least convincing first; each joins the regions on its sides, whose
//! other lines look more convincing for it, never less. A region too small to be a place is joined
//! across its widest line. What is left is as in S. Thrun, Artificial Intelligence 99 (1998),
//! section 3.1 (iv): regions between critical lines; the paper keeps all of them.
//!
//! D(A) / D(line) is the persistence of a saddle of the clearance, on a logarithmic scale: H.
//! Edelsbrunner, D. Letscher and A. Zomorodian, "Topological persistence and simplification",
//! Discrete and Computational Geometry 28 (2002). Time O(lines log lines + cells), space O(cells).

use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

use crate::clearance::Clearance;
use crate::critical_line::CriticalLine;
use crate::regions::{Partition, RegionIndex, pairs};
use crate::union::Union;

/// Tunables of [`constrictions`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConstrictionParams {
    /// The widest place on either side is at least so many times as wide as the line.
    pub widening_min: f64,
    /// The run of free cells along the line, behind it, is at least so many times as long.
    pub opening_min: f64,
    /// How far behind a line its opening is looked for, in metres: the depth of a door's frame.
    pub depth_m: f64,
    /// A smaller region is no place of its own if a critical line leads out of it, in square
    /// metres.
    pub area_min_m2: f64,
}

/// The lines that stay, in their order, and the regions between them. `fine` are the regions
/// between all lines.
pub fn constrictions(
    fine: &Partition,
    lines: Vec<CriticalLine>,
    clearance: &Clearance,
    params: &ConstrictionParams,
) -> (Vec<CriticalLine>, Partition) {
    let mut weighing = Weighing::new(fine, &lines, clearance, params);
    weighing.drop_lines();
    let parts: Vec<bool> = (0..lines.len()).map(|line| weighing.weight(line).is_some()).collect();
    let root_of: Vec<_> = (0..fine.n_regions()).map(|r| weighing.union.root(r)).collect();
    let partition = fine.joined(|region| RegionIndex(root_of[region.0 as usize]));
    let kept = lines.into_iter().zip(parts).filter_map(|(line, parts)| parts.then_some(line));
    (kept.collect(), partition)
}

/// How convincing a line is; the least goes first. Ordered by rank, then by number.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Weight {
    /// Space goes on as before behind it; the wider, the less it bounds anything.
    Plain { clearance_m: f64 },
    /// It bounds a region that is too small to be a place.
    Small { clearance_m: f64 },
    /// By how much space widens behind it.
    Widening(f64),
}

impl Weight {
    fn rank(self) -> (u8, f64) {
        match self {
            Self::Plain { clearance_m } => (0, -clearance_m),
            Self::Small { clearance_m } => (1, -clearance_m),
            Self::Widening(ratio) => (2, ratio),
        }
    }
}

impl Eq for Weight {}

impl Ord for Weight {
    fn cmp(&self, other: &Self) -> Ordering {
        let ((kind, value), (other_kind, other_value)) = (self.rank(), other.rank());
        kind.cmp(&other_kind).then(value.total_cmp(&other_value))
    }
}

impl PartialOrd for Weight {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

struct Weighing<'a> {
    lines: &'a [CriticalLine],
    params: &'a ConstrictionParams,
    /// Pairs of fine regions on the two sides of each line.
    pairs: Vec<Vec<[u32; 2]>>,
    union: Union,
    /// Largest clearance of each root's region, in metres.
    widest_m: Vec<f64>,
    area_m2: Vec<f64>,
}

impl<'a> Weighing<'a> {
    fn new(
        fine: &Partition,
        lines: &'a [CriticalLine],
        clearance: &Clearance,
        params: &'a ConstrictionParams,
    ) -> Self {
        let n_regions = fine.n_regions() as usize;
        let cell_m2 = clearance.info().frame.resolution_m().powi(2);
        let (mut widest, mut n_cells) = (vec![0; n_regions], vec![0_u32; n_regions]);
        for (index, &squared) in clearance.squared().iter().enumerate() {
            if let Some(RegionIndex(region)) = fine.region_at(index) {
                n_cells[region as usize] += 1;
                widest[region as usize] = squared.max(widest[region as usize]);
            }
        }
        let resolution_m = clearance.info().frame.resolution_m();
        let in_m = |squared: u32| f64::from(squared).sqrt() * resolution_m;
        let widest_m = widest.into_iter().map(in_m).collect();
        let area_m2 = n_cells.into_iter().map(|n| f64::from(n) * cell_m2).collect();
        let of_line = |line: &CriticalLine| {
            let pairs = pairs(fine, &line.crossings);
            pairs.into_keys().map(|[a, b]| [a.0, b.0]).collect()
        };
        let pairs = lines.iter().map(of_line).collect();
        Self { lines, params, pairs, union: Union::new(fine.n_regions()), widest_m, area_m2 }
    }

    fn drop_lines(&mut self) {
        let mut queue = BinaryHeap::new();
        for line in 0..self.lines.len() {
            queue.extend(self.weight(line).map(|weight| Reverse((weight, line))));
        }
        let enough = Weight::Widening(self.params.widening_min);
        while let Some(Reverse((weight, line))) = queue.pop() {
            let Some(now) = self.weight(line) else { continue };
            if now != weight {
                queue.push(Reverse((now, line)));
            } else if weight < enough {
                self.join_across(line);
            }
        }
    }

    /// How convincing a line is now, across the best of its pairs; `None` if it parts nothing.
    fn weight(&mut self, line: usize) -> Option<Weight> {
        let CriticalLine { clearance_m, opening, .. } = self.lines[line];
        let mut best = None;
        for at in 0..self.pairs[line].len() {
            let [a, b] = self.pairs[line][at].map(|region| self.union.root(region) as usize);
            if a == b {
                continue;
            }
            let is_small = self.area_m2[a].min(self.area_m2[b]) < self.params.area_min_m2;
            let weight = if opening < self.params.opening_min {
                Weight::Plain { clearance_m }
            } else if is_small {
                Weight::Small { clearance_m }
            } else {
                Weight::Widening(self.widest_m[a].min(self.widest_m[b]) / clearance_m)
            };
            best = best.max(Some(weight));
        }
        best
    }

    fn join_across(&mut self, line: usize) {
        for at in 0..self.pairs[line].len() {
            let [a, b] = self.pairs[line][at];
            if let Some([root, leaf]) = self.union.join(a, b).map(|pair| pair.map(|r| r as usize)) {
                self.area_m2[root] += self.area_m2[leaf];
                self.widest_m[root] = self.widest_m[root].max(self.widest_m[leaf]);
            }
        }
    }
}
