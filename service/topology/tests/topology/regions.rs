//! Regions of random worlds: the flood fill against its definition, and what holds of every cut.

use std::collections::{BTreeMap, BTreeSet};

use meetpoint_topology::{
    Crossing, FreeSpace, Partition, RegionIndex, TopologyParams, Voronoi, partition, segmentation,
    topological_graph,
};
use proptest::prelude::*;
use proptest::sample::Index;

use crate::building::{Building, any_space, cluttered, office};

/// Steps along the axes between free cells.
fn steps(space: &FreeSpace) -> Vec<Crossing> {
    let width = space.info().width as usize;
    let both = |&(a, b): &(usize, usize)| space.is_free()[a] && space.is_free()[b];
    let pairs = (0..space.info().n_cells() - width).flat_map(|a| [(a, a + 1), (a, a + width)]);
    pairs.filter(both).map(|(left, right)| Crossing { left, right }).collect()
}

/// Cells belong together if a step that is not cut joins them: sets joined one step at a time.
fn reference(space: &FreeSpace, cuts: &[Crossing]) -> Vec<usize> {
    let mut name: Vec<usize> = (0..space.info().n_cells()).collect();
    for Crossing { left, right } in steps(space) {
        let is_cut = |cut: &Crossing| {
            [cut.left, cut.right] == [left, right] || [cut.right, cut.left] == [left, right]
        };
        let (kept, lost) = (name[left].min(name[right]), name[left].max(name[right]));
        if kept != lost && !cuts.iter().any(is_cut) {
            name.iter_mut().filter(|name| **name == lost).for_each(|name| *name = kept);
        }
    }
    name
}

/// What must hold of any partition of `space`.
fn check(space: &FreeSpace, partition: &Partition) -> Result<(), TestCaseError> {
    for (index, &is_free) in space.is_free().iter().enumerate() {
        let region = partition.region_at(index);
        prop_assert_eq!(region.is_some(), is_free, "free cells, and only they, have a region");
        prop_assert!(region.is_none_or(|region| region.0 < partition.n_regions()), "in range");
    }
    let within =
        |step: &Crossing| partition.region_at(step.left) != partition.region_at(step.right);
    let borders: Vec<Crossing> = steps(space).into_iter().filter(within).collect();
    let names = reference(space, &borders);
    let mut pieces: BTreeMap<RegionIndex, BTreeSet<usize>> = BTreeMap::new();
    for (index, &name) in names.iter().enumerate() {
        if let Some(region) = partition.region_at(index) {
            pieces.entry(region).or_default().insert(name);
        }
    }
    prop_assert_eq!(pieces.len(), partition.n_regions() as usize, "no region is empty");
    prop_assert!(pieces.values().all(|pieces| pieces.len() == 1), "every region is of one piece");
    Ok(())
}

/// Cells of the diagram within `reach` cells along it: all distances, relaxed until none changes.
fn within(voronoi: &Voronoi, start: usize, reach: f64) -> Vec<usize> {
    let width = voronoi.info().width as usize;
    let step = |a: usize, b: usize| {
        let away = [(a % width).abs_diff(b % width), (a / width).abs_diff(b / width)];
        (away.iter().all(|&n| n <= 1)).then(|| (away[0] as f64).hypot(away[1] as f64))
    };
    let mut distances = BTreeMap::from([(start, 0.0)]);
    loop {
        let mut nearer = distances.clone();
        for (&a, &distance) in &distances {
            for &b in voronoi.cells() {
                let Some(step) = step(a, b) else { continue };
                let known = nearer.get(&b).copied().unwrap_or(f64::INFINITY);
                if distance + step <= reach && distance + step < known {
                    nearer.insert(b, distance + step);
                }
            }
        }
        if nearer == distances {
            return distances.into_keys().collect();
        }
        distances = nearer;
    }
}

/// Share of the cells of each region that its best counterpart holds, the least of all.
fn least_overlap(a: &Partition, b: &Partition, image: impl Fn(usize) -> usize) -> f64 {
    let mut common: BTreeMap<(RegionIndex, RegionIndex), f64> = BTreeMap::new();
    let (mut of_a, mut of_b) = (BTreeMap::new(), BTreeMap::new());
    for index in 0..a.info().n_cells() {
        if let (Some(here), Some(there)) = (a.region_at(index), b.region_at(image(index))) {
            *common.entry((here, there)).or_default() += 1.0;
            *of_a.entry(here).or_insert(0.0) += 1.0;
            *of_b.entry(there).or_insert(0.0) += 1.0;
        }
    }
    let shares = of_a.keys().map(|here| {
        let own = common.iter().filter(|((a, _), _)| a == here);
        own.map(|((_, b), n)| n / (of_a[here] + of_b[b] - n)).fold(0.0, f64::max)
    });
    shares.fold(1.0, f64::min)
}

proptest! {
    #[test]
    fn flood_fill_is_the_union_of_steps(
        space in any_space(),
        picks in prop::collection::vec(any::<prop::sample::Index>(), 0..40),
    ) {
        let steps = steps(&space);
        let cuts: Vec<Crossing> = match steps.as_slice() {
            [] => vec![],
            steps => picks.iter().map(|pick| steps[pick.index(steps.len())]).collect(),
        };
        let found = partition(&space, &cuts);
        let names = reference(&space, &cuts);
        let mut name_of: BTreeMap<usize, RegionIndex> = BTreeMap::new();
        for (index, &name) in names.iter().enumerate() {
            if let Some(region) = found.region_at(index) {
                prop_assert_eq!(*name_of.entry(name).or_insert(region), region);
            }
        }
        prop_assert_eq!(name_of.len(), found.n_regions() as usize, "one region a set");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn a_critical_point_is_the_narrowest_around(space in cluttered()) {
        let found = segmentation(&space, &TopologyParams::INDOOR);
        let resolution_m = space.info().frame.resolution_m();
        let reach = TopologyParams::INDOOR.critical.epsilon_m / resolution_m;
        for point in &found.points {
            let near = within(&found.voronoi, point.index, reach);
            let narrowest = near.iter().map(|&index| found.clearance.squared()[index]).min();
            prop_assert_eq!(narrowest, Some(found.clearance.squared()[point.index]));
            prop_assert!(point.basis.iter().all(|&basis| !space.is_free()[basis]), "obstacles");
        }
    }

    #[test]
    fn clutter_is_cut_into_whole_regions(space in cluttered()) {
        check(&space, &segmentation(&space, &TopologyParams::INDOOR).partition)?;
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn rooms_and_a_corridor((building, n_rooms) in office()) {
        let space = building.space(1);
        let found = segmentation(&space, &TopologyParams::INDOOR).partition;
        check(&space, &found)?;
        prop_assert_eq!(found.n_regions() as usize, n_rooms + 1);
    }

    #[test]
    fn turning_the_building_turns_the_regions((building, _) in office()) {
        let [before, after] = [building.clone(), building.turned()]
            .map(|building| segmentation(&building.space(1), &TopologyParams::INDOOR).partition);
        let (width, height) = (before.info().width as usize, before.info().height as usize);
        let turned = |index: usize| index % width * height + (height - 1 - index / width);
        prop_assert_eq!(before.n_regions(), after.n_regions());
        let least = least_overlap(&before, &after, turned);
        prop_assert!(0.95 <= least, "a region overlaps its image by {least}");
    }

    #[test]
    fn half_the_cells_edge_keeps_the_regions((building, _) in office()) {
        let [coarse, fine] = [1, 2]
            .map(|n| segmentation(&building.space(n), &TopologyParams::INDOOR).partition);
        let [width, fine_width] = [&coarse, &fine].map(|p| p.info().width as usize);
        // Without the rim, a coarse cell's lower left quarter.
        let image = |index: usize| {
            let (x, y) = (index % width, index / width);
            (2 * y).saturating_sub(1) * fine_width + (2 * x).saturating_sub(1)
        };
        prop_assert_eq!(coarse.n_regions(), fine.n_regions());
        let least = least_overlap(&coarse, &fine, image);
        prop_assert!(0.95 <= least, "a region overlaps its image by {least}");
    }
}

/// How many regions are places.
fn n_places(building: &Building, cells: &[bool]) -> usize {
    let info = crate::building::info(0.1, building.width, building.height);
    let found = segmentation(&FreeSpace::from_cells(info, cells), &TopologyParams::INDOOR);
    let graph = topological_graph(&found.partition, &found.lines, &found.clearance);
    graph.regions.len() - graph.specks().len()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn speckle_makes_no_rooms(
        (building, n_rooms) in office(),
        specks in prop::collection::vec((any::<Index>(), 1_usize..3, any::<bool>()), 0..60),
    ) {
        let mut cells = inside(&building.space(1));
        for (speck, size, is_free) in specks {
            let at = speck.index(cells.len());
            // The walls are two cells thick: what is free in them is closed on one side.
            let size = if is_free { 1 } else { size };
            let last = (at + size).min(cells.len());
            cells[at..last].fill(is_free);
        }
        prop_assert_eq!(n_places(&building, &cells), n_rooms + 1);
    }

    /// Tables of up to 0.6 m by 0.6 m, with room to walk around them.
    #[test]
    fn furniture_makes_no_rooms(
        (building, n_rooms) in office(),
        tables in prop::collection::vec((any::<Index>(), any::<Index>(), 1_usize..7, 1_usize..7), 0..40),
    ) {
        let mut cells = inside(&building.space(1));
        let rooms: Vec<[usize; 4]> = building
            .free
            .iter()
            .copied()
            .filter(|[left, bottom, right, top]| 20 <= (right - left).min(top - bottom))
            .collect();
        for (room, place, width, depth) in tables {
            let [left, bottom, right, top] = rooms[room.index(rooms.len())];
            // On a lattice of 1.2 m, so that no two stand together.
            let (columns, rows) = ((right - left - 6) / 12, (top - bottom - 6) / 12);
            let at = place.index(columns * rows);
            let (x, y) = (left + 6 + at % columns * 12, bottom + 6 + at / columns * 12);
            for y in y..y + depth {
                cells[y * building.width + x..y * building.width + x + width].fill(false);
            }
        }
        prop_assert_eq!(n_places(&building, &cells), n_rooms + 1);
    }
}

/// The cells of a space without its rim.
fn inside(space: &FreeSpace) -> Vec<bool> {
    let width = space.info().width as usize;
    let rows = space.is_free().chunks_exact(width);
    let n_rows = space.info().height as usize - 2;
    rows.skip(1).take(n_rows).flat_map(|row| row[1..width - 1].to_vec()).collect()
}
