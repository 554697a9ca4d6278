//! Looks again, unasked, where sessions of unknown start lie: when they, or the map, have grown.

use meetpoint_proto::v1;
use meetpoint_storage::{
    JobId, JobState, MapId, MergeState, NewJob, SessionFilter, SessionRecord, SessionState,
    VersionRecord,
};
use prost::Message;
use tokio::sync::broadcast::error::RecvError;
use uuid::Uuid;

use crate::convert::job::MERGE;
use crate::convert::merge;
use crate::live::Event;
use crate::settings::MergingSettings;
use crate::{clock, error::Error, service::Service};

/// Behind what people ask for.
const PRIORITY: i32 = -50;
/// Sessions of a map read at a time.
const N_SESSIONS_READ: u32 = 100;
/// Jobs of a map looked through for one that waits: more do not wait as a rule.
const N_JOBS_READ: u32 = 20;
/// Poses read at a time.
const N_POSES_READ: u32 = 100_000;

/// Starts merge jobs when there is reason, until the service stops.
pub(crate) async fn keep_asking(service: Service) {
    if !service.settings.merging.looks_again {
        return;
    }
    let mut events = service.live.watch();
    loop {
        let event = tokio::select! {
            event = events.recv() => event,
            () = service.stop.cancelled() => return,
        };
        let map = match event {
            Ok((map, Event::Version(_))) => map,
            // What was missed comes again with the next version.
            Ok(_) | Err(RecvError::Lagged(_)) => continue,
            Err(RecvError::Closed) => return,
        };
        if let Err(error) = ask(&service, &map).await {
            error.log();
            tracing::debug!(map = map.as_str(), %error, "not looked at");
        }
    }
}

/// Starts a merge job if a session of the map has grown enough and none waits.
async fn ask(service: &Service, map: &MapId) -> Result<(), Error> {
    let Some(newest) = service.store.versions(map, None, 1).await?.into_iter().next() else {
        return Ok(());
    };
    if !has_grown(service, map, &newest).await? || waits(service, map).await? {
        return Ok(());
    }
    let params = v1::MergeParams::default().encode_to_vec();
    let new = NewJob {
        id: JobId(Uuid::now_v7()),
        map: map.clone(),
        kind: MERGE.to_owned(),
        params,
        priority: PRIORITY,
        time_ns: clock::now_ns(),
    };
    let record = service.store.create_job(&new).await?;
    service.live.announce(map.clone(), Event::Job(record.id));
    Ok(())
}

/// True if a merge job of the map waits or runs.
async fn waits(service: &Service, map: &MapId) -> Result<bool, Error> {
    let jobs = service.store.jobs(Some(map), None, N_JOBS_READ).await?;
    Ok(jobs
        .iter()
        .any(|job| job.kind == MERGE && matches!(job.state, JobState::Queued | JobState::Running)))
}

/// True if there is reason to look again where any session of the map lies.
async fn has_grown(service: &Service, map: &MapId, newest: &VersionRecord) -> Result<bool, Error> {
    let filter = SessionFilter { map: Some(map.clone()), robot: None };
    let mut after = None;
    loop {
        let page = service.store.sessions(&filter, after, N_SESSIONS_READ).await?;
        let Some(last) = page.last() else { return Ok(false) };
        after = Some(last.id);
        for record in page.iter().filter(|record| record.frame == Some(record.id)) {
            if session_has_grown(service, record, newest).await? {
                return Ok(true);
            }
        }
    }
}

async fn session_has_grown(
    service: &Service,
    record: &SessionRecord,
    newest: &VersionRecord,
) -> Result<bool, Error> {
    let MergingSettings { way_first_m, way_again_m, again_share, n_scans_again, .. } =
        service.settings.merging;
    // Landmarks have to be relaxed before they are laid on others, which takes too long to be done again and
    // again: once, when the session has ended.
    if record.n_scans == 0 && record.state == SessionState::Open {
        return Ok(false);
    }
    let merge = service.store.merge(merge::id_of(record.id)).await?;
    let driven_m = async |n_poses| driven_m(service, record, newest.number, n_poses).await;
    let Some(merge) = merge else { return Ok(way_first_m <= driven_m(0).await?) };
    if merge.state != MergeState::Open {
        return Ok(false);
    }
    let n_since = newest.n_scans.saturating_sub(merge.n_scans_drawn);
    if n_scans_again <= n_since && again_share * merge.n_scans_drawn as f64 <= n_since as f64 {
        return Ok(true);
    }
    let since_m = driven_m(merge.n_poses).await?;
    if since_m < way_again_m {
        return Ok(false);
    }
    let before_m = driven_m(0).await? - since_m;
    Ok(again_share * before_m <= since_m)
}

/// How far a session has driven since it had so many poses, in metres.
async fn driven_m(
    service: &Service,
    record: &SessionRecord,
    version: u64,
    n_poses: u64,
) -> Result<f64, Error> {
    let (mut driven_m, mut offset, mut before) = (0.0, n_poses, None);
    loop {
        let page = service.store.trajectory(record.id, version, offset, N_POSES_READ).await?;
        let poses = page.map(|page| page.poses).unwrap_or_default();
        if poses.is_empty() {
            return Ok(driven_m);
        }
        offset += poses.len() as u64;
        for pose in poses {
            let at = (pose.x_m, pose.y_m);
            let (x_m, y_m) = before.replace(at).unwrap_or(at);
            driven_m += (pose.x_m - x_m).hypot(pose.y_m - y_m);
        }
    }
}
