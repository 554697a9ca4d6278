//! Lengths of the problems of the Moving AI Lab, all of them.
//!
//! ```text
//! cargo bench -p meetpoint-planning --bench movingai -- FILE.map.gz...
//! ```
//!
//! FILE.map.scen.gz lies beside the map and holds the optimal lengths, with eight neighbours and no
//! cutting of corners (N. R. Sturtevant, "Benchmarks for grid-based pathfinding", IEEE Transactions
//! on Computational Intelligence and AI in Games 4 (2012)). A length is reproduced if it is the
//! scenario's to the digits that the file prints. A cell is taken as 0.5 m wide.

use std::error::Error;
use std::io::Read;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use flate2::read::GzDecoder;
use meetpoint_geometry::{Cell, GridFrame, GridInfo};
use meetpoint_planning::{ArcCost, Plans, Scratch, Space, enterable, length_cells};
use meetpoint_topology::{FreeSpace, TopologyParams, segmentation, topological_graph};

/// Edge of a cell, in metres: rooms of 16 cells with doors of one are then 8 m and 0.5 m wide.
const RESOLUTION_M: f64 = 0.5;
/// Memory for costs between gates, in bytes.
const PAIR_BYTES_MAX: usize = 64 << 20;

/// One line of a scenario.
struct Problem {
    start: [usize; 2],
    goal: [usize; 2],
    length: f64,
    /// Half of the last digit printed.
    rounding: f64,
}

fn main() -> Result<(), Box<dyn Error>> {
    println!("| map | cells | regions | problems | reproduced | longest | tables | mean of all |");
    println!("|---|---|---|---|---|---|---|---|");
    let mut n_wrong = 0;
    for path in std::env::args().skip(1).filter(|word| !word.starts_with("--")) {
        n_wrong += compare(&path)?;
    }
    if 0 < n_wrong { Err(format!("{n_wrong} lengths are others").into()) } else { Ok(()) }
}

/// Prints a map's line; how many lengths are others than the scenario's.
fn compare(path: &str) -> Result<usize, Box<dyn Error>> {
    let free = read_map(&unpacked(path)?)?;
    let problems = read_problems(&unpacked(&path.replace(".map.gz", ".map.scen.gz"))?)?;
    let start = Instant::now();
    let found = segmentation(&free, &TopologyParams::INDOOR);
    let graph = topological_graph(&found.partition, &found.lines, &found.clearance);
    let space = Arc::new(Space::uniform(free.info(), &enterable(&free, 0.0))?);
    let arcs = vec![ArcCost::Open(0); graph.arcs.len()];
    let plans = Plans::new(space, Arc::new(found.partition), &graph, &arcs, PAIR_BYTES_MAX);
    let building = start.elapsed();
    // The rim.
    let index = |[x, y]: [usize; 2]| (y + 1) * free.info().width as usize + x + 1;
    let mut scratch = Scratch::default();
    let start = Instant::now();
    let lengths: Vec<f64> = problems
        .iter()
        .map(|problem| {
            length_cells(plans.cost(index(problem.start), index(problem.goal), &mut scratch))
        })
        .collect();
    let mean_us = start.elapsed().as_secs_f64() * 1e6 / problems.len().max(1) as f64;
    let is_same = |(problem, &length): (&Problem, &f64)| {
        (length - problem.length).abs() <= problem.rounding + 1e-6 * problem.length.max(1.0)
    };
    let n_same = problems.iter().zip(&lengths).filter(|&pair| is_same(pair)).count();
    let longest = lengths.iter().copied().fold(0.0, f64::max);
    let name = Path::new(path).file_name().map(|name| name.to_string_lossy().into_owned());
    println!(
        "| {} | {} | {} | {} | {n_same} | {longest:.1} | {:.0} ms | {mean_us:.2} us |",
        name.unwrap_or_default(),
        plans.size().n_cells,
        graph.regions.len(),
        problems.len(),
        building.as_secs_f64() * 1e3,
    );
    Ok(problems.len() - n_same)
}

fn unpacked(path: &str) -> Result<String, Box<dyn Error>> {
    let file = std::fs::File::open(path).map_err(|error| format!("{path}: {error}"))?;
    let mut text = String::new();
    GzDecoder::new(file).read_to_string(&mut text)?;
    Ok(text)
}

/// Free cells of an octile map, its first row lowest.
fn read_map(text: &str) -> Result<FreeSpace, Box<dyn Error>> {
    let rows: Vec<&str> = text.lines().skip_while(|line| *line != "map").skip(1).collect();
    let width = rows.first().map_or(0, |row| row.len());
    let is_free: Vec<bool> =
        rows.iter().flat_map(|row| row.bytes().map(|cell| b".GS".contains(&cell))).collect();
    let frame = GridFrame::new(RESOLUTION_M).map_err(|_| "no such resolution")?;
    let [width, height] = [width, rows.len()].map(u32::try_from);
    let info = GridInfo { frame, first: Cell { x: 0, y: 0 }, width: width?, height: height? };
    Ok(FreeSpace::from_cells(info, &is_free))
}

fn read_problems(text: &str) -> Result<Vec<Problem>, Box<dyn Error>> {
    let lines = text.lines().filter(|line| line.contains('\t'));
    lines
        .map(|line| {
            let words: Vec<&str> = line.split('\t').collect();
            let [_, _, _, _, x, y, to_x, to_y, length] = words[..] else {
                return Err(format!("not a problem: {line}").into());
            };
            let digits = length.split_once('.').map_or(0, |(_, digits)| digits.len());
            let digits = i32::try_from(digits)?;
            Ok(Problem {
                start: [x.parse()?, y.parse()?],
                goal: [to_x.parse()?, to_y.parse()?],
                length: length.trim().parse()?,
                rounding: 0.5 * 10_f64.powi(-digits),
            })
        })
        .collect()
}
