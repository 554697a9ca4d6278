//! Regions of worlds that change: brought up to date, they are those computed afresh.

use meetpoint_geometry::{Cell, GridInfo};
use meetpoint_topology::{FreeSpace, Segmentation, TopologyParams, resegmentation, segmentation};
use proptest::prelude::*;

use crate::building::{Building, info, office};

/// Something that happens to a world, in cells of its canvas.
#[derive(Clone, Debug)]
enum Edit {
    /// A rectangle becomes free, or an obstacle: a wall, a door, a speck, a hall.
    Fill { at: [usize; 2], size: [usize; 2], is_free: bool },
    /// More of the canvas is seen: to the left, below, to the right, above.
    Grow([usize; 4]),
    /// Every so many-th cell turns into what it was not.
    Speckle { every: usize, from: usize },
}

fn edit() -> impl Strategy<Value = Edit> {
    let fill =
        |size: std::ops::Range<usize>| {
            let place = [0_usize..130, 0_usize..110];
            (place, [size.clone(), size], any::<bool>())
                .prop_map(|(at, size, is_free)| Edit::Fill { at, size, is_free })
        };
    prop_oneof![
        3 => fill(1..4),
        4 => fill(1..16),
        1 => fill(8..50),
        1 => [0_usize..9, 0_usize..9, 0_usize..9, 0_usize..9].prop_map(Edit::Grow),
        1 => (40_usize..900, 0_usize..40).prop_map(|(every, from)| Edit::Speckle { every, from }),
    ]
}

/// A canvas, and the part of it that has been seen.
#[derive(Debug)]
struct World {
    width: usize,
    height: usize,
    is_free: Vec<bool>,
    /// Left, below, right, above: columns and rows not seen.
    hidden: [usize; 4],
    resolution_m: f64,
}

impl World {
    fn blocks(blocks: &[(usize, usize, usize, usize)], resolution_m: f64) -> Self {
        let (width, height) = (120, 100);
        let mut world = Self {
            width,
            height,
            is_free: vec![true; width * height],
            hidden: [14; 4],
            resolution_m,
        };
        for &(left, bottom, width, height) in blocks {
            world.apply(&Edit::Fill { at: [left, bottom], size: [width, height], is_free: false });
        }
        world
    }

    fn building(building: &Building) -> Self {
        let space = building.space(1);
        let (width, height) = (space.info().width as usize, space.info().height as usize);
        let is_free = space.is_free().to_vec();
        Self { width, height, is_free, hidden: [9; 4], resolution_m: 0.1 }
    }

    fn apply(&mut self, edit: &Edit) {
        match *edit {
            Edit::Fill { at: [left, bottom], size: [width, height], is_free } => {
                for y in bottom.min(self.height)..(bottom + height).min(self.height) {
                    let row = &mut self.is_free[y * self.width..(y + 1) * self.width];
                    row[left.min(self.width)..(left + width).min(self.width)].fill(is_free);
                }
            }
            Edit::Grow(by) => {
                for (hidden, by) in self.hidden.iter_mut().zip(by) {
                    *hidden = hidden.saturating_sub(by);
                }
            }
            Edit::Speckle { every, from } => {
                let specks = self.is_free.iter_mut().skip(from).step_by(every);
                specks.for_each(|is_free| *is_free = !*is_free);
            }
        }
    }

    fn space(&self) -> FreeSpace {
        let [left, below, right, above] = self.hidden;
        let (width, height) = (self.width - left - right, self.height - below - above);
        let seen = (below..self.height - above).flat_map(|y| {
            let row = y * self.width;
            self.is_free[row + left..row + self.width - right].iter().copied()
        });
        let cell = |n: usize| i32::try_from(n).expect("small") - 40;
        let first = Cell { x: cell(left), y: cell(below) };
        let info = GridInfo { first, ..info(self.resolution_m, width, height) };
        FreeSpace::from_cells(info, &seen.collect::<Vec<_>>())
    }

    /// Brings the regions up to date after every edit.
    fn check(mut self, edits: &[Edit]) -> Result<(), TestCaseError> {
        let mut found: Segmentation = segmentation(&self.space(), &TopologyParams::INDOOR);
        for edit in edits {
            self.apply(edit);
            let space = self.space();
            found = resegmentation(found, &space);
            let afresh = segmentation(&space, &TopologyParams::INDOOR);
            prop_assert!(found.clearance == afresh.clearance, "clearance after {:?}", edit);
            prop_assert!(found.voronoi == afresh.voronoi, "diagram after {:?}", edit);
            prop_assert_eq!(&found.points, &afresh.points, "critical points after {:?}", edit);
            prop_assert_eq!(&found.lines, &afresh.lines, "lines after {:?}", edit);
            prop_assert!(found.partition == afresh.partition, "regions after {:?}", edit);
            prop_assert!(found == afresh, "what the next change needs after {:?}", edit);
        }
        Ok(())
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn clutter_that_changes(
        blocks in prop::collection::vec((0_usize..120, 0_usize..100, 1_usize..40, 1_usize..30), 0..16),
        is_fine: bool,
        edits in prop::collection::vec(edit(), 1..12),
    ) {
        World::blocks(&blocks, if is_fine { 0.05 } else { 0.1 }).check(&edits)?;
    }

    #[test]
    fn a_building_that_is_rebuilt(
        (building, _) in office(),
        edits in prop::collection::vec(edit(), 1..12),
    ) {
        World::building(&building).check(&edits)?;
    }
}

#[test]
fn another_rectangle_is_cut_afresh() {
    let world = World::blocks(&[(30, 40, 60, 5)], 0.05);
    let found = segmentation(&world.space(), &TopologyParams::INDOOR);
    let smaller = World { hidden: [20; 4], ..world }.space();
    let afresh = segmentation(&smaller, &TopologyParams::INDOOR);
    assert!(resegmentation(found, &smaller) == afresh, "cells are gone");
}
