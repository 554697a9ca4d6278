//! Where live mapping had a robot: what a relaxation by scans begins with.
//!
//! As the newest version has it, if it was tracked there and is complete. Else, as of sessions of which one
//! was relaxed before, the map is drawn again without what is known of them; which gives the same poses,
//! since live mapping is a function of the journal.

use std::ops::Range;

use meetpoint_geometry::Pose;
use meetpoint_storage::{MapRecord, PoseRecord, SessionId, TrajectoryOrigin};

use super::super::drawing::drawn;
use super::super::running::{Running, Stopped};
use super::super::workbench::Workbench;
use crate::convert::relaxation::RelaxedSession;
use crate::mapping::Decisions;
use crate::service::Service;

/// Poses read at a time.
const N_POSES_READ: u32 = 100_000;

/// Where live mapping had the robot at an observation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LivePose {
    pub(super) stamp_ns: i64,
    pub(super) session_from_robot: Pose,
    /// Whether live mapping did not trust it.
    pub(super) is_lost: bool,
}

impl From<&PoseRecord> for LivePose {
    fn from(record: &PoseRecord) -> Self {
        let PoseRecord { stamp_ns, sensor: _, lost, drawn: _, x_m, y_m, theta_rad } = *record;
        Self { stamp_ns, session_from_robot: Pose { x_m, y_m, theta_rad }, is_lost: lost }
    }
}

/// Where a version has the robot of a session, as far as it tells.
#[derive(Debug, Default)]
pub(super) struct KnownPoses {
    pub(super) poses: Vec<LivePose>,
    /// So many of the first of them are what a relaxation found.
    pub(super) n_relaxed: usize,
}

/// The poses of some sessions by the newest version: relaxed as far as a relaxation has told, from there
/// on tracked; of each at most as many as wanted.
pub(super) async fn newest_poses(
    service: &Service,
    (map, wanted): (&MapRecord, &[(SessionId, usize)]),
) -> Result<Vec<KnownPoses>, Stopped> {
    let store = &service.store;
    let end = store.journal_end(&map.id).await?;
    let decisions = Decisions::load(store, &map.id, end).await?;
    let mut known = Vec::new();
    for &(session, n_moments) in wanted {
        let mut of_session = KnownPoses::default();
        while of_session.poses.len() < n_moments {
            let (version, offset) = (map.latest_version, of_session.poses.len() as u64);
            let page = store.trajectory(session, version, offset, N_POSES_READ).await?;
            let Some(page) = page.filter(|page| !page.poses.is_empty()) else { break };
            if page.origin == TrajectoryOrigin::Relaxation {
                of_session.n_relaxed = decisions.n_relaxed(session);
            }
            of_session.poses.extend(page.poses.iter().map(LivePose::from));
        }
        of_session.poses.truncate(n_moments);
        known.push(of_session);
    }
    Ok(known)
}

/// The poses of some sessions, of each at its first observations, as many as wanted, that have one, while
/// the job's progress goes through `shares`. `found` is what the job knows of sessions before.
pub(super) async fn live_poses(
    service: &Service,
    (map, wanted): (&MapRecord, &[(SessionId, usize)]),
    found: &[RelaxedSession],
    at_work: (&Running<'_>, &Workbench),
    shares: Range<f64>,
) -> Result<Vec<Vec<LivePose>>, Stopped> {
    if found.is_empty()
        && let Some(poses) = all_tracked(service, map, wanted).await?
    {
        return Ok(poses);
    }
    let store = &service.store;
    let end = store.journal_end(&map.id).await?;
    let decisions = Decisions::load(store, &map.id, end).await?;
    let decisions = wanted
        .iter()
        .fold(decisions.with(found), |decisions, (session, _)| decisions.without(*session));
    let drawn = drawn(service, (map, end), decisions, at_work, shares).await?;
    let of = |&(session, n_moments): &(SessionId, usize)| {
        drawn.poses(session).iter().take(n_moments).map(LivePose::from).collect()
    };
    Ok(wanted.iter().map(of).collect())
}

/// The poses that the newest version has, if those of all are those of live mapping and complete.
async fn all_tracked(
    service: &Service,
    map: &MapRecord,
    wanted: &[(SessionId, usize)],
) -> Result<Option<Vec<Vec<LivePose>>>, Stopped> {
    let mut poses = Vec::new();
    for &(session, n_moments) in wanted {
        let Some(of_session) = tracked(service, map, session, n_moments).await? else {
            return Ok(None);
        };
        poses.push(of_session);
    }
    Ok(Some(poses))
}

/// The poses that the newest version has, if they are those of live mapping and complete.
async fn tracked(
    service: &Service,
    map: &MapRecord,
    session: SessionId,
    n_moments: usize,
) -> Result<Option<Vec<LivePose>>, Stopped> {
    let mut poses = Vec::new();
    while poses.len() < n_moments {
        let (version, offset) = (map.latest_version, poses.len() as u64);
        let page = service.store.trajectory(session, version, offset, N_POSES_READ).await?;
        let Some(page) = page.filter(|page| page.origin == TrajectoryOrigin::Tracking) else {
            return Ok(None);
        };
        if page.poses.is_empty() {
            return Ok(None);
        }
        poses.extend(page.poses.iter().map(LivePose::from));
    }
    poses.truncate(n_moments);
    Ok(Some(poses))
}
