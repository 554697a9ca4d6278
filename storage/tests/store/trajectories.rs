//! Trajectories: growing, pages, versions that stay as they are.

use meetpoint_storage::{
    Error, MapLease, NewPoses, NewSnapshot, PoseRecord, SessionId, Store, TrajectoryOrigin,
    TrajectoryPage,
};

use crate::fixture::Fixture;
use crate::versions::{lease, snapshot};

/// A pose told apart by its index and by the attempt that estimated it.
fn pose(index: u64, attempt: u32) -> PoseRecord {
    PoseRecord {
        stamp_ns: i64::try_from(index).expect("a small number"),
        sensor: index.is_multiple_of(2).then_some(3),
        lost: index.is_multiple_of(3),
        drawn: index % 3 == 1,
        x_m: index as f64 * 0.1,
        y_m: -0.0,
        theta_rad: f64::from(attempt),
    }
}

fn stretch(range: std::ops::Range<u64>, attempt: u32) -> Vec<PoseRecord> {
    range.map(|index| pose(index, attempt)).collect()
}

/// A map with one session, and snapshots of its trajectory.
struct Track {
    fixture: Fixture,
    session: SessionId,
    lease: MapLease,
}

impl Track {
    async fn new() -> Self {
        let fixture = Fixture::new().await;
        let session = fixture.open("ann", "monday").await.id;
        let lease = lease(&fixture.store).await;
        Self { fixture, session, lease }
    }

    fn store(&self) -> &Store {
        &self.fixture.store
    }

    async fn save(
        &self,
        origin: TrajectoryOrigin,
        first_index: u64,
        poses: Vec<PoseRecord>,
    ) -> Result<u64, Error> {
        let poses = vec![NewPoses { session: self.session, origin, first_index, poses }];
        let new = NewSnapshot { poses, ..snapshot(&self.lease) };
        self.store().save_snapshot(&new).await.map(|version| version.number)
    }

    async fn at(&self, version: u64) -> Option<TrajectoryPage> {
        let page = self.store().trajectory(self.session, version, 0, u32::MAX).await;
        page.expect("reading works")
    }

    async fn poses_at(&self, version: u64) -> Vec<PoseRecord> {
        self.at(version).await.map(|page| page.poses).unwrap_or_default()
    }
}

const TRACKING: TrajectoryOrigin = TrajectoryOrigin::Tracking;

#[tokio::test]
async fn a_trajectory_grows_and_older_versions_see_its_beginning() {
    let track = Track::new().await;
    assert_eq!(track.at(1).await, None, "nothing is known yet");
    track.save(TRACKING, 0, stretch(0..5, 0)).await.expect("it begins");
    track.store().save_snapshot(&snapshot(&track.lease)).await.expect("nothing changed");
    track.save(TRACKING, 5, stretch(5..9, 0)).await.expect("it goes on");
    assert_eq!(track.poses_at(1).await, stretch(0..5, 0), "the beginning");
    assert_eq!(track.poses_at(2).await, stretch(0..5, 0), "as in the version before");
    assert_eq!(track.poses_at(3).await, stretch(0..9, 0), "all, to the bit");
    assert_eq!(track.poses_at(u64::MAX).await, stretch(0..9, 0), "nothing newer");
    let negative_zero = track.poses_at(3).await[0].y_m;
    assert!(negative_zero.is_sign_negative(), "every bit of a float is kept");
}

#[tokio::test]
async fn pages_cut_across_chunks() {
    let track = Track::new().await;
    track.save(TRACKING, 0, stretch(0..5000, 0)).await.expect("it begins");
    track.save(TRACKING, 5000, stretch(5000..5010, 0)).await.expect("it goes on");
    for (offset, limit, expected) in
        [(0, 3, 0..3), (4090, 10, 4090..4100), (4998, 100, 4998..5010), (5010, 5, 0..0)]
    {
        let page = track.store().trajectory(track.session, 2, offset, limit).await;
        let page = page.expect("reading works").expect("there is a trajectory");
        assert_eq!(page.n_poses, 5010, "the whole has as many");
        assert_eq!(page.poses, stretch(expected, 0), "{limit} from {offset}");
    }
}

#[tokio::test]
async fn the_same_poses_again_change_nothing() {
    let track = Track::new().await;
    track.save(TRACKING, 0, stretch(0..5, 0)).await.expect("it begins");
    track.save(TRACKING, 3, stretch(3..8, 0)).await.expect("two again, three new");
    assert_eq!(track.poses_at(2).await, stretch(0..8, 0), "each pose once");
    track.save(TRACKING, 0, stretch(0..4, 0)).await.expect("four again, and the end");
    assert_eq!(track.poses_at(3).await, stretch(0..4, 0), "the trajectory ends there");
    track.save(TRACKING, 4, stretch(4..10, 0)).await.expect("it goes on");
    assert_eq!(track.poses_at(4).await, stretch(0..10, 0), "each pose once");
    assert_eq!(track.poses_at(1).await, stretch(0..5, 0), "version 1 is as it was");
}

#[tokio::test]
async fn other_poses_do_not_change_older_versions() {
    let track = Track::new().await;
    track.save(TRACKING, 0, stretch(0..5, 0)).await.expect("it begins");
    track.save(TRACKING, 3, stretch(3..6, 1)).await.expect("a second thought");
    assert_eq!(track.poses_at(1).await, stretch(0..5, 0), "version 1 is as it was");
    let revised = [stretch(0..3, 0), stretch(3..6, 1)].concat();
    assert_eq!(track.poses_at(2).await, revised, "the old beginning, the new end");
    track.save(TrajectoryOrigin::Relaxation, 0, stretch(0..6, 2)).await.expect("all anew");
    let relaxed = track.at(3).await.expect("there is a trajectory");
    assert_eq!(relaxed.origin, TrajectoryOrigin::Relaxation, "its origin is told");
    assert_eq!(relaxed.poses, stretch(0..6, 2), "nothing of the old");
    track.save(TRACKING, 6, stretch(6..7, 0)).await.expect("it goes on behind the relaxed past");
    let continued = [stretch(0..6, 2), stretch(6..7, 0)].concat();
    assert_eq!(track.poses_at(4).await, continued, "the relaxed past and what followed");
    assert_eq!(track.poses_at(2).await, revised, "version 2 is as it was");
}

#[tokio::test]
async fn a_trajectory_has_no_holes() {
    let track = Track::new().await;
    let gap = track.save(TRACKING, 1, stretch(1..2, 0)).await;
    assert!(matches!(gap, Err(Error::TrajectoryGap { n_poses: 0, first_index: 1, .. })), "no 0");
    track.save(TRACKING, 0, stretch(0..2, 0)).await.expect("it begins");
    for origin in [TRACKING, TrajectoryOrigin::Relaxation] {
        let gap = track.save(origin, 3, stretch(3..4, 0)).await;
        let is_gap = matches!(gap, Err(Error::TrajectoryGap { n_poses: 2, first_index: 3, .. }));
        assert!(is_gap, "{origin:?} without pose 2");
    }
    let versions = track.store().versions(&crate::fixture::hall(), None, 9).await;
    assert_eq!(versions.expect("reading works").len(), 1, "a refused snapshot leaves no version");
}
