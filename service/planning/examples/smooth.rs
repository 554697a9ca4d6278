//! Smooth paths on real plans against Euclidean shortest paths.
//!
//! ```text
//! cargo run --release -p meetpoint-planning --example smooth -- N_PAIRS RADIUS_M PLAN.png...
//! ```
//!
//! Cells are 0.05 m, free where the image is nearly white. Prints, over random pairs of cells that
//! a robot of that radius can go between: the length of the smooth path over that of the truth
//! (mean, median, p99, worst), clearance less radius at its least, turns, and microseconds.

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use meetpoint_geometry::{Cell, GridFrame, GridInfo};
use meetpoint_occupancy::{cells_from_picture, read_png, read_yaml};
use meetpoint_planning::{
    Components, Obstacles, Passage, Search, SmoothPath, SmoothScratch, Space, components,
    enterable, length_cells, smooth,
};
use meetpoint_topology::FreeSpace;
use visibility::Visibility;

#[path = "../tests/planning/visibility.rs"]
mod visibility;

/// Chords a quarter turn of the obstacles that the truth goes around: 0.5 % of the turns.
const N_CHORDS: usize = 8;
/// Times a path is pulled, of which the median is told: the machine may be shared.
const N_RUNS: usize = 21;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [n_pairs, radius_m, plans @ ..] = &arguments[..] else {
        return Err("usage: smooth N_PAIRS RADIUS_M PLAN.png...".into());
    };
    let (n_pairs, radius_m): (usize, f64) = (n_pairs.parse()?, radius_m.parse()?);
    println!(
        "{:<28} {:>5} {:>8} {:>8} {:>8} {:>8} {:>8} {:>9} {:>6} {:>7} {:>7}",
        "plan",
        "pairs",
        "grid",
        "mean",
        "median",
        "p99",
        "worst",
        "margin_m",
        "turns",
        "us",
        "us99"
    );
    for plan in plans {
        measure(Path::new(plan), n_pairs, radius_m)?;
    }
    Ok(())
}

/// The free cells of a plan.
fn free_space(path: &Path) -> Result<FreeSpace, Box<dyn Error>> {
    let yaml = read_yaml(
        "image: plan.png\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\n\
         occupied_thresh: 0.65\nfree_thresh: 0.04\n",
    )?;
    let grid = cells_from_picture(&read_png(&std::fs::read(path)?)?, &yaml);
    let frame = GridFrame::new(yaml.resolution_m).map_err(|_| "no such resolution")?;
    let first = Cell { x: 0, y: 0 };
    let info = GridInfo { frame, first, width: grid.width, height: grid.height };
    let is_free: Vec<bool> = grid.cells.iter().map(|&cell| cell == 0).collect();
    Ok(FreeSpace::from_cells(info, &is_free))
}

/// A pair's figures.
struct Figures {
    grid: f64,
    ratio: f64,
    margin_m: f64,
    n_turns: usize,
    micros: f64,
}

fn measure(path: &Path, n_pairs: usize, radius_m: f64) -> Result<(), Box<dyn Error>> {
    let free = free_space(path)?;
    let space = Space::uniform(free.info(), &enterable(&free, radius_m))?;
    let resolution_m = free.info().frame.resolution_m();
    let obstacles = Obstacles::new(&free);
    let truth = Visibility::new(&free, radius_m / resolution_m, N_CHORDS);
    let (mut search, mut scratch) = (Search::default(), SmoothScratch::default());
    let mut figures = vec![];
    for [start, goal] in pairs(&space, &components(&space), n_pairs) {
        let Some(cost) = search.between(&space, start, goal) else { continue };
        let cells = search.path(&space, goal);
        let center = |index: usize| {
            let width = free.info().width as usize;
            let [x, y] = [index % width, index / width].map(|n| i32::try_from(n).unwrap_or(0));
            let first = free.info().first;
            free.info().frame.center_of(Cell { x: first.x + x, y: first.y + y })
        };
        let passage = Passage {
            obstacles: &obstacles,
            radius_m,
            weights: None,
            start: center(start),
            goal: center(goal),
        };
        let mut pull = || smooth(&passage, cells.iter().copied(), &mut scratch);
        let found = pull();
        if found.clearance_min_m < radius_m {
            return Err(format!("{} m from an obstacle", found.clearance_min_m).into());
        }
        let mut times: Vec<f64> = (0..N_RUNS).map(|_| micros(&mut pull)).collect();
        times.sort_by(f64::total_cmp);
        let micros = times[N_RUNS / 2];
        let [a, b] = [start, goal].map(|cell| obstacles.in_cells(center(cell)));
        let bound = found.length_m / resolution_m * (1.0 + 1e-9) + 1e-9;
        let least_m = truth.length(a, b, bound).ok_or("shorter than the truth")? * resolution_m;
        figures.push(figures_of(
            &found,
            least_m,
            length_cells(cost) * resolution_m,
            radius_m,
            micros,
        ));
    }
    print(&path.file_stem().unwrap_or_default().to_string_lossy(), &figures);
    Ok(())
}

/// How long it takes, in microseconds.
fn micros(pull: &mut impl FnMut() -> SmoothPath) -> f64 {
    let before = Instant::now();
    std::hint::black_box(pull());
    before.elapsed().as_secs_f64() * 1e6
}

fn figures_of(
    found: &SmoothPath,
    least_m: f64,
    grid_m: f64,
    radius_m: f64,
    micros: f64,
) -> Figures {
    Figures {
        grid: grid_m / least_m,
        ratio: found.length_m / least_m,
        margin_m: found.clearance_min_m - radius_m,
        n_turns: found.points.len().saturating_sub(2),
        micros,
    }
}

/// Random pairs of cells that hang together: the same ones every time.
fn pairs(space: &Space, components: &Components, n_pairs: usize) -> Vec<[usize; 2]> {
    let cells: Vec<usize> =
        (0..space.info().n_cells()).filter(|&cell| space.is_enterable(cell)).collect();
    let mut state = 1_u64;
    let mut random = || {
        // D. Knuth's MMIX.
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        cells[(state >> 33) as usize % cells.len()]
    };
    let mut pairs = vec![];
    while pairs.len() < n_pairs {
        let pair = [random(), random()];
        if pair[0] != pair[1] && components.are_joined(pair[0], pair[1]) {
            pairs.push(pair);
        }
    }
    pairs
}

fn print(name: &str, figures: &[Figures]) {
    let sorted = |of: fn(&Figures) -> f64| {
        let mut values: Vec<f64> = figures.iter().map(of).collect();
        values.sort_by(f64::total_cmp);
        values
    };
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let at = |values: &[f64], percent: usize| values[percent * (values.len() - 1) / 100];
    let [grid, ratios, margins, turns, micros] = [
        sorted(|f| f.grid),
        sorted(|f| f.ratio),
        sorted(|f| f.margin_m),
        sorted(|f| f.n_turns as f64),
        sorted(|f| f.micros),
    ];
    println!(
        "{name:<28} {:>5} {:>8.5} {:>8.5} {:>8.5} {:>8.5} {:>8.5} {:>9.6} {:>6.1} {:>7.2} {:>7.2}",
        figures.len(),
        mean(&grid),
        mean(&ratios),
        at(&ratios, 50),
        at(&ratios, 99),
        at(&ratios, 100),
        at(&margins, 0),
        mean(&turns),
        mean(&micros),
        at(&micros, 99),
    );
}
