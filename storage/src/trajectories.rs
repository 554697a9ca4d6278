//! Trajectories: where robots were, as each map version knew it.
//!
//! A trajectory only grows, so that a version needs no more than its id and a number of poses.
//! Poses that differ from what is stored begin another trajectory: older versions stay as they are.

use sqlx::{SqliteConnection, SqliteExecutor};

use crate::number::to_sql;
use crate::pose_chunk;
use crate::{Error, MapId, PoseRecord, SessionId, Store};

/// What a trajectory was computed from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, sqlx::Type)]
#[repr(i64)]
pub enum TrajectoryOrigin {
    /// Dead reckoning alone.
    Odometry = 1,
    /// Odometry and matching, scan by scan.
    Tracking = 2,
    /// The past repaired by a job.
    Relaxation = 3,
}

/// Poses that a snapshot adds to a session's trajectory, or puts in place of its end.
#[derive(Clone, Debug)]
pub struct NewPoses {
    /// The session.
    pub session: SessionId,
    /// What they were computed from. Another origin than before begins another trajectory, which
    /// shares the poses before `first_index`.
    pub origin: TrajectoryOrigin,
    /// Index of the first pose; at most the number of poses there are.
    pub first_index: u64,
    /// The poses. After them the trajectory ends.
    pub poses: Vec<PoseRecord>,
}

/// A part of a version's trajectory.
#[derive(Clone, Debug, PartialEq)]
pub struct TrajectoryPage {
    /// What it was computed from.
    pub origin: TrajectoryOrigin,
    /// Poses in the whole trajectory.
    pub n_poses: u64,
    /// The poses asked for.
    pub poses: Vec<PoseRecord>,
}

/// Poses in a chunk at most: 140 kB, so that a page of a long trajectory reads little in vain.
const CHUNK_POSES_MAX: usize = 4096;

/// Which trajectory a version has of a session.
#[derive(Clone, Copy, sqlx::FromRow)]
struct Extent {
    trajectory_id: i64,
    origin: TrajectoryOrigin,
    #[sqlx(try_from = "i64")]
    n_poses: u64,
}

impl Store {
    /// At most `limit` poses from index `offset` on of a session's trajectory, as map version
    /// `version` has it. `None` if the version has no trajectory of the session.
    ///
    /// # Errors
    /// [`Error::Damaged`] if poses cannot be read.
    pub async fn trajectory(
        &self,
        session: SessionId,
        version: u64,
        offset: u64,
        limit: u32,
    ) -> Result<Option<TrajectoryPage>, Error> {
        let Some(extent) = find(self.readers(), session, version).await? else { return Ok(None) };
        let Extent { trajectory_id, origin, n_poses } = extent;
        let end = offset.saturating_add(u64::from(limit)).min(n_poses);
        let poses = read(self.readers(), trajectory_id, offset, end).await?;
        Ok(Some(TrajectoryPage { origin, n_poses, poses }))
    }
}

/// Stores poses inside a transaction and says from which version on they count.
pub(crate) async fn save_poses(
    connection: &mut SqliteConnection,
    map: &MapId,
    version: u64,
    new: &NewPoses,
) -> Result<(), Error> {
    let current = find(&mut *connection, new.session, version).await?;
    let trajectory_id = match current {
        Some(extent) if extent.origin == new.origin => {
            if extend(&mut *connection, extent, new).await? {
                extent.trajectory_id
            } else {
                fork(&mut *connection, current, new).await?
            }
        }
        _ => fork(&mut *connection, current, new).await?,
    };
    sqlx::query(
        "insert into version_trajectories (session_id, number, map_id, trajectory_id, n_poses)
         values ($1, $2, $3, $4, $5)",
    )
    .bind(new.session)
    .bind(to_sql(version))
    .bind(map)
    .bind(trajectory_id)
    .bind(to_sql(new.first_index + new.poses.len() as u64))
    .execute(connection)
    .await?;
    Ok(())
}

/// Puts the poses at the trajectory's end, as far as they are not there. False, and nothing is
/// written, if other ones are there.
async fn extend(
    connection: &mut SqliteConnection,
    extent: Extent,
    new: &NewPoses,
) -> Result<bool, Error> {
    let id = extent.trajectory_id;
    let n_stored = stored_poses(&mut *connection, id).await?;
    require_no_gap(new, n_stored)?;
    let end = new.first_index + new.poses.len() as u64;
    let known = read(&mut *connection, id, new.first_index, n_stored.min(end)).await?;
    let (again, fresh) = new.poses.split_at(known.len());
    if again != known {
        return Ok(false);
    }
    insert_chunks(connection, id, n_stored, fresh).await?;
    Ok(true)
}

/// Begins a trajectory with the poses before the new ones, and the new ones.
async fn fork(
    connection: &mut SqliteConnection,
    current: Option<Extent>,
    new: &NewPoses,
) -> Result<i64, Error> {
    require_no_gap(new, current.map_or(0, |extent| extent.n_poses))?;
    let mut poses = match current {
        Some(extent) => read(&mut *connection, extent.trajectory_id, 0, new.first_index).await?,
        None => Vec::new(),
    };
    poses.extend_from_slice(&new.poses);
    let id = sqlx::query_scalar(
        "insert into trajectories (session_id, origin) values ($1, $2) returning id",
    )
    .bind(new.session)
    .bind(new.origin)
    .fetch_one(&mut *connection)
    .await?;
    insert_chunks(connection, id, 0, &poses).await?;
    Ok(id)
}

fn require_no_gap(new: &NewPoses, n_poses: u64) -> Result<(), Error> {
    if n_poses < new.first_index {
        let (session, first_index) = (new.session, new.first_index);
        return Err(Error::TrajectoryGap { session, n_poses, first_index });
    }
    Ok(())
}

async fn insert_chunks(
    connection: &mut SqliteConnection,
    trajectory_id: i64,
    first_index: u64,
    poses: &[PoseRecord],
) -> Result<(), Error> {
    let mut first_index = first_index;
    for chunk in poses.chunks(CHUNK_POSES_MAX) {
        let n_poses = chunk.len() as u64;
        sqlx::query(
            "insert into trajectory_chunks (trajectory_id, first_index, n_poses, poses)
             values ($1, $2, $3, $4)",
        )
        .bind(trajectory_id)
        .bind(to_sql(first_index))
        .bind(to_sql(n_poses))
        .bind(pose_chunk::encode(chunk))
        .execute(&mut *connection)
        .await?;
        first_index += n_poses;
    }
    Ok(())
}

async fn stored_poses(connection: &mut SqliteConnection, id: i64) -> Result<u64, Error> {
    let n_poses: i64 = sqlx::query_scalar(
        "select coalesce(max(first_index + n_poses), 0) from trajectory_chunks
         where trajectory_id = $1",
    )
    .bind(id)
    .fetch_one(connection)
    .await?;
    Ok(n_poses.unsigned_abs())
}

/// The session's trajectory in the newest version that is not above `version`.
async fn find(
    executor: impl SqliteExecutor<'_>,
    session: SessionId,
    version: u64,
) -> Result<Option<Extent>, Error> {
    let extent = sqlx::query_as(
        "select trajectory_id, origin, n_poses
         from version_trajectories join trajectories on trajectories.id = trajectory_id
         where version_trajectories.session_id = $1 and number <= $2
         order by number desc limit 1",
    )
    .bind(session)
    .bind(to_sql(version))
    .fetch_optional(executor)
    .await?;
    Ok(extent)
}

#[derive(sqlx::FromRow)]
struct ChunkRow {
    #[sqlx(try_from = "i64")]
    first_index: u64,
    poses: Vec<u8>,
}

/// The poses of a trajectory from `start` to before `end`.
async fn read(
    executor: impl SqliteExecutor<'_>,
    trajectory_id: i64,
    start: u64,
    end: u64,
) -> Result<Vec<PoseRecord>, Error> {
    let rows: Vec<ChunkRow> = sqlx::query_as(
        "select first_index, poses from trajectory_chunks
         where trajectory_id = $1 and $2 < first_index + n_poses and first_index < $3
         order by first_index",
    )
    .bind(trajectory_id)
    .bind(to_sql(start))
    .bind(to_sql(end))
    .fetch_all(executor)
    .await?;
    let mut poses = Vec::new();
    for row in rows {
        let indexed = (row.first_index..).zip(pose_chunk::decode(&row.poses)?);
        poses.extend(
            indexed.filter(|(index, _)| (start..end).contains(index)).map(|(_, pose)| pose),
        );
    }
    Ok(poses)
}
