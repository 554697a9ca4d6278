//! `meetpoint plan`: a path on a map, as a line, a picture, GeoJSON or JSON.

use std::path::{Path, PathBuf};

use meetpoint_proto::v1;
use serde_json::{Value, json};

use super::asked::{ServerArgs, save};
use super::map::raster;
use super::plan_picture;
use crate::rest::PathReply;

/// Options of `meetpoint plan`.
#[derive(Debug, clap::Args)]
pub struct PlanArgs {
    /// The map
    map: String,
    /// Where to start, in metres in the map's frame
    #[arg(long, value_name = "X,Y", value_parser = point, allow_hyphen_values = true, required_unless_present = "hypothesis")]
    from: Option<v1::Point>,
    /// Where to go
    #[arg(long, value_name = "X,Y", value_parser = point, allow_hyphen_values = true, required_unless_present = "hypothesis")]
    to: Option<v1::Point>,
    /// On a map of places that a robot told of: its id, or `simplest`
    #[arg(long, value_name = "ID", default_value = "", hide_default_value = true, conflicts_with_all = ["from", "to", "radius", "profile", "alternatives", "version"])]
    hypothesis: String,
    /// The place to start at; the robot's where nothing is said
    #[arg(long, value_name = "N", requires = "hypothesis")]
    from_place: Option<u32>,
    /// The place to go to; the robot's where nothing is said
    #[arg(long, value_name = "N", requires = "hypothesis")]
    to_place: Option<u32>,
    /// Whose travel the map of places fits; that opened last of those that told of visits, if none is given
    #[arg(
        long,
        value_name = "ID",
        default_value = "",
        hide_default_value = true,
        requires = "hypothesis"
    )]
    session: String,
    /// Radius of the robot, metres; the profile `default` where nothing is said
    #[arg(long, value_name = "R", conflicts_with = "profile")]
    radius: Option<f64>,
    /// A profile of the map
    #[arg(long)]
    profile: Option<String>,
    /// How to find the path
    #[arg(long, value_enum, default_value_t = Mode::Exact)]
    mode: Mode,
    /// Other routes to find besides the best, up to 8
    #[arg(long, default_value_t = 0, hide_default_value = true)]
    alternatives: u32,
    /// The version; the published one where nothing is said
    #[arg(long, default_value_t = 0, hide_default_value = true)]
    version: u64,
    /// Write it: a picture (.png), GeoJSON (.geojson) or JSON (.json)
    #[arg(long, short, value_name = "FILE")]
    out: Option<PathBuf>,
    #[command(flatten)]
    server: ServerArgs,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Mode {
    /// The shortest path in the grid
    Exact,
    /// Triplet plans along the regions of the shortest path
    Triplet,
    /// As Thrun 1998 plans: fewest regions, triplets, final goal
    Paper,
}

/// What is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Png,
    Geojson,
    Json,
}

/// Reads `X,Y`.
pub(super) fn point(text: &str) -> Result<v1::Point, String> {
    let numbers: Option<Vec<f64>> =
        text.split(',').map(|number| number.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[x_m, y_m]) => Ok(v1::Point { x_m, y_m }),
        _ => Err(format!("`{text}` is not X,Y: two numbers in metres")),
    }
}

/// Asks for the path, tells and writes it.
///
/// # Errors
/// If there is none, or it cannot be written.
pub async fn run(args: PlanArgs) -> anyhow::Result<()> {
    let format = args.out.as_deref().map(format_of).transpose()?;
    let client = args.server.client()?;
    let reply = client.plan_path(request(&args)).await?;
    if let (Some(path), Some(format)) = (&args.out, format) {
        let bytes = match format {
            Format::Json => serde_json::to_vec(&PathReply::new(reply.clone())?)?,
            Format::Geojson => serde_json::to_vec(&geojson(&reply))?,
            Format::Png => {
                let (Some(from), Some(to)) = (args.from, args.to) else {
                    anyhow::bail!("a map of places is drawn by `meetpoint hypotheses --png`");
                };
                let version = reply.basis.as_ref().map_or(0, |basis| basis.map_version);
                let pruning = v1::GraphPruning::Unspecified;
                let graph = client.graph(&args.map, version, pruning, true).await?;
                let grid = client.grid(&args.map, version).await?;
                plan_picture::png(&raster(grid)?, &graph, &reply, [from, to])?
            }
        };
        save(path, &bytes)?;
    }
    if args.server.json {
        println!("{}", serde_json::to_string(&PathReply::new(reply.clone())?)?);
    } else if args.out.as_ref().is_none_or(|path| path.as_os_str() != "-") {
        report(&reply);
    }
    if reply.code() != v1::PlanCode::Ok {
        anyhow::bail!("{}: {}", name(&reply), reply.what_to_do);
    }
    Ok(())
}

fn request(args: &PlanArgs) -> v1::PlanPathRequest {
    use v1::robot_choice::Kind;
    let profile = args.profile.clone().map(Kind::Profile);
    let kind = profile.or_else(|| args.radius.map(Kind::RobotRadiusM));
    let mode = match args.mode {
        Mode::Exact => v1::PlanMode::Exact,
        Mode::Triplet => v1::PlanMode::Triplet,
        Mode::Paper => v1::PlanMode::Paper,
    };
    v1::PlanPathRequest {
        map: args.map.clone(),
        start: args.from,
        goal: args.to,
        robot: kind.map(|kind| v1::RobotChoice { kind: Some(kind) }),
        mode: mode.into(),
        alternatives: args.alternatives,
        map_version: args.version,
        route_only: false,
        cells: false,
        hypothesis: args.hypothesis.clone(),
        tree: (!args.hypothesis.is_empty())
            .then(|| v1::TreeName { session: args.session.clone(), ..v1::TreeName::default() }),
        from_place: args.from_place,
        to_place: args.to_place,
    }
}

fn format_of(path: &Path) -> anyhow::Result<Format> {
    match path.extension().and_then(|extension| extension.to_str()) {
        Some("png") => Ok(Format::Png),
        Some("geojson") => Ok(Format::Geojson),
        Some("json") => Ok(Format::Json),
        _ => anyhow::bail!("{}: the name ends in .png, .geojson or .json", path.display()),
    }
}

/// The code as it is written in the contract.
fn name(reply: &v1::PlanPathResponse) -> String {
    reply.code().as_str_name().trim_start_matches("PLAN_CODE_").to_owned()
}

fn report(reply: &v1::PlanPathResponse) {
    for warning in &reply.warnings {
        eprintln!("warning: {warning}");
    }
    let basis = reply.basis.clone().unwrap_or_default();
    if basis.answered_by() == v1::AnsweredBy::Places {
        report_places(reply, &basis);
        return;
    }
    let by = match basis.answered_by() {
        v1::AnsweredBy::Tables => "by tables",
        _ => "by search",
    };
    if let Some(path) = &reply.path {
        println!(
            "{:.2} m, {:.2} m in the grid, clearance {:.2} m, robot of {} m radius",
            path.path_length_m, path.grid_length_m, path.clearance_min_m, basis.robot_radius_m
        );
        println!("route: {}", route(path));
        if 0.0 < path.loss_bound {
            println!("at most {:.3} % dearer than the best", 100.0 * path.loss_bound);
        }
    }
    for path in &reply.alternatives {
        println!("or {:.2} m: {}", path.path_length_m, route(path));
    }
    println!(
        "map {}, version {}, cost revision {}, {by} in {} us",
        basis.map, basis.map_version, basis.cost_revision, reply.planning_time_us
    );
}

/// The same of a path on a map of places: these by their numbers, which are one less than those of regions.
fn report_places(reply: &v1::PlanPathResponse, basis: &v1::PlanBasis) {
    if let Some(path) = &reply.path {
        let places: Vec<String> =
            path.route.iter().map(|step| step.region.saturating_sub(1).to_string()).collect();
        println!("{:.2} m from place to place: {}", path.path_length_m, places.join(" -> "));
    }
    let v1::PlanBasis { map, hypothesis, .. } = basis;
    println!("map {map}, hypothesis {hypothesis}, in {} us", reply.planning_time_us);
}

/// Regions with the arcs between them.
fn route(path: &v1::PlannedPath) -> String {
    let mut text = String::new();
    for step in &path.route {
        match (text.is_empty(), step.arc) {
            (true, _) => {}
            (false, 0) => text.push_str(" -> "),
            (false, arc) => text += &[" -[", &arc.to_string(), "]-> "].concat(),
        }
        text.push_str(&step.region.to_string());
    }
    text
}

/// The best path and the others as lines, in metres in the map's frame.
fn geojson(reply: &v1::PlanPathResponse) -> Value {
    let paths = reply.path.iter().chain(&reply.alternatives);
    let feature = |(rank, path): (usize, &v1::PlannedPath)| {
        let line: Vec<[f64; 2]> = path.points.iter().map(|point| [point.x_m, point.y_m]).collect();
        json!({
            "type": "Feature",
            "geometry": {"type": "LineString", "coordinates": line},
            "properties": {
                "rank": rank,
                "path_length_m": path.path_length_m,
                "grid_length_m": path.grid_length_m,
                "clearance_min_m": path.clearance_min_m,
                "regions": path.route.iter().map(|step| step.region).collect::<Vec<_>>(),
                "arcs": path.route.iter().skip(1).map(|step| step.arc).collect::<Vec<_>>(),
            },
        })
    };
    let basis = reply.basis.clone().unwrap_or_default();
    json!({
        "type": "FeatureCollection",
        "features": paths.enumerate().map(feature).collect::<Vec<_>>(),
        "code": name(reply),
        "map": basis.map,
        "map_version": basis.map_version,
        "cost_revision": basis.cost_revision,
    })
}
