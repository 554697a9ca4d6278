//! `meetpoint merge`: starts the job, shows its progress, waits.

use meetpoint_proto::v1;
use v1::create_job_request::Params;

use super::asked::ServerArgs;
use super::watched_job::{ended, has_succeeded, tell_started};

/// Options of `meetpoint merge`.
#[derive(Debug, clap::Args)]
pub struct MergeArgs {
    /// The map
    #[arg(long, value_name = "MAP")]
    map: String,
    /// Look only where this session of unknown start lies; may be given more than once
    #[arg(long = "session", value_name = "ID")]
    sessions: Vec<String>,
    /// Where the map is empty: take the frame of the oldest session as the map's
    #[arg(long)]
    found_map: bool,
    /// Look for nothing, but draw the map by what was decided
    #[arg(long)]
    draw_only: bool,
    /// Higher goes before other jobs: -100 to 100
    #[arg(long, default_value_t = 0, allow_negative_numbers = true)]
    priority: i32,
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
pub async fn run(args: MergeArgs) -> anyhow::Result<()> {
    let client = args.server.client()?;
    let MergeArgs { map, sessions, found_map, draw_only, priority, detach, server } = args;
    let params = Params::Merge(v1::MergeParams { sessions, draw_only, found_map });
    let kind = v1::JobKind::Merge.into();
    let request = v1::CreateJobRequest { map, kind, priority, params: Some(params) };
    let job = client.create_job(request).await?;
    if detach {
        tell_started(&job, server.json);
        return Ok(());
    }
    let job = ended(&client, job, "merge", server.json).await?;
    has_succeeded(&job)?;
    let told = match &job.result {
        Some(v1::job::Result::MergeResult(result)) => result.sessions.as_slice(),
        _ => &[],
    };
    if server.json {
        println!("{}", json(&job, told));
        return Ok(());
    }
    for line in job.log.iter().filter(|line| line.text.contains(", session ")) {
        println!("{}", line.text);
    }
    if job.result_version > 0 {
        println!("map {} is version {} now", job.map, job.result_version);
    }
    if told.iter().any(|session| !session.accepted) {
        println!("to look at it: meetpoint merges list --map {}", job.map);
    }
    Ok(())
}

fn json(job: &v1::Job, told: &[v1::MergedSession]) -> serde_json::Value {
    let session = |session: &v1::MergedSession| {
        serde_json::json!({
            "session": session.session,
            "merge": session.merge,
            "verdict": session.verdict().as_str_name().trim_start_matches("MERGE_VERDICT_"),
            "accepted": session.accepted,
        })
    };
    serde_json::json!({
        "job": job.id,
        "map": job.map,
        "map_version": job.result_version,
        "sessions": told.iter().map(session).collect::<Vec<_>>(),
    })
}
