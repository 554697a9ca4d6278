//! One log through the whole service: replayed, relaxed, and both trajectories.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::Context;
use meetpoint_client::Client;
use meetpoint_geometry::Pose;
use meetpoint_proto::v1;

use super::child::{ChildService, cpu_s_of_children};
use super::poses::poses;
use super::replaying::{replayed, session_of, told};

/// The map of each measurement.
const MAP: &str = "bench";
/// How often the job is asked for.
const POLL: Duration = Duration::from_millis(50);

/// What something took.
pub(super) struct Cost {
    pub(super) wall_s: f64,
    /// Of the service, and of the command that asked it; where the system tells.
    pub(super) cpu_s: Option<f64>,
}

/// What became of a log.
pub(super) struct Measurement {
    pub(super) n_scans: u64,
    /// From the first byte sent to the published map.
    pub(super) replay: Cost,
    /// From the wish to the published map.
    pub(super) relax: Cost,
    pub(super) peak_memory_mb: Option<f64>,
    /// Accepted and refused.
    pub(super) closures: [u32; 2],
    /// Poses by stamp.
    pub(super) live: BTreeMap<i64, Pose>,
    pub(super) relaxed: BTreeMap<i64, Pose>,
}

/// Replays a log and relaxes it, on an empty database below `data`.
pub(super) async fn measurement(
    log: &Path,
    options: &[String],
    data: &Path,
) -> anyhow::Result<Measurement> {
    let service = ChildService::start(data, "accuracy")?;
    let spent = || Some(service.cpu_s()? + cpu_s_of_children()?);
    let since = |before: Option<f64>| Some(spent()? - before?);
    let before = spent();
    let options: Vec<&str> = options.iter().map(String::as_str).collect();
    let replayed = replayed(log, MAP, &options, &service.url)?;
    let took_s = told(&replayed, "took_s")?.as_f64().context("replay took some time")?;
    let replay = Cost { wall_s: took_s, cpu_s: since(before) };
    let session = session_of(&replayed)?;
    let client = Client::connect(&service.url)?;
    let live = poses(&client, session).await?;
    let (before, begun) = (spent(), Instant::now());
    let job = relaxed(&client).await?;
    let relax = Cost { wall_s: begun.elapsed().as_secs_f64(), cpu_s: since(before) };
    let scans = match &job.result {
        Some(v1::job::Result::RelaxResult(result)) => {
            result.sessions.first().and_then(|session| session.scans)
        }
        Some(v1::job::Result::MergeResult(_)) | None => None,
    };
    let scans = scans.context("the log has no scans to be relaxed by")?;
    Ok(Measurement {
        n_scans: told(&replayed, "scans")?.as_u64().unwrap_or(0),
        replay,
        relax,
        peak_memory_mb: service.peak_memory_mb(),
        closures: [scans.closures_accepted, scans.closures_refused],
        live,
        relaxed: poses(&client, session).await?,
    })
}

async fn relaxed(client: &Client) -> anyhow::Result<v1::Job> {
    let (map, kind) = (MAP.to_owned(), v1::JobKind::Relax.into());
    let request = v1::CreateJobRequest { map, kind, ..v1::CreateJobRequest::default() };
    let mut job = client.create_job(request).await?;
    while !job.done {
        tokio::time::sleep(POLL).await;
        job = client.job(&job.id).await?;
    }
    if let Some(v1::JobError { code, message }) = &job.error {
        anyhow::bail!("the relaxation failed: {message} ({code})");
    }
    Ok(job)
}
