//! Tables 2 and 3 of the paper, for the paper's planner and two better ones.
//!
//! ```text
//! cargo bench -p meetpoint-planning --bench plans -- \
//!     [--pairs N] [--radius METRES] [--plots FOLDER] MAP...
//! ```
//!
//! MAP is the YAML of a `map_server` map, or an image alone, which is then taken to have cells of
//! 0.05 m that are free where it is nearly white. Random pairs of cells that can be reached from
//! each other, the same in every run, are planned for in the graph as it is and pruned; the paths
//! are compared with shortest ones of the grid. FOLDER gets a picture of the loss by path length for
//! every map (figures 18 to 20 of the paper).

mod comparison;
mod map;
mod pairs;
#[path = "../../../topology/examples/plan/mod.rs"]
mod plan;
mod plot;
mod tables;
mod tally;

use std::error::Error;
use std::path::{Path, PathBuf};

use comparison::{Comparison, GraphKind};
use map::Map;

/// What the command line says.
struct Arguments {
    n_pairs: usize,
    radius_m: f64,
    plots: Option<PathBuf>,
    maps: Vec<PathBuf>,
}

/// As many as make a mean stand to three digits, and 320 goals by 320 starts.
const N_PAIRS: usize = 102_400;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = arguments(std::env::args().skip(1))?;
    let mut found = vec![];
    for path in &arguments.maps {
        let map = Map::read(path, arguments.radius_m)?;
        let comparisons = comparison::compared(&map, arguments.n_pairs);
        // A long run shows what it has.
        println!("{}", tables::of_lengths(&map, &comparisons));
        if let Some(folder) = &arguments.plots {
            draw(folder, &map, &comparisons)?;
        }
        found.push((map.name, comparisons));
    }
    println!("{}", tables::of_graphs(&found));
    println!("{}", tables::of_losses(&found));
    Ok(())
}

fn arguments(mut words: impl Iterator<Item = String>) -> Result<Arguments, Box<dyn Error>> {
    let mut found = Arguments { n_pairs: N_PAIRS, radius_m: 0.0, plots: None, maps: vec![] };
    while let Some(word) = words.next() {
        let mut value = || words.next().ok_or(format!("{word} wants a value"));
        match word.as_str() {
            "--pairs" => found.n_pairs = value()?.parse()?,
            "--radius" => found.radius_m = value()?.parse()?,
            "--plots" => found.plots = Some(value()?.into()),
            // Cargo says so to every bench.
            "--bench" => {}
            _ => found.maps.push(word.into()),
        }
    }
    Ok(found)
}

fn draw(folder: &Path, map: &Map, comparisons: &[Comparison]) -> Result<(), Box<dyn Error>> {
    std::fs::create_dir_all(folder)?;
    for comparison in comparisons {
        let kind = match comparison.kind {
            GraphKind::Regular => "regular",
            GraphKind::Pruned => "pruned",
        };
        plot::draw(comparison, &folder.join(format!("{}-{kind}.png", map.name)))?;
    }
    Ok(())
}
