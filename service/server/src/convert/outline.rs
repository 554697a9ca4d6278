//! Outlines of regions, traced along the edges of their cells.
//!
//! Every edge between a cell of a region and a cell that is none of it is walked with the region on
//! the left: once around outside, counter-clockwise, and once around every hole, clockwise. Where
//! two cells of a region touch in a corner only, the walk crosses over, so that no ring meets
//! itself: in a region that hangs together along the axes, the two empty cells at such a corner
//! never belong to one ring. Time O(cells + edges log edges).

use std::collections::BTreeMap;

use meetpoint_topology::{Partition, RegionIndex};

/// A corner of cells: column and row of the cell whose lower-left corner it is.
type Corner = [u32; 2];

/// Corners where a closed line turns, in columns and rows of the partition.
pub(crate) type CornerRing = Vec<Corner>;

/// Steps along +x, +y, -x, -y.
const STEPS: [[i32; 2]; 4] = [[1, 0], [0, 1], [-1, 0], [0, -1]];

/// Edges that leave a corner, a bit a direction.
#[derive(Default)]
struct Edges(BTreeMap<Corner, u8>);

/// The rings of every group of regions, the outer one first. `group` names for every region the
/// group that it belongs to, below `n_groups`; `None` for regions that are not wanted.
pub(crate) fn outlines(
    partition: &Partition,
    n_groups: usize,
    group: impl Fn(RegionIndex) -> Option<usize>,
) -> Vec<Vec<CornerRing>> {
    let info = partition.info();
    let width = info.width as usize;
    let group_at = |index: usize| partition.region_at(index).and_then(&group);
    let mut edges: Vec<Edges> = std::iter::repeat_with(Edges::default).take(n_groups).collect();
    // No cell on the rim is free, so that every free one has its four neighbours.
    for (row, y) in (0..info.height).enumerate() {
        for (column, x) in (0..info.width).enumerate() {
            let index = row * width + column;
            let Some(own) = group_at(index) else { continue };
            let is_edge = |neighbor: usize| group_at(neighbor) != Some(own);
            let of_own = &mut edges[own];
            let sides = [
                (index - width, [x, y]),
                (index + 1, [x + 1, y]),
                (index + width, [x + 1, y + 1]),
                (index - 1, [x, y + 1]),
            ];
            for (direction, (neighbor, from)) in sides.into_iter().enumerate() {
                if is_edge(neighbor) {
                    *of_own.0.entry(from).or_default() |= 1 << direction;
                }
            }
        }
    }
    edges.into_iter().map(Edges::into_rings).collect()
}

impl Edges {
    /// All edges as rings, the outer one first.
    fn into_rings(mut self) -> Vec<CornerRing> {
        let mut rings = vec![];
        while let Some((&start, &leaving)) = self.0.first_key_value() {
            rings.push(self.take_ring(start, leaving.trailing_zeros() as usize));
        }
        // The outer ring is the one that goes around counter-clockwise.
        rings.sort_by_key(|ring| twice_area(ring) < 0);
        rings
    }

    /// Walks one ring and takes its edges away.
    fn take_ring(&mut self, start: Corner, first: usize) -> CornerRing {
        let (mut ring, mut at, mut direction) = (vec![start], start, first);
        loop {
            self.take(at, direction);
            let step = STEPS[direction];
            at = [0, 1].map(|axis| at[axis].saturating_add_signed(step[axis]));
            let is_first = |next: usize| at == start && next == first;
            // To the right where there is a choice: across a corner to the other cell.
            let mut turns = [3, 0, 1].map(|turn| (direction + turn) % 4).into_iter();
            match turns.find(|&next| is_first(next) || self.leaves(at, next)) {
                Some(next) if !is_first(next) => {
                    if next != direction {
                        ring.push(at);
                    }
                    direction = next;
                }
                _ => return ring,
            }
        }
    }

    fn leaves(&self, corner: Corner, direction: usize) -> bool {
        self.0.get(&corner).is_some_and(|leaving| leaving & (1 << direction) != 0)
    }

    fn take(&mut self, corner: Corner, direction: usize) {
        if let Some(leaving) = self.0.get_mut(&corner) {
            *leaving &= !(1 << direction);
            if *leaving == 0 {
                self.0.remove(&corner);
            }
        }
    }
}

/// Twice the area that a ring goes around, negative if clockwise.
fn twice_area(ring: &[Corner]) -> i64 {
    let pairs = ring.iter().zip(ring.iter().cycle().skip(1));
    let cross = |([x, y], [to_x, to_y]): (&Corner, &Corner)| {
        i64::from(*x) * i64::from(*to_y) - i64::from(*to_x) * i64::from(*y)
    };
    pairs.map(cross).sum()
}

#[cfg(test)]
mod tests {
    use meetpoint_geometry::{Cell, GridFrame, GridInfo};
    use meetpoint_topology::{FreeSpace, partition};
    use proptest::prelude::*;

    use super::*;

    /// Regions of a drawing, top row first; `.` is free.
    fn regions(drawing: &str) -> Partition {
        let rows: Vec<&str> = drawing.split_whitespace().collect();
        let side = |n: usize| u32::try_from(n).expect("small");
        let cells: Vec<bool> =
            rows.iter().rev().flat_map(|row| row.chars()).map(|symbol| symbol == '.').collect();
        let info = GridInfo {
            frame: GridFrame::new(0.05).expect("a length"),
            first: Cell { x: 0, y: 0 },
            width: side(rows[0].len()),
            height: side(rows.len()),
        };
        partition(&FreeSpace::from_cells(info, &cells), [])
    }

    fn traced(partition: &Partition) -> Vec<Vec<CornerRing>> {
        outlines(partition, partition.n_regions() as usize, |region| Some(region.0 as usize))
    }

    #[test]
    fn a_room_with_a_pillar() {
        let rings = traced(&regions("... .#. ..."));
        let outer = vec![[1, 1], [4, 1], [4, 4], [1, 4]];
        let pillar = vec![[2, 2], [2, 3], [3, 3], [3, 2]];
        assert_eq!(rings, [[outer, pillar]], "counter-clockwise, then clockwise");
    }

    #[test]
    fn corners_that_touch_are_crossed() {
        // The free cells around the two obstacles touch between them in one corner.
        let rings = traced(&regions(".... .#.. ..#. ...."));
        let n_corners: Vec<usize> = rings[0].iter().map(Vec::len).collect();
        assert_eq!(n_corners, [4, 4, 4], "two holes, not one that meets itself");
    }

    proptest! {
        /// The definition: a cell is of the region if a line from it crosses the rings oddly often.
        #[test]
        fn rings_enclose_their_cells(rows in prop::collection::vec("[.#]{7}", 6)) {
            let partition = regions(&rows.join(" "));
            let info = partition.info();
            let rings = traced(&partition);
            prop_assert_eq!(rings.len(), partition.n_regions() as usize);
            for (region, rings) in rings.iter().enumerate() {
                for ring in rings {
                    let mut corners = ring.clone();
                    corners.sort_unstable();
                    corners.dedup();
                    prop_assert_eq!(corners.len(), ring.len(), "no ring meets itself");
                }
                prop_assert!(0 < twice_area(&rings[0]), "the outer one is first");
                prop_assert!(rings[1..].iter().all(|ring| twice_area(ring) < 0), "then holes");
                for index in 0..info.n_cells() {
                    let (x, y) = (index % info.width as usize, index / info.width as usize);
                    let edges = rings.iter().flat_map(|ring| {
                        ring.iter().zip(ring.iter().cycle().skip(1))
                    });
                    let n_left = edges.filter(|([ax, ay], [_, by])| {
                        let (low, high) = (*ay.min(by) as usize, *ay.max(by) as usize);
                        (*ax as usize) <= x && low <= y && y < high
                    });
                    let is_inside = n_left.count() % 2 == 1;
                    let is_own = partition.region_at(index).is_some_and(|r| r.0 as usize == region);
                    prop_assert_eq!(is_inside, is_own, "cell ({}, {})", x, y);
                }
            }
        }
    }
}
