//! `meetpoint rebuild`: starts the job, shows its progress, waits.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};
use meetpoint_proto::v1;

use super::asked::ServerArgs;

/// How often the job is asked for.
const POLL: Duration = Duration::from_millis(300);
/// Steps of the progress bar.
const N_STEPS: f64 = 1000.0;

/// Options of `meetpoint rebuild`.
#[derive(Debug, clap::Args)]
pub struct RebuildArgs {
    /// The map
    map: String,
    /// Start the job and do not wait
    #[arg(long)]
    detach: bool,
    #[command(flatten)]
    server: ServerArgs,
}

/// Runs the job to its end.
///
/// # Errors
/// If it could not be started, failed, or was cancelled.
pub async fn run(args: RebuildArgs) -> anyhow::Result<()> {
    let client = args.server.client()?;
    let (map, kind) = (args.map, v1::JobKind::Rebuild.into());
    let request = v1::CreateJobRequest { map, kind, ..v1::CreateJobRequest::default() };
    let mut job = client.create_job(request).await?;
    if args.detach {
        println!("job {}", job.id);
        return Ok(());
    }
    let bar = if args.server.json { ProgressBar::hidden() } else { ProgressBar::new(1000) };
    bar.set_style(ProgressStyle::with_template("rebuild {bar:40} {percent} % {elapsed}")?);
    while !job.done {
        tokio::time::sleep(POLL).await;
        job = client.job(&job.id).await?;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 1000")]
        bar.set_position((job.progress * N_STEPS) as u64);
    }
    bar.finish_and_clear();
    if let Some(v1::JobError { code, message }) = job.error {
        anyhow::bail!("the job failed: {message} ({code})");
    }
    anyhow::ensure!(job.state == i32::from(v1::JobState::Succeeded), "the job was cancelled");
    if args.server.json {
        let (map, version) = (&job.map, job.result_version);
        println!("{}", serde_json::json!({ "job": job.id, "map": map, "map_version": version }));
    } else {
        println!("map {} is rebuilt as version {}", job.map, job.result_version);
    }
    Ok(())
}
