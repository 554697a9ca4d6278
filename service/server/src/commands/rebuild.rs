//! `meetpoint rebuild`: starts the job, shows its progress, waits.

use meetpoint_proto::v1;

use super::asked::ServerArgs;
use super::watched_job::{ended, has_succeeded, tell_started};

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
    let job = client.create_job(request).await?;
    if args.detach {
        tell_started(&job, args.server.json);
        return Ok(());
    }
    let job = ended(&client, job, "rebuild", args.server.json).await?;
    has_succeeded(&job)?;
    if args.server.json {
        let (map, version) = (&job.map, job.result_version);
        println!("{}", serde_json::json!({ "job": job.id, "map": map, "map_version": version }));
    } else {
        println!("map {} is rebuilt as version {}", job.map, job.result_version);
    }
    Ok(())
}
