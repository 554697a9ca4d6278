//! Time of look-ups in plan tables, beside searches of well-kept crates on the same pairs.
//!
//! ```text
//! cargo bench -p meetpoint-planning --bench queries -- [--pairs N] [--radius METRES] MAP...
//! cargo bench -p meetpoint-planning --bench queries -- --doors MAP...
//! cargo bench -p meetpoint-planning --bench queries -- --tiles MAP
//! ```
//!
//! MAP is the YAML of a `map_server` map, or an image with cells of 0.05 m. First the costs of some
//! pairs are compared with Dijkstra's. `--doors` closes every arc in turn and tells what the change
//! costs, as a share of making all tables; `--tiles` lays the map side by side, up to ten million
//! cells, and tells how time and memory grow.

mod building;
mod doors;
mod pairs;
#[path = "../../../topology/examples/plan/mod.rs"]
mod plan;
mod rivals;
mod sample;
mod tiles;
mod timing;

use std::error::Error;
use std::path::PathBuf;

/// What the command line says.
struct Arguments {
    n_pairs: usize,
    radius_m: f64,
    what: What,
    maps: Vec<PathBuf>,
}

enum What {
    Queries,
    Doors,
    Tiles,
}

fn main() -> Result<(), Box<dyn Error>> {
    let Arguments { n_pairs, radius_m, what, maps } = arguments(std::env::args().skip(1))?;
    for path in &maps {
        match what {
            What::Queries => timing::compare(path, radius_m, n_pairs)?,
            What::Doors => doors::close_each(path, radius_m)?,
            What::Tiles => tiles::grow(path, radius_m)?,
        }
    }
    Ok(())
}

fn arguments(mut words: impl Iterator<Item = String>) -> Result<Arguments, Box<dyn Error>> {
    let mut found = Arguments { n_pairs: 20_000, radius_m: 0.0, what: What::Queries, maps: vec![] };
    while let Some(word) = words.next() {
        let mut value = || words.next().ok_or(format!("{word} wants a value"));
        match word.as_str() {
            "--pairs" => found.n_pairs = value()?.parse()?,
            "--radius" => found.radius_m = value()?.parse()?,
            "--doors" => found.what = What::Doors,
            "--tiles" => found.what = What::Tiles,
            // What cargo adds.
            "--bench" => {}
            _ => found.maps.push(PathBuf::from(word)),
        }
    }
    Ok(found)
}
