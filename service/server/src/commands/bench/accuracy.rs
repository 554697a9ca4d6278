//! `meetpoint bench accuracy`: logs through the whole service, against relations.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::Context;
use meetpoint_client::Client;
use meetpoint_geometry::Pose;
use meetpoint_proto::v1;

use super::child::ChildService;
use super::relations::{self, Errors};

/// The map of each measurement.
const MAP: &str = "bench";

/// Options of `meetpoint bench accuracy`.
#[derive(Debug, clap::Args)]
pub(super) struct AccuracyArgs {
    /// Logs, each followed by its relations
    #[arg(required = true, num_args = 2.., value_names = ["LOG", "RELATIONS"])]
    files: Vec<PathBuf>,
    /// Folder for the databases, on the disk that is to be measured
    #[arg(long, value_name = "FOLDER", default_value = ".")]
    data: PathBuf,
    /// Also write what was measured as JSON lines
    #[arg(long)]
    json: bool,
}

struct Row {
    log: String,
    scans: u64,
    took_s: f64,
    times_real_time: f64,
    peak_memory_mb: Option<f64>,
    errors: Errors,
}

/// Measures every log, one after the other, each on an empty database.
pub(super) async fn run(args: AccuracyArgs) -> anyhow::Result<()> {
    anyhow::ensure!(args.files.len().is_multiple_of(2), "each log needs its relations behind it");
    if !args.json {
        println!(
            "| log | scans | wall | times real time | peak memory | translation | rotation | relations missing |"
        );
        println!("|---|---|---|---|---|---|---|---|");
    }
    let mut n_missing = 0;
    for pair in args.files.chunks_exact(2) {
        let row = measure(&pair[0], &pair[1], &args.data).await?;
        n_missing += row.errors.n_missing;
        print(&row, args.json);
    }
    anyhow::ensure!(n_missing == 0, "{n_missing} relations have no pose");
    Ok(())
}

async fn measure(log: &Path, truth: &Path, data: &Path) -> anyhow::Result<Row> {
    let text = std::fs::read_to_string(truth)
        .with_context(|| format!("cannot read {}", truth.display()))?;
    let truth = relations::read(&text).with_context(|| format!("in {}", truth.display()))?;
    let service = ChildService::start(data, "accuracy")?;
    let replayed = replay(log, &service.url)?;
    let peak_memory_mb = service.peak_memory_mb();
    let field = |name: &str| replayed.get(name).with_context(|| format!("replay told no {name}"));
    let session = field("session")?.as_str().context("a session id is text")?;
    let trajectory = Client::connect(&service.url)?.trajectory(session, 0, "robot").await?;
    let poses = trajectory.poses.iter().filter_map(stamped).collect();
    let errors = relations::errors(&poses, &truth).context("no relation has both poses")?;
    Ok(Row {
        log: log.file_name().unwrap_or_default().to_string_lossy().into_owned(),
        scans: field("scans")?.as_u64().unwrap_or(0),
        took_s: field("took_s")?.as_f64().unwrap_or(f64::NAN),
        times_real_time: field("times_real_time")?.as_f64().unwrap_or(f64::NAN),
        peak_memory_mb,
        errors,
    })
}

/// Replays with this very binary, in a process of its own, as a user would.
fn replay(log: &Path, url: &str) -> anyhow::Result<serde_json::Value> {
    let binary = std::env::current_exe().context("cannot find this binary")?;
    let output = Command::new(binary)
        .arg("replay")
        .arg(log)
        .args(["--map", MAP, "--json", "--server", url])
        .stderr(Stdio::inherit())
        .output()
        .context("cannot start the replay")?;
    anyhow::ensure!(output.status.success(), "the replay of {} failed", log.display());
    serde_json::from_slice(&output.stdout).context("the replay printed no JSON")
}

fn stamped(pose: &v1::TrajectoryPose) -> Option<(i64, Pose)> {
    let v1::Pose { x_m, y_m, theta_rad } = pose.pose?;
    Some((pose.stamp_ns, Pose::new(x_m, y_m, theta_rad)))
}

fn print(row: &Row, json: bool) {
    let Row { log, scans, took_s, times_real_time, peak_memory_mb, errors } = row;
    let Errors { n, n_missing, translation_m, rotation_rad } = errors;
    let rotation_deg = rotation_rad.to_degrees();
    if json {
        let told = serde_json::json!({
            "log": log, "scans": scans, "took_s": took_s, "times_real_time": times_real_time,
            "peak_memory_mb": peak_memory_mb, "relations": n, "missing": n_missing,
            "translation_m": translation_m, "rotation_deg": rotation_deg,
        });
        println!("{told}");
        return;
    }
    let memory = peak_memory_mb.map_or("?".to_owned(), |mb| format!("{mb:.0} MB"));
    println!(
        "| {log} | {scans} | {took_s:.1} s | {times_real_time:.0} | {memory} | {translation_m:.4} m | {rotation_deg:.3}° | {n_missing} of {} |",
        n + n_missing
    );
}
