//! Maps, and the pointer to the version that is published.

use sqlx::SqliteConnection;

use crate::error::violated;
use crate::journal::{Kind, NewEvent, record_event};
use crate::{Error, MapId, Store};

/// A map to be made.
#[derive(Clone, Debug)]
pub struct NewMap {
    /// Its id.
    pub id: MapId,
    /// What people call it.
    pub display_name: String,
    /// Edge of a cell in metres, positive.
    pub resolution_m: f64,
    /// The service's clock, nanoseconds since 1970.
    pub time_ns: i64,
}

/// A map as it is stored.
#[derive(Clone, Debug, PartialEq)]
pub struct MapRecord {
    /// Its id.
    pub id: MapId,
    /// What people call it.
    pub display_name: String,
    /// Edge of a cell in metres.
    pub resolution_m: f64,
    /// The version that queries are answered from; 0 before the first.
    pub published_version: u64,
    /// The newest version; 0 before the first.
    pub latest_version: u64,
    /// Whether a new version becomes the published one. False while a person has moved the pointer
    /// back.
    pub publishes_automatically: bool,
    /// Counts what was changed on top of a version.
    pub cost_revision: u64,
    /// The service's clock, nanoseconds since 1970.
    pub create_time_ns: i64,
}

#[derive(sqlx::FromRow)]
struct Row {
    id: MapId,
    display_name: String,
    resolution_m: f64,
    #[sqlx(try_from = "i64")]
    published_version: u64,
    #[sqlx(try_from = "i64")]
    latest_version: u64,
    publishes_automatically: bool,
    #[sqlx(try_from = "i64")]
    cost_revision: u64,
    create_time_ns: i64,
}

impl From<Row> for MapRecord {
    fn from(row: Row) -> Self {
        Self {
            id: row.id,
            display_name: row.display_name,
            resolution_m: row.resolution_m,
            published_version: row.published_version,
            latest_version: row.latest_version,
            publishes_automatically: row.publishes_automatically,
            cost_revision: row.cost_revision,
            create_time_ns: row.create_time_ns,
        }
    }
}

impl Store {
    /// Makes an empty map, which is the first entry of its journal.
    ///
    /// # Errors
    /// [`Error::MapExists`].
    pub async fn create_map(&self, new: &NewMap) -> Result<MapRecord, Error> {
        let mut write = self.write().await?;
        let result = insert_map(&mut write.connection, new).await;
        write.end(result).await
    }

    /// One map, or `None`.
    ///
    /// # Errors
    /// Those of reading.
    pub async fn map(&self, id: &MapId) -> Result<Option<MapRecord>, Error> {
        let row: Option<Row> = sqlx::query_as("select * from maps where id = $1")
            .bind(id)
            .fetch_optional(self.readers())
            .await?;
        Ok(row.map(MapRecord::from))
    }

    /// At most `limit` maps by id, those behind `after`.
    ///
    /// # Errors
    /// Those of reading.
    pub async fn maps(&self, after: Option<&MapId>, limit: u32) -> Result<Vec<MapRecord>, Error> {
        let rows: Vec<Row> =
            sqlx::query_as("select * from maps where $1 < id order by id limit $2")
                .bind(after.map_or("", MapId::as_str))
                .bind(limit)
                .fetch_all(self.readers())
                .await?;
        Ok(rows.into_iter().map(MapRecord::from).collect())
    }
}

/// The map inside a transaction.
///
/// # Errors
/// [`Error::NoSuchMap`].
pub(crate) async fn require_map(
    connection: &mut SqliteConnection,
    id: &MapId,
) -> Result<MapRecord, Error> {
    let row: Option<Row> = sqlx::query_as("select * from maps where id = $1")
        .bind(id)
        .fetch_optional(connection)
        .await?;
    row.map(MapRecord::from).ok_or_else(|| Error::NoSuchMap(id.clone()))
}

/// The map inside a transaction, made if there is none of its id.
pub(crate) async fn find_or_create(
    connection: &mut SqliteConnection,
    new: &NewMap,
) -> Result<MapRecord, Error> {
    match require_map(&mut *connection, &new.id).await {
        Err(Error::NoSuchMap(_)) => insert_map(connection, new).await,
        found => found,
    }
}

async fn insert_map(connection: &mut SqliteConnection, new: &NewMap) -> Result<MapRecord, Error> {
    sqlx::query(
        "insert into maps (id, display_name, resolution_m, create_time_ns)
         values ($1, $2, $3, $4)",
    )
    .bind(&new.id)
    .bind(&new.display_name)
    .bind(new.resolution_m)
    .bind(new.time_ns)
    .execute(&mut *connection)
    .await
    .map_err(|error| match violated(&error) {
        Some("maps.id") => Error::MapExists(new.id.clone()),
        _ => error.into(),
    })?;
    let event = NewEvent {
        map: &new.id,
        kind: Kind::MapCreated,
        session: None,
        number: None,
        time_ns: new.time_ns,
    };
    record_event(&mut *connection, &event).await?;
    require_map(connection, &new.id).await
}
