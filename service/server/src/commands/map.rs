//! `meetpoint map`: a map's grid as a picture, as files for `map_server`, or in the terminal.

use std::path::PathBuf;

use anyhow::Context;
use meetpoint_geometry::{Cell, GridFrame, GridInfo};
use meetpoint_occupancy::{Raster, npy, pgm, png, terminal, yaml};
use meetpoint_proto::v1;

use super::asked::{ServerArgs, save};
use super::import::{self, ImportArgs};

/// Columns of a drawing where the terminal does not say its width.
const N_COLUMNS_DEFAULT: usize = 100;

/// What can be done with maps besides drawing one.
#[derive(Debug, clap::Subcommand)]
enum MapCommand {
    /// Make a map version from a `map_server` map: its YAML and the image that it names
    Import(ImportArgs),
}

/// Options of `meetpoint map`.
#[derive(Debug, clap::Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub struct MapArgs {
    #[command(subcommand)]
    command: Option<MapCommand>,
    /// The map
    #[arg(required_unless_present = "session")]
    map: Option<String>,
    /// What this session of unknown start has drawn, instead: while it is not placed in the map
    #[arg(long, value_name = "ID", conflicts_with = "map")]
    session: Option<String>,
    /// The version; the published one where nothing is said
    #[arg(long, default_value_t = 0, hide_default_value = true)]
    version: u64,
    /// What to write; `pgm` writes the YAML that `map_server` reads beside it
    #[arg(long, value_enum, default_value_t = Format::Terminal)]
    format: Format,
    /// Where to write it; `MAP.png`, `MAP.pgm`... where nothing is said
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
    #[command(flatten)]
    server: ServerArgs,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Format {
    /// Draw it here
    Terminal,
    /// A grey picture
    Png,
    /// As `map_server` reads it, with its YAML
    Pgm,
    /// A NumPy array of probabilities
    Npy,
}

/// Imports a map, or asks for a grid and writes it.
///
/// # Errors
/// If there is none, or it cannot be read or written.
pub async fn run(args: MapArgs) -> anyhow::Result<()> {
    let MapArgs { command, map, session, version, .. } = &args;
    let grid = match (command, map, session) {
        (Some(MapCommand::Import(args)), ..) => return import::run(args).await,
        (None, Some(map), _) => args.server.client()?.grid(map, *version).await?,
        (None, None, Some(session)) => {
            args.server.client()?.session_grid(session, *version).await?
        }
        (None, None, None) => anyhow::bail!("which map?"),
    };
    draw(&args, grid)
}

fn draw(args: &MapArgs, grid: v1::Grid) -> anyhow::Result<()> {
    let version = grid.map_version;
    let of_session = (!grid.frame_session.is_empty()).then(|| grid.frame_session.clone());
    let map = of_session.unwrap_or_else(|| grid.map.clone());
    let raster = raster(grid)?;
    let files = match args.format {
        Format::Terminal => {
            println!("{}", terminal(&raster, n_columns()));
            Vec::new()
        }
        Format::Png => vec![(path(args, &map, "png"), png(&raster))],
        Format::Npy => vec![(path(args, &map, "npy"), npy(&raster))],
        Format::Pgm => {
            let image = path(args, &map, "pgm");
            let name = image.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let text = yaml(&raster, &name);
            let beside = image.with_extension("yaml");
            vec![(image, pgm(&raster)), (beside, text.into_bytes())]
        }
    };
    for (path, bytes) in &files {
        save(path, bytes)?;
    }
    report(args, &map, version, &raster, &files);
    Ok(())
}

fn report(args: &MapArgs, map: &str, version: u64, raster: &Raster, files: &[(PathBuf, Vec<u8>)]) {
    let names: Vec<String> = files.iter().map(|(path, _)| path.display().to_string()).collect();
    let GridInfo { frame, width, height, .. } = raster.info;
    if args.server.json {
        let told = serde_json::json!({
            "map": map,
            "map_version": version,
            "resolution_m": frame.resolution_m(),
            "width": width,
            "height": height,
            "files": names,
        });
        println!("{told}");
        return;
    }
    let side_m = frame.resolution_m();
    eprintln!(
        "map {map}, version {version}: {:.1} by {:.1} m in cells of {side_m} m{}{}",
        f64::from(width) * side_m,
        f64::from(height) * side_m,
        if names.is_empty() { "" } else { "; written: " },
        names.join(", "),
    );
}

fn path(args: &MapArgs, map: &str, extension: &str) -> PathBuf {
    args.output.clone().unwrap_or_else(|| PathBuf::from(format!("{map}.{extension}")))
}

fn n_columns() -> usize {
    std::env::var("COLUMNS").ok().and_then(|text| text.parse().ok()).unwrap_or(N_COLUMNS_DEFAULT)
}

/// The grid as it came over the wire, as a raster again: percents become log-odds.
pub(crate) fn raster(grid: v1::Grid) -> anyhow::Result<Raster> {
    let v1::Grid { resolution_m, origin, width, height, cells, .. } = grid;
    let frame = GridFrame::new(resolution_m)
        .map_err(|_| anyhow::anyhow!("the service sent a resolution of {resolution_m} m"))?;
    let v1::Point { x_m, y_m } = origin.context("the service sent a grid without origin")?;
    let middle = nudge(x_m, y_m, resolution_m);
    let Cell { x, y } = frame.cell_at(middle);
    let info = GridInfo { frame, first: Cell { x, y }, width, height };
    anyhow::ensure!(cells.len() == info.n_cells(), "the service sent a grid of another size");
    let log_odds = cells.into_iter().map(log_odds_of_percent).collect();
    Ok(Raster { info, log_odds })
}

/// The middle of the cell whose lower-left corner is given, against rounding.
fn nudge(x_m: f64, y_m: f64, resolution_m: f64) -> meetpoint_geometry::Point2<f64> {
    meetpoint_geometry::Point2::new(x_m + 0.5 * resolution_m, y_m + 0.5 * resolution_m)
}

fn log_odds_of_percent(percent: u8) -> f32 {
    if percent > 100 {
        return f32::NAN;
    }
    let p = f32::from(percent) / 100.0;
    (p / (1.0 - p)).ln()
}
