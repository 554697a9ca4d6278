//! `meetpoint graph`: a map's regions and arcs as a table, a picture, GeoJSON or JSON.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use meetpoint_proto::v1;

use super::asked::{ServerArgs, save};
use super::graph_picture;
use super::map::raster;
use crate::convert::geojson::{geojson, pruning_name};
use crate::rest;

/// Rows of the table; the smallest regions beyond are only counted.
const N_ROWS_MAX: usize = 40;

/// Options of `meetpoint graph`.
#[derive(Debug, clap::Args)]
pub struct GraphArgs {
    /// The map
    map: String,
    /// The version; the published one where nothing is said
    #[arg(long, default_value_t = 0, hide_default_value = true)]
    version: u64,
    /// Join regions: pieces of corridors, or those with one neighbour
    #[arg(long, value_enum, default_value_t = Pruned::None)]
    pruned: Pruned,
    /// Write it: a picture (.png), GeoJSON (.geojson) or JSON (.json)
    #[arg(long, short, value_name = "FILE")]
    out: Option<PathBuf>,
    #[command(flatten)]
    server: ServerArgs,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Pruned {
    /// All regions as they are
    None,
    /// Neighbours with at most two neighbours each become one
    Pairs,
    /// A region with one neighbour becomes one with it
    Ends,
}

/// What is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Png,
    Geojson,
    Json,
}

/// Asks for the graph, shows it and writes it.
///
/// # Errors
/// If there is none, or it cannot be written.
pub async fn run(args: GraphArgs) -> anyhow::Result<()> {
    let format = args.out.as_deref().map(format_of).transpose()?;
    let client = args.server.client()?;
    let pruning = match args.pruned {
        Pruned::None => v1::GraphPruning::Unspecified,
        Pruned::Pairs => v1::GraphPruning::Pairs,
        Pruned::Ends => v1::GraphPruning::Ends,
    };
    let has_outlines = matches!(format, Some(Format::Png | Format::Geojson));
    let graph = client.graph(&args.map, args.version, pruning, has_outlines).await?;
    if let (Some(path), Some(format)) = (&args.out, format) {
        let bytes = match format {
            Format::Json => serde_json::to_vec(&rest::Graph::from(graph.clone()))?,
            Format::Geojson => serde_json::to_vec(&geojson(&graph))?,
            Format::Png => {
                let grid = client.grid(&args.map, graph.map_version).await?;
                graph_picture::png(&raster(grid)?, &graph)?
            }
        };
        save(path, &bytes)?;
    }
    if args.server.json {
        println!("{}", summary(&graph, args.out.as_deref()));
    } else if args.out.as_ref().is_none_or(|path| path.as_os_str() != "-") {
        table(&graph);
    }
    Ok(())
}

fn format_of(path: &Path) -> anyhow::Result<Format> {
    match path.extension().and_then(|extension| extension.to_str()) {
        Some("png") => Ok(Format::Png),
        Some("geojson") => Ok(Format::Geojson),
        Some("json") => Ok(Format::Json),
        _ => anyhow::bail!("{}: the name ends in .png, .geojson or .json", path.display()),
    }
}

fn summary(graph: &v1::Graph, out: Option<&Path>) -> serde_json::Value {
    serde_json::json!({
        "map": graph.map,
        "map_version": graph.map_version,
        "cost_revision": graph.cost_revision,
        "pruned": pruning_name(graph.pruning()),
        "regions": places(graph).len(),
        "specks": graph.regions.len() - places(graph).len(),
        "arcs": graph.arcs.len(),
        "area_m2": area_m2(graph),
        "file": out.map(|path| path.display().to_string()),
    })
}

/// Regions that are places, the largest first.
fn places(graph: &v1::Graph) -> Vec<&v1::Region> {
    let mut places: Vec<&v1::Region> =
        graph.regions.iter().filter(|region| !region.is_speck).collect();
    places.sort_by(|a, b| b.area_m2.total_cmp(&a.area_m2));
    places
}

fn area_m2(graph: &v1::Graph) -> f64 {
    graph.regions.iter().map(|region| region.area_m2).sum()
}

/// A line a region: where it is, and which ways lead to other places.
fn table(graph: &v1::Graph) {
    let places = places(graph);
    let is_place = |id: u64| places.iter().any(|region| region.id == id);
    let mut ways: BTreeMap<u64, Vec<String>> = BTreeMap::new();
    for &v1::Arc { region_a, region_b, width_m, .. } in &graph.arcs {
        for [from, to] in [[region_a, region_b], [region_b, region_a]] {
            if is_place(to) {
                ways.entry(from).or_default().push(format!("{to} ({width_m:.2} m)"));
            }
        }
    }
    println!(
        "map {}, version {}: {} regions and {} arcs, {:.0} m2 free, {} specks",
        graph.map,
        graph.map_version,
        places.len(),
        graph.arcs.len(),
        area_m2(graph),
        graph.regions.len() - places.len(),
    );
    println!("{:>7} {:>9} {:>11} {:>17}  ways to", "region", "area m2", "clearance m", "center m");
    for region in places.iter().take(N_ROWS_MAX) {
        let v1::Region { id, area_m2, center, clearance_m, .. } = region;
        let v1::Point { x_m, y_m } = center.unwrap_or_default();
        let place = format!("{x_m:.2}, {y_m:.2}");
        let ways = ways.get(id).map_or_else(String::new, |ways| ways.join(", "));
        println!("{id:>7} {area_m2:>9.1} {clearance_m:>11.2} {place:>17}  {ways}");
    }
    if N_ROWS_MAX < places.len() {
        println!("        and {} smaller ones", places.len() - N_ROWS_MAX);
    }
}
