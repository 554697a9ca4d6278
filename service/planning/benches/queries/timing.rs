//! Look-ups and searches side by side.

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use meetpoint_geometry::Point2;
use meetpoint_planning::{Obstacles, Passage, Plans, Scratch, SmoothScratch, smooth};

use crate::building::Building;
use crate::pairs::Pairs;
use crate::plan::free_space;
use crate::rivals::{JumpPoints, astar, dijkstra};
use crate::sample::Sample;

/// Pairs that the answers are checked on, and that slow searches are timed on.
const N_SLOW_PAIRS: usize = 100;
/// Starts, and goals, of the matrix.
const MATRIX_SIDE: usize = 100;

/// Prints a map's table.
pub(crate) fn compare(path: &Path, radius_m: f64, n_pairs: usize) -> Result<(), Box<dyn Error>> {
    let building = Building::new(free_space(path)?, radius_m)?;
    let Building { plans, space, .. } = &building;
    let region = |cell: usize| plans.partition().region_at(cell);
    let mut draw = Pairs::new(space);
    let apart = draw.draw(n_pairs, |from, to| region(from) != region(to));
    let together = draw.draw(n_pairs / 10, |from, to| region(from) == region(to));
    let any = draw.draw(n_pairs, |_, _| true);
    let few = draw.draw(N_SLOW_PAIRS, |_, _| true);
    check(plans, &few)?;
    let size = plans.size();
    println!(
        "\n{}, radius {radius_m} m: {} cells, {} gates, {} nodes; regions {:.0} ms, tables {:.0} ms, \
         {:.0} bytes a cell\n",
        path.file_stem().unwrap_or_default().to_string_lossy(),
        size.n_cells,
        size.n_gates,
        size.n_nodes,
        building.segmenting.as_secs_f64() * 1e3,
        building.tabulating.as_secs_f64() * 1e3,
        building.bytes_a_cell(),
    );
    println!("| microseconds | pairs | mean | p50 | p99 |\n|---|---|---|---|---|");
    let mut scratch = Scratch::default();
    let show = |name: &str, sample: Sample| println!("{}", sample.line(name));
    show("length, different regions", Sample::of(&apart, |a, b| plans.cost(a, b, &mut scratch)));
    show("length, same region", Sample::of(&together, |a, b| plans.cost(a, b, &mut scratch)));
    show("length, any pair", Sample::of(&any, |a, b| plans.cost(a, b, &mut scratch)));
    let again: Vec<_> = apart.iter().map(|&(from, _)| (from, apart[0].1)).collect();
    let again: Vec<_> =
        again.into_iter().filter(|&(from, to)| region(from) != region(to)).collect();
    let mut towards = plans.towards(apart[0].1);
    show("length, goal asked again", Sample::of(&again, |a, _| towards.cost(a, &mut scratch)));
    show("route and length", Sample::of(&apart, |a, b| plans.route(a, b, &mut scratch)));
    show("next motion", Sample::of(&apart, |a, b| plans.next_cell(a, b, &mut scratch)));
    let mut towards = plans.towards(apart[0].1);
    show(
        "next motion, goal asked again",
        Sample::of(&again, |a, _| towards.next_cell(a, &mut scratch)),
    );
    show("cells of the path", Sample::of(&any, |a, b| plans.path(a, b, &mut scratch)));
    show("dense path", dense(&building, radius_m, &any));
    show("A*, `pathfinding`", Sample::of(&few, |a, b| astar(space, a, b)));
    show("Dijkstra, `pathfinding`", Sample::of(&few, |a, b| dijkstra(space, a, b)));
    let jumps = JumpPoints::new(space);
    show("jump points, `grid_pathfinding`", Sample::of(&few, |a, b| jumps.waypoints(a, b)));
    println!();
    for (name, pairs) in [("any", &any), ("in different regions", &apart)] {
        println!("{}", matrix(plans, name, &pairs[..MATRIX_SIDE.min(pairs.len())]));
    }
    Ok(())
}

/// Time of all lengths from many cells to many, without those of one region if all `pairs` are of
/// two.
fn matrix(plans: &Plans, name: &str, pairs: &[(usize, usize)]) -> String {
    let region = |cell: usize| plans.partition().region_at(cell);
    let is_apart = pairs.iter().all(|&(from, to)| region(from) != region(to));
    let mut scratch = Scratch::default();
    let start = Instant::now();
    let (mut sum, mut n_lengths) = (0_u64, 0);
    for &(_, to) in pairs {
        let mut towards = plans.towards(to);
        for &(from, _) in pairs {
            if !is_apart || region(from) != region(to) {
                sum += u64::from(towards.cost(from, &mut scratch));
                n_lengths += 1;
            }
        }
    }
    let matrix_ms = start.elapsed().as_secs_f64() * 1e3;
    let side = pairs.len();
    let each_us = matrix_ms * 1e3 / f64::from(n_lengths);
    format!("{side} by {side} lengths, {name}: {matrix_ms:.2} ms, {each_us:.2} us each (sum {sum})")
}

/// Whether costs are those that the crates' searches find.
fn check(plans: &Plans, pairs: &[(usize, usize)]) -> Result<(), Box<dyn Error>> {
    let mut scratch = Scratch::default();
    for &(from, to) in pairs {
        let cost = plans.cost(from, to, &mut scratch);
        let searched = [dijkstra(plans.space(), from, to), astar(plans.space(), from, to)];
        if searched.iter().any(|&other| other != Some(cost)) {
            return Err(format!("from {from} to {to}: {cost}, searched {searched:?}").into());
        }
    }
    Ok(())
}

/// Times of smooth paths between the centres of cells.
fn dense(building: &Building, radius_m: f64, pairs: &[(usize, usize)]) -> Sample {
    let Building { plans, free, .. } = building;
    let obstacles = Obstacles::new(free);
    let info = free.info();
    let width = info.width as usize;
    let center =
        |cell: usize| Point2::new((cell % width) as f64 + 0.5, (cell / width) as f64 + 0.5);
    let resolution_m = info.frame.resolution_m();
    let metres = |cell: usize| info.origin() + center(cell).coords * resolution_m;
    let (mut scratch, mut smooth_scratch) = (Scratch::default(), SmoothScratch::default());
    Sample::of(pairs, |from, to| {
        let passage = Passage {
            obstacles: &obstacles,
            radius_m,
            weights: None,
            start: metres(from),
            goal: metres(to),
        };
        let path = plans.waypoints(from, to, &mut scratch, |a, b| passage.is_clear(a, b))?;
        let cells = path.cells.iter().map(|&cell| cell as usize);
        Some(smooth(&passage, cells, &mut smooth_scratch).length_m)
    })
}
