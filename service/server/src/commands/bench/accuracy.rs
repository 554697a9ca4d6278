//! `meetpoint bench accuracy`: logs through the whole service, live and relaxed, against relations.

mod interval;
mod log_variant;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::Context;
use meetpoint_geometry::Pose;

use super::measurement::{Cost, Measurement, measurement};
use super::relations::{self, Errors, Relation};
use interval::{Interval, interval};
use log_variant::{LogVariant, variants};

/// A map of which this is the mean translational error has come apart, in metres: no wall is where it is.
const BROKEN_M: f64 = 0.5;
/// Nanoseconds in a second.
const SECOND_NS: f64 = 1e9;

/// Options of `meetpoint bench accuracy`.
#[derive(Debug, clap::Args)]
pub(super) struct AccuracyArgs {
    /// Logs, each followed by its relations
    #[arg(required = true, num_args = 2.., value_names = ["LOG", "RELATIONS"])]
    files: Vec<PathBuf>,
    /// Folder for the databases, on the disk that is to be measured
    #[arg(long, value_name = "FOLDER", default_value = ".")]
    data: PathBuf,
    /// Count once more only relations whose ends lie more than so many seconds apart
    #[arg(long, value_name = "SECONDS")]
    min_gap: Option<f64>,
    /// Also measure each log thinned, cut, begun anywhere, and with worse sensors
    #[arg(long)]
    variants: bool,
    /// Seed of the bootstrap, of random starts and of wrong beams
    #[arg(long, value_name = "SEED", default_value_t = 1)]
    seed: u64,
    /// Also write what was measured as JSON lines
    #[arg(long)]
    json: bool,
}

/// Errors of one trajectory over some relations.
struct Accuracy {
    errors: Errors,
    translation_m: Interval,
    rotation_rad: Interval,
}

/// One line of the table.
struct Row<'a> {
    name: String,
    measurement: &'a Measurement,
    live: Accuracy,
    relaxed: Accuracy,
}

/// Measures every log, one after the other, each on an empty database.
pub(super) async fn run(args: AccuracyArgs) -> anyhow::Result<()> {
    anyhow::ensure!(args.files.len().is_multiple_of(2), "each log needs its relations behind it");
    if !args.json {
        println!(
            "| log | scans | replay: wall, CPU | relax: wall, CPU | peak memory | closures | live | relaxed | relations missing |"
        );
        println!("|---|---|---|---|---|---|---|---|---|");
    }
    let (mut n_missing, mut broken) = (0, Vec::new());
    for pair in args.files.chunks_exact(2) {
        let (log, truth) = (&pair[0], truth(&pair[1])?);
        let whole = measurement(log, &[], &args.data).await?;
        let name = log.file_name().unwrap_or_default().to_string_lossy().into_owned();
        n_missing += rows(&name, &whole, &truth, &args)?;
        if !args.variants {
            continue;
        }
        for variant in variants(args.seed) {
            let relaxed_m = of_variant(&name, log, (&variant, &truth), &args).await?;
            if BROKEN_M < relaxed_m {
                broken.push(format!("{name}, {}", variant.name()));
            }
        }
    }
    anyhow::ensure!(broken.is_empty(), "maps that came apart: {}", broken.join("; "));
    anyhow::ensure!(n_missing == 0, "{n_missing} relations have no pose");
    Ok(())
}

fn truth(path: &Path) -> anyhow::Result<Vec<Relation>> {
    let text =
        std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    relations::read(&text).with_context(|| format!("in {}", path.display()))
}

/// Prints the lines of a whole log; how many relations are missing.
fn rows(
    name: &str,
    measurement: &Measurement,
    truth: &[Relation],
    args: &AccuracyArgs,
) -> anyhow::Result<usize> {
    let row = |name: String, gap_s| {
        let live = accuracy(&measurement.live, truth, (gap_s, args.seed))?;
        let relaxed = accuracy(&measurement.relaxed, truth, (gap_s, args.seed))?;
        Ok::<_, anyhow::Error>(Row { name, measurement, live, relaxed })
    };
    let all = row(name.to_owned(), 0.0)?;
    print(&all, args.json);
    if let Some(gap_s) = args.min_gap {
        print(&row(format!("{name}, over {gap_s} s apart"), gap_s)?, args.json);
    }
    Ok(all.live.errors.n_missing.max(all.relaxed.errors.n_missing))
}

/// Measures a variant of a log and prints its line; the mean translational error of its relaxed map.
async fn of_variant(
    name: &str,
    log: &Path,
    (variant, truth): (&LogVariant, &[Relation]),
    args: &AccuracyArgs,
) -> anyhow::Result<f64> {
    let written = variant.written(log, &args.data)?;
    let found = measurement(written.path(), &variant.replay_options(), &args.data).await?;
    let live = accuracy(&found.live, truth, (0.0, args.seed))?;
    let relaxed = accuracy(&found.relaxed, truth, (0.0, args.seed))?;
    let translation_m = relaxed.errors.translation_m;
    let name = format!("{name}, {}", variant.name());
    print(&Row { name, measurement: &found, live, relaxed }, args.json);
    Ok(translation_m)
}

/// Errors over relations whose ends lie so many seconds apart, with 95 % intervals.
fn accuracy(
    poses: &BTreeMap<i64, Pose>,
    truth: &[Relation],
    (gap_s, seed): (f64, u64),
) -> anyhow::Result<Accuracy> {
    #[expect(clippy::cast_possible_truncation, reason = "seconds of a log; others saturate")]
    let gap_ns = (gap_s * SECOND_NS) as i64;
    let far: Vec<&Relation> = truth.iter().filter(|one| gap_ns <= one.gap_ns()).collect();
    let off = relations::residuals(poses, &far);
    let errors = relations::errors(&off, far.len()).context("no relation has both poses")?;
    let metres: Vec<f64> = off.iter().map(|(metres, _)| *metres).collect();
    let radians: Vec<f64> = off.iter().map(|(_, radians)| *radians).collect();
    let (translation_m, rotation_rad) = (interval(&metres, seed), interval(&radians, seed));
    Ok(Accuracy { errors, translation_m, rotation_rad })
}

fn print(row: &Row<'_>, json: bool) {
    let Row { name, measurement, live, relaxed } = row;
    let Measurement { n_scans, replay, relax, peak_memory_mb, closures, .. } = measurement;
    if json {
        let cost = |cost: &Cost| serde_json::json!({"wall_s": cost.wall_s, "cpu_s": cost.cpu_s});
        let told = serde_json::json!({
            "log": name, "scans": n_scans, "replay": cost(replay), "relax": cost(relax),
            "peak_memory_mb": peak_memory_mb, "closures_accepted": closures[0],
            "closures_refused": closures[1], "live": accuracy_json(live),
            "relaxed": accuracy_json(relaxed), "missing": relaxed.errors.n_missing,
            "relations": relaxed.errors.n,
        });
        println!("{told}");
        return;
    }
    let memory = peak_memory_mb.map_or("?".to_owned(), |mb| format!("{mb:.0} MB"));
    let cost = |cost: &Cost| {
        let cpu = cost.cpu_s.map_or("?".to_owned(), |cpu_s| format!("{cpu_s:.1} s"));
        format!("{:.1} s, {cpu}", cost.wall_s)
    };
    println!(
        "| {name} | {n_scans} | {} | {} | {memory} | {} of {} | {} | {} | {} of {} |",
        cost(replay),
        cost(relax),
        closures[0],
        closures[0] + closures[1],
        text(live),
        text(relaxed),
        relaxed.errors.n_missing,
        relaxed.errors.n + relaxed.errors.n_missing
    );
}

fn text(accuracy: &Accuracy) -> String {
    let Accuracy { errors, translation_m: [low_m, high_m], rotation_rad: _ } = accuracy;
    let rotation_deg = errors.rotation_rad.to_degrees();
    format!("{:.4} m [{low_m:.4}, {high_m:.4}], {rotation_deg:.3}°", errors.translation_m)
}

fn accuracy_json(accuracy: &Accuracy) -> serde_json::Value {
    let Accuracy { errors, translation_m, rotation_rad } = accuracy;
    serde_json::json!({
        "translation_m": errors.translation_m,
        "translation_95_m": translation_m,
        "rotation_deg": errors.rotation_rad.to_degrees(),
        "rotation_95_deg": rotation_rad.map(f64::to_degrees),
    })
}
