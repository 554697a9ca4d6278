//! What a service makes of a session of unknown start, once all its jobs are done.

use std::time::Duration;

use anyhow::Context;
use meetpoint_client::{Client, v1};

/// Between two looks at whether jobs are done.
const LOOK_INTERVAL: Duration = Duration::from_millis(50);

/// Asks where the unplaced sessions of a map lie, and waits until that and all jobs that follow from it
/// are done.
pub(super) async fn settle(client: &Client, map: &str) -> anyhow::Result<()> {
    wait(client, map).await?;
    let kind = v1::JobKind::Merge.into();
    let map_id = map.to_owned();
    let request = v1::CreateJobRequest { map: map_id, kind, ..v1::CreateJobRequest::default() };
    client.create_job(request).await?;
    wait(client, map).await
}

/// Waits until no job of a map is left; an error if one failed.
pub(super) async fn wait(client: &Client, map: &str) -> anyhow::Result<()> {
    loop {
        let jobs = client.map_jobs(map).await?;
        for job in &jobs {
            if let Some(v1::JobError { code, message }) = &job.error {
                // Two asked for the same, or nothing was left to be asked.
                anyhow::ensure!(code == "NOTHING_TO_MERGE", "job {}: {message} ({code})", job.id);
            }
        }
        if jobs.iter().all(|job| job.done) {
            return Ok(());
        }
        tokio::time::sleep(LOOK_INTERVAL).await;
    }
}

/// The merge of a session.
pub(super) async fn merge_of(
    client: &Client,
    map: &str,
    session: &str,
) -> anyhow::Result<v1::Merge> {
    let merges = client.merges(map, session).await?;
    merges.into_iter().next().context("no merge job looked at the session")
}

/// A verdict in words.
pub(super) fn verdict(merge: &v1::Merge) -> &'static str {
    match merge.verdict() {
        v1::MergeVerdict::Unspecified => "none",
        v1::MergeVerdict::Merged => "merged",
        v1::MergeVerdict::Proposed => "proposed",
        v1::MergeVerdict::Ambiguous => "ambiguous",
        v1::MergeVerdict::NoOverlap => "no overlap",
        v1::MergeVerdict::NotEnoughSeen => "not enough seen",
    }
}

/// Whether the session was put somewhere.
pub(super) fn is_accepted(merge: &v1::Merge) -> bool {
    merge.state() == v1::MergeState::Accepted
}
