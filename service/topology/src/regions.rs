//! Regions: flood fill of the free cells between critical lines.
//!
//! S. Thrun, Artificial Intelligence 99 (1998), section 3.1 (iv): "critical lines partition the
//! free-space into disjoint regions". Cells hang together along the axes only: with eight
//! neighbours and no cutting of corners, these are the cells that a robot can go between. Time and
//! space O(cells).

use std::collections::{BTreeMap, HashSet};

use meetpoint_geometry::GridInfo;

use crate::cut::Crossing;
use crate::free::FreeSpace;
use crate::lattice::Lattice;

/// A region of one partition, counted from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct RegionIndex(pub u32);

/// Which region every cell belongs to.
#[derive(Clone, Debug, PartialEq)]
pub struct Partition {
    info: GridInfo,
    n_regions: u32,
    /// [`NOT_FREE`] or below `n_regions`.
    of_cell: Vec<u32>,
}

const NOT_FREE: u32 = u32::MAX;

impl Partition {
    /// Which cells: those of the free space.
    pub fn info(&self) -> GridInfo {
        self.info
    }

    /// Number of regions.
    pub fn n_regions(&self) -> u32 {
        self.n_regions
    }

    /// The region of a cell, by the cell's place in row-major data; `None` if it is not free.
    ///
    /// # Panics
    /// If `index` is not below the number of cells.
    pub fn region_at(&self, index: usize) -> Option<RegionIndex> {
        let region = self.of_cell[index];
        (region != NOT_FREE).then_some(RegionIndex(region))
    }

    /// The partition with regions joined: `group` names for every region one that stands for all
    /// of its group. Regions are counted anew, in the order of their first cells.
    #[must_use]
    pub fn joined(&self, group: impl Fn(RegionIndex) -> RegionIndex) -> Self {
        let mut name = vec![NOT_FREE; self.n_regions as usize];
        let mut n_regions = 0;
        let mut of_cell = self.of_cell.clone();
        for region in of_cell.iter_mut().filter(|region| **region != NOT_FREE) {
            let name = &mut name[group(RegionIndex(*region)).0 as usize];
            if *name == NOT_FREE {
                *name = n_regions;
                n_regions += 1;
            }
            *region = *name;
        }
        Self { info: self.info, n_regions, of_cell }
    }
}

/// Connected free cells, no step crossing a cut; counted in the order of their first cells.
pub fn partition<'a>(space: &FreeSpace, cuts: impl IntoIterator<Item = &'a Crossing>) -> Partition {
    let lattice = Lattice::new(space.info());
    let both_ways = |cut: &Crossing| [(cut.left, cut.right), (cut.right, cut.left)];
    let cuts: HashSet<(usize, usize)> = cuts.into_iter().flat_map(both_ways).collect();
    let mut is_cut = vec![false; space.is_free().len()];
    for &(from, _) in &cuts {
        is_cut[from] = true;
    }
    let mut of_cell = vec![NOT_FREE; space.is_free().len()];
    let mut n_regions = 0;
    let mut open = vec![];
    for start in 0..of_cell.len() {
        if !space.is_free()[start] || of_cell[start] != NOT_FREE {
            continue;
        }
        of_cell[start] = n_regions;
        open.push(start);
        while let Some(index) = open.pop() {
            for neighbor in lattice.beside(index) {
                let is_new = space.is_free()[neighbor] && of_cell[neighbor] == NOT_FREE;
                if is_new && !(is_cut[index] && cuts.contains(&(index, neighbor))) {
                    of_cell[neighbor] = n_regions;
                    open.push(neighbor);
                }
            }
        }
        n_regions += 1;
    }
    Partition { info: space.info(), n_regions, of_cell }
}

/// Crossings between two different regions, by the pair of regions, the smaller index first.
pub(crate) fn pairs(
    partition: &Partition,
    crossings: &[Crossing],
) -> BTreeMap<[RegionIndex; 2], Vec<Crossing>> {
    let mut pairs: BTreeMap<_, Vec<Crossing>> = BTreeMap::new();
    for &crossing in crossings {
        let sides = [crossing.left, crossing.right].map(|index| partition.region_at(index));
        if let [Some(left), Some(right)] = sides
            && left != right
        {
            pairs.entry([left.min(right), left.max(right)]).or_default().push(crossing);
        }
    }
    pairs
}
