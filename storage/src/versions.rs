//! Map versions: immutable, complete, and published by one pointer.

use sqlx::{SqliteConnection, SqliteExecutor};

use crate::journal::{Kind, NewEvent, record_event};
use crate::landmark_sets::insert_landmarks;
use crate::leases::require_lease;
use crate::maps::require_map;
use crate::number::to_sql;
use crate::tiles::{PackedContent, insert_tiles, pack};
use crate::topologies::{NewTopology, save_topology};
use crate::trajectories::save_poses;
use crate::{
    ContentHash, Error, JournalSeq, MapId, MapLease, MapRecord, NewPoses, NewTile, Store, TileKey,
    manifest,
};

/// A version to be made.
#[derive(Clone, Debug)]
pub struct NewSnapshot {
    /// The map.
    pub map: MapId,
    /// The right to do so.
    pub lease: MapLease,
    /// The version tells everything up to this entry.
    pub journal_seq: JournalSeq,
    /// What made it: `tracking` or a job's kind.
    pub origin: String,
    /// Names the weights by which sonars were read last; empty where nobody noted it.
    pub sonar_weights: String,
    /// Names the parameters that it was drawn by; empty for those of the service.
    pub mapping_parameters: String,
    /// Scans drawn into the grid.
    pub n_scans: u64,
    /// Extent of the observed cells in the map's frame, in metres: smallest x, smallest y, largest
    /// x, largest y. `None` if nothing was observed.
    pub bounds_m: Option<[f64; 4]>,
    /// The tracker's own state, opaque, from which it goes on after a restart.
    pub state: Vec<u8>,
    /// The grid: all of its tiles.
    pub tiles: Vec<NewTile>,
    /// Regions, graph and ids of the grid; `None` if it has none.
    pub topology: Option<NewTopology>,
    /// Landmarks, opaque; `None` if there are none.
    pub landmarks: Option<Vec<u8>>,
    /// What changed in the trajectories: one entry a session at most.
    pub poses: Vec<NewPoses>,
    /// The service's clock, nanoseconds since 1970.
    pub time_ns: i64,
}

/// A version as it is stored.
#[derive(Clone, Debug, PartialEq)]
pub struct VersionRecord {
    /// The map.
    pub map: MapId,
    /// 1, 2, 3... within the map.
    pub number: u64,
    /// Whether queries are answered from it.
    pub published: bool,
    /// It tells everything up to this entry.
    pub journal_seq: JournalSeq,
    /// Scans drawn into the grid.
    pub n_scans: u64,
    /// Extent of the observed cells in the map's frame, in metres: smallest x, smallest y, largest
    /// x, largest y. `None` if nothing was observed.
    pub bounds_m: Option<[f64; 4]>,
    /// The service's clock, nanoseconds since 1970.
    pub create_time_ns: i64,
    /// What made it: `tracking` or a job's kind.
    pub origin: String,
    /// Names the weights by which sonars were read last; empty where nobody noted it.
    pub sonar_weights: String,
    /// Names the parameters that it was drawn by; empty for those of the service.
    pub mapping_parameters: String,
}

/// Where mapping goes on after a restart.
#[derive(Clone, Debug, PartialEq)]
pub struct Checkpoint {
    /// The version it belongs to.
    pub version: u64,
    /// The last entry that is in it.
    pub journal_seq: JournalSeq,
    /// The tracker's own state, opaque.
    pub state: Vec<u8>,
    /// The version's tiles, in ascending order of their keys.
    pub tiles: Vec<(TileKey, ContentHash)>,
}

#[derive(sqlx::FromRow)]
struct Row {
    map_id: MapId,
    #[sqlx(try_from = "i64")]
    number: u64,
    published: bool,
    journal_seq: JournalSeq,
    #[sqlx(try_from = "i64")]
    n_scans: u64,
    x_min_m: Option<f64>,
    y_min_m: Option<f64>,
    x_max_m: Option<f64>,
    y_max_m: Option<f64>,
    create_time_ns: i64,
    origin: String,
    sonar_weights: String,
    mapping_parameters: String,
}

impl From<Row> for VersionRecord {
    fn from(row: Row) -> Self {
        let bounds = [row.x_min_m, row.y_min_m, row.x_max_m, row.y_max_m];
        Self {
            map: row.map_id,
            number: row.number,
            published: row.published,
            journal_seq: row.journal_seq,
            n_scans: row.n_scans,
            bounds_m: whole(bounds),
            create_time_ns: row.create_time_ns,
            origin: row.origin,
            sonar_weights: row.sonar_weights,
            mapping_parameters: row.mapping_parameters,
        }
    }
}

/// Bounds from their columns, which are all there or all null.
fn whole(columns: [Option<f64>; 4]) -> Option<[f64; 4]> {
    let [x_min_m, y_min_m, x_max_m, y_max_m] = columns;
    Some([x_min_m?, y_min_m?, x_max_m?, y_max_m?])
}

impl Store {
    /// Makes a map's next version with all that belongs to it, and publishes it unless a person
    /// has moved the pointer back.
    ///
    /// # Errors
    /// [`Error::NoSuchMap`]; [`Error::LeaseLost`] if the lease is not the one in force;
    /// [`Error::TrajectoryGap`].
    pub async fn save_snapshot(&self, new: &NewSnapshot) -> Result<VersionRecord, Error> {
        let fresh = |tile: &NewTile| Some(pack(tile.hash, tile.bytes.as_deref()?));
        let tiles: Vec<PackedContent> = new.tiles.iter().filter_map(fresh).collect();
        let topology = new.topology.as_ref();
        let topology = topology.and_then(|new| Some(pack(new.hash, new.bytes.as_deref()?)));
        let landmarks = new.landmarks.as_deref();
        let landmarks = landmarks.map(|bytes| pack(ContentHash::of(bytes), bytes));
        let mut write = self.write().await?;
        let packed = Packed { tiles, topology, landmarks };
        let result = insert_snapshot(&mut write.connection, new, &packed).await;
        write.end(result).await
    }

    /// One version, or `None`.
    ///
    /// # Errors
    /// Those of reading.
    pub async fn version(&self, map: &MapId, number: u64) -> Result<Option<VersionRecord>, Error> {
        find(self.readers(), map, number).await
    }

    /// At most `limit` versions of a map, newest first, those below `before`.
    ///
    /// # Errors
    /// Those of reading.
    pub async fn versions(
        &self,
        map: &MapId,
        before: Option<u64>,
        limit: u32,
    ) -> Result<Vec<VersionRecord>, Error> {
        let rows: Vec<Row> = sqlx::query_as(
            "select map_id, number, number = published_version as published, journal_seq, n_scans,
                 x_min_m, y_min_m, x_max_m, y_max_m, map_versions.create_time_ns, origin,
                 sonar_weights, mapping_parameters
             from map_versions join maps on maps.id = map_id
             where map_id = $1 and number < $2 order by number desc limit $3",
        )
        .bind(map)
        .bind(to_sql(before.unwrap_or(u64::MAX)))
        .bind(limit)
        .fetch_all(self.readers())
        .await?;
        Ok(rows.into_iter().map(VersionRecord::from).collect())
    }

    /// Moves the map's pointer to a version, which is a decision that the journal keeps. New
    /// versions are published on their own again if it is the newest, and not if it is older.
    ///
    /// # Errors
    /// [`Error::NoSuchMap`]; [`Error::NoSuchVersion`].
    pub async fn publish_version(
        &self,
        map: &MapId,
        number: u64,
        time_ns: i64,
    ) -> Result<MapRecord, Error> {
        let mut write = self.write().await?;
        let result = publish(&mut write.connection, map, number, time_ns).await;
        write.end(result).await
    }

    /// The tiles of a version, in ascending order of their keys.
    ///
    /// # Errors
    /// [`Error::NoSuchVersion`]; [`Error::Damaged`] if the list cannot be read.
    pub async fn manifest(
        &self,
        map: &MapId,
        number: u64,
    ) -> Result<Vec<(TileKey, ContentHash)>, Error> {
        let bytes: Option<Vec<u8>> = sqlx::query_scalar(
            "select manifest from map_versions where map_id = $1 and number = $2",
        )
        .bind(map)
        .bind(to_sql(number))
        .fetch_optional(self.readers())
        .await?;
        let missing = || Error::NoSuchVersion { map: map.clone(), number };
        manifest::decode(&bytes.ok_or_else(missing)?)
    }

    /// Where mapping of a map goes on; `None` before its first version.
    ///
    /// # Errors
    /// [`Error::Damaged`] if the list of tiles cannot be read.
    pub async fn checkpoint(&self, map: &MapId) -> Result<Option<Checkpoint>, Error> {
        let row: Option<CheckpointRow> = sqlx::query_as(
            "select version, checkpoints.journal_seq, state, manifest
             from checkpoints join map_versions
                 on map_versions.map_id = checkpoints.map_id and number = version
             where checkpoints.map_id = $1",
        )
        .bind(map)
        .fetch_optional(self.readers())
        .await?;
        let Some(CheckpointRow { version, journal_seq, state, manifest }) = row else {
            return Ok(None);
        };
        let tiles = manifest::decode(&manifest)?;
        Ok(Some(Checkpoint { version, journal_seq, state, tiles }))
    }
}

#[derive(sqlx::FromRow)]
struct CheckpointRow {
    #[sqlx(try_from = "i64")]
    version: u64,
    journal_seq: JournalSeq,
    state: Vec<u8>,
    manifest: Vec<u8>,
}

async fn find(
    executor: impl SqliteExecutor<'_>,
    map: &MapId,
    number: u64,
) -> Result<Option<VersionRecord>, Error> {
    let row: Option<Row> = sqlx::query_as(
        "select map_id, number, number = published_version as published, journal_seq, n_scans,
             x_min_m, y_min_m, x_max_m, y_max_m, map_versions.create_time_ns, origin,
                 sonar_weights, mapping_parameters
         from map_versions join maps on maps.id = map_id
         where map_id = $1 and number = $2",
    )
    .bind(map)
    .bind(to_sql(number))
    .fetch_optional(executor)
    .await?;
    Ok(row.map(VersionRecord::from))
}

async fn require_version(
    connection: &mut SqliteConnection,
    map: &MapId,
    number: u64,
) -> Result<VersionRecord, Error> {
    let found = find(connection, map, number).await?;
    found.ok_or_else(|| Error::NoSuchVersion { map: map.clone(), number })
}

/// What of a snapshot is not stored yet, compressed before the transaction begins.
struct Packed {
    tiles: Vec<PackedContent>,
    topology: Option<PackedContent>,
    landmarks: Option<PackedContent>,
}

async fn insert_snapshot(
    connection: &mut SqliteConnection,
    new: &NewSnapshot,
    packed: &Packed,
) -> Result<VersionRecord, Error> {
    let map = require_map(&mut *connection, &new.map).await?;
    require_lease(&mut *connection, &new.lease).await?;
    let number = map.latest_version + 1;
    insert_tiles(&mut *connection, &packed.tiles).await?;
    if let Some(landmarks) = &packed.landmarks {
        insert_landmarks(&mut *connection, landmarks).await?;
    }
    insert_version(&mut *connection, new, number, packed.landmarks.as_ref()).await?;
    if let Some(topology) = &new.topology {
        let content = packed.topology.as_ref();
        save_topology(&mut *connection, &new.map, number, topology, content).await?;
    }
    for poses in &new.poses {
        save_poses(&mut *connection, &new.map, number, poses).await?;
    }
    replace_checkpoint(&mut *connection, new, number).await?;
    let published = if map.publishes_automatically { number } else { map.published_version };
    sqlx::query("update maps set latest_version = $1, published_version = $2 where id = $3")
        .bind(to_sql(number))
        .bind(to_sql(published))
        .bind(&new.map)
        .execute(&mut *connection)
        .await?;
    require_version(connection, &new.map, number).await
}

async fn insert_version(
    connection: &mut SqliteConnection,
    new: &NewSnapshot,
    number: u64,
    landmarks: Option<&PackedContent>,
) -> Result<(), Error> {
    sqlx::query(
        "insert into map_versions (map_id, number, journal_seq, n_scans, x_min_m, y_min_m,
             x_max_m, y_max_m, origin, create_time_ns, manifest, topology_hash, landmarks_hash,
             sonar_weights, mapping_parameters)
         values ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15)",
    )
    .bind(&new.map)
    .bind(to_sql(number))
    .bind(new.journal_seq)
    .bind(to_sql(new.n_scans))
    .bind(new.bounds_m.map(|[x_min_m, ..]| x_min_m))
    .bind(new.bounds_m.map(|[_, y_min_m, ..]| y_min_m))
    .bind(new.bounds_m.map(|[.., x_max_m, _]| x_max_m))
    .bind(new.bounds_m.map(|[.., y_max_m]| y_max_m))
    .bind(&new.origin)
    .bind(new.time_ns)
    .bind(manifest::encode(new.tiles.iter().map(|tile| (tile.key, tile.hash))))
    .bind(new.topology.as_ref().map(|topology| topology.hash.0.to_vec()))
    .bind(landmarks.map(|landmarks| landmarks.hash.0.to_vec()))
    .bind(&new.sonar_weights)
    .bind(&new.mapping_parameters)
    .execute(connection)
    .await?;
    Ok(())
}

async fn replace_checkpoint(
    connection: &mut SqliteConnection,
    new: &NewSnapshot,
    number: u64,
) -> Result<(), Error> {
    sqlx::query(
        "insert into checkpoints (map_id, version, journal_seq, state) values ($1, $2, $3, $4)
         on conflict (map_id) do update set version = $2, journal_seq = $3, state = $4",
    )
    .bind(&new.map)
    .bind(to_sql(number))
    .bind(new.journal_seq)
    .bind(new.state.as_slice())
    .execute(connection)
    .await?;
    Ok(())
}

async fn publish(
    connection: &mut SqliteConnection,
    map: &MapId,
    number: u64,
    time_ns: i64,
) -> Result<MapRecord, Error> {
    let latest = require_map(&mut *connection, map).await?.latest_version;
    require_version(&mut *connection, map, number).await?;
    sqlx::query(
        "update maps set published_version = $1, publishes_automatically = $2 where id = $3",
    )
    .bind(to_sql(number))
    .bind(number == latest)
    .bind(map)
    .execute(&mut *connection)
    .await?;
    let kind = Kind::VersionPublished;
    let event = NewEvent { map, kind, session: None, number: Some(number), time_ns };
    record_event(&mut *connection, &event).await?;
    require_map(connection, map).await
}
