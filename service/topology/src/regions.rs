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
use crate::relocation::Relocation;

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

/// The region of a cell that is not free.
pub(crate) const NOT_FREE: u32 = u32::MAX;

impl Partition {
    /// Of every cell [`NOT_FREE`] or a region below `n_regions`.
    pub(crate) fn from_cells(info: GridInfo, n_regions: u32, of_cell: Vec<u32>) -> Self {
        Self { info, n_regions, of_cell }
    }

    /// Number of cells of every region.
    pub fn sizes(&self) -> Vec<u32> {
        let mut sizes = vec![0; self.n_regions as usize];
        for &region in self.of_cell.iter().filter(|&&region| region != NOT_FREE) {
            sizes[region as usize] += 1;
        }
        sizes
    }

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

    /// The same in another rectangle.
    pub(crate) fn relocated(self, relocation: &Relocation) -> Self {
        let of_cell = relocation.cells(self.of_cell, NOT_FREE);
        Self { info: relocation.to(), n_regions: self.n_regions, of_cell }
    }

    /// The partition with regions joined: `group` names for every region one that stands for all
    /// of its group. Regions are counted anew, in the order of their first cells.
    #[must_use]
    pub fn joined(&self, group: impl Fn(RegionIndex) -> RegionIndex) -> Self {
        let groups: Vec<u32> =
            (0..self.n_regions).map(|region| group(RegionIndex(region)).0).collect();
        self.clone().renamed(&groups)
    }

    /// Regions with the same group become one, counted anew in the order of their first cells.
    /// Groups are below the number of regions.
    fn renamed(mut self, groups: &[u32]) -> Self {
        let mut name_of_group = vec![NOT_FREE; self.n_regions as usize];
        let mut name = vec![NOT_FREE; self.n_regions as usize];
        self.n_regions = 0;
        for region in self.of_cell.iter_mut().filter(|region| **region != NOT_FREE) {
            let at = *region as usize;
            if name[at] == NOT_FREE {
                let of_group = &mut name_of_group[groups[at] as usize];
                if *of_group == NOT_FREE {
                    *of_group = self.n_regions;
                    self.n_regions += 1;
                }
                name[at] = *of_group;
            }
            *region = name[at];
        }
        self
    }
}

/// Connected free cells, no step crossing a cut; counted in the order of their first cells.
pub fn partition<'a>(space: &FreeSpace, cuts: impl IntoIterator<Item = &'a Crossing>) -> Partition {
    let info = space.info();
    let nothing = Partition { info, n_regions: 0, of_cell: vec![NOT_FREE; info.n_cells()] };
    nothing.filled(space, 0..info.n_cells(), &Cuts::new(space, cuts))
}

/// Brings `before`, a partition of the same rectangle, to what it is of `space` between `cuts`,
/// given the cells that became free or ceased to be, and the cuts that came or went.
pub(crate) fn updated_partition<'a>(
    before: Partition,
    space: &FreeSpace,
    cuts: impl IntoIterator<Item = &'a Crossing>,
    differences: &[usize],
    changed_cuts: impl IntoIterator<Item = &'a Crossing>,
) -> Partition {
    let lattice = Lattice::new(space.info());
    let mut is_touched = vec![false; before.n_regions as usize];
    let near = differences.iter().flat_map(|&index| lattice.beside(index));
    let beside_cuts = changed_cuts.into_iter().flat_map(|cut| [cut.left, cut.right]);
    for index in differences.iter().copied().chain(near).chain(beside_cuts) {
        if let Some(RegionIndex(region)) = before.region_at(index) {
            is_touched[region as usize] = true;
        }
    }
    let mut without = before;
    let mut again = vec![];
    for (index, region) in without.of_cell.iter_mut().enumerate() {
        if is_touched.get(*region as usize) == Some(&true) {
            *region = NOT_FREE;
            again.push(index);
        }
    }
    again.extend(differences);
    let filled = without.filled(space, again, &Cuts::new(space, cuts));
    let alone: Vec<u32> = (0..filled.n_regions).collect();
    filled.renamed(&alone)
}

/// Cuts, to be asked for by step.
struct Cuts {
    steps: HashSet<(usize, usize)>,
    /// Whether a step from the cell is cut.
    is_beside: Vec<bool>,
}

impl Cuts {
    fn new<'a>(space: &FreeSpace, cuts: impl IntoIterator<Item = &'a Crossing>) -> Self {
        let both_ways = |cut: &Crossing| [(cut.left, cut.right), (cut.right, cut.left)];
        let steps: HashSet<(usize, usize)> = cuts.into_iter().flat_map(both_ways).collect();
        let mut is_beside = vec![false; space.is_free().len()];
        for &(from, _) in &steps {
            is_beside[from] = true;
        }
        Self { steps, is_beside }
    }

    fn parts(&self, from: usize, to: usize) -> bool {
        self.is_beside[from] && self.steps.contains(&(from, to))
    }
}

impl Partition {
    /// New regions from free cells that have none, each from the first of `starts` that lies in it.
    fn filled(
        mut self,
        space: &FreeSpace,
        starts: impl IntoIterator<Item = usize>,
        cuts: &Cuts,
    ) -> Self {
        let lattice = Lattice::new(space.info());
        let mut open = vec![];
        for start in starts {
            if !space.is_free()[start] || self.of_cell[start] != NOT_FREE {
                continue;
            }
            self.of_cell[start] = self.n_regions;
            open.push(start);
            while let Some(index) = open.pop() {
                for neighbor in lattice.beside(index) {
                    let is_new = space.is_free()[neighbor] && self.of_cell[neighbor] == NOT_FREE;
                    if is_new && !cuts.parts(index, neighbor) {
                        self.of_cell[neighbor] = self.n_regions;
                        open.push(neighbor);
                    }
                }
            }
            self.n_regions += 1;
        }
        self
    }
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
