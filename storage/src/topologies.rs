//! What versions know of places: regions, graph and ids as opaque bytes, addressed by their content,
//! and what became of regions that are no more.

use sqlx::types::Json;
use sqlx::{QueryBuilder, Sqlite, SqliteConnection};

use crate::number::to_sql;
use crate::tiles::{PackedContent, unpack};
use crate::{ContentHash, Error, MapId, Store};

/// The topology of a snapshot.
#[derive(Clone, Debug)]
pub struct NewTopology {
    /// [`ContentHash::of`] its content.
    pub hash: ContentHash,
    /// Its content; `None` if it is stored already.
    pub bytes: Option<Vec<u8>>,
    /// The next ids that are free after it. They only grow.
    pub next_ids: NextIds,
    /// Regions that the version before had and this one does not.
    pub ended: Vec<EndedRegion>,
}

/// Ids that no region and no arc of a map ever had.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NextIds {
    /// For a region.
    pub region: u64,
    /// For an arc.
    pub arc: u64,
}

/// A region that is no more.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EndedRegion {
    /// Its id.
    pub region: u64,
    /// Regions that hold cells of it in the version that ended it, with the number of these, most
    /// first.
    pub heirs: Vec<(u64, u64)>,
}

/// Heirs as they are stored: JSON of pairs.
type HeirsColumn = Json<Vec<(u64, u64)>>;

/// Hash and bytes, both absent where a version has no topology.
type ContentRow = (Option<Vec<u8>>, Option<Vec<u8>>);

/// Rows a statement writes at most.
const ROWS_PER_STATEMENT: usize = 16;

impl Store {
    /// The topology of a version as it was saved, and its hash; `None` if it has none.
    ///
    /// # Errors
    /// [`Error::NoSuchVersion`]; [`Error::Damaged`] if it is missing or does not have its hash any
    /// more.
    pub async fn topology(
        &self,
        map: &MapId,
        number: u64,
    ) -> Result<Option<(ContentHash, Vec<u8>)>, Error> {
        let row: Option<ContentRow> = sqlx::query_as(
            "select topology_hash, bytes from map_versions
             left join topologies on hash = topology_hash
             where map_id = $1 and number = $2",
        )
        .bind(map)
        .bind(to_sql(number))
        .fetch_optional(self.readers())
        .await?;
        let missing = || Error::NoSuchVersion { map: map.clone(), number };
        let (Some(hash), bytes) = row.ok_or_else(missing)? else { return Ok(None) };
        let hash = ContentHash::from_column(&hash)?;
        let bytes = bytes.ok_or_else(|| Error::Damaged(format!("topology {hash} is missing")))?;
        Ok(Some((hash, unpack(hash, &bytes)?)))
    }

    /// The topology of a map's newest version that has one, and its hash.
    ///
    /// # Errors
    /// [`Error::Damaged`] if it is missing or does not have its hash any more.
    pub async fn newest_topology(
        &self,
        map: &MapId,
    ) -> Result<Option<(ContentHash, Vec<u8>)>, Error> {
        let number: Option<i64> = sqlx::query_scalar(
            "select max(number) from map_versions
             where map_id = $1 and topology_hash is not null",
        )
        .bind(map)
        .fetch_one(self.readers())
        .await?;
        match number {
            Some(number) => self.topology(map, count(number)?).await,
            None => Ok(None),
        }
    }

    /// The next free ids of a map.
    ///
    /// # Errors
    /// [`Error::NoSuchMap`].
    pub async fn next_ids(&self, map: &MapId) -> Result<NextIds, Error> {
        let row: Option<(i64, i64)> =
            sqlx::query_as("select next_region, next_arc from maps where id = $1")
                .bind(map)
                .fetch_optional(self.readers())
                .await?;
        let (region, arc) = row.ok_or_else(|| Error::NoSuchMap(map.clone()))?;
        Ok(NextIds { region: count(region)?, arc: count(arc)? })
    }

    /// When and how a region ended: the first version without it, and its heirs there; `None` if it
    /// did not.
    ///
    /// # Errors
    /// Those of reading.
    pub async fn ended_region(
        &self,
        map: &MapId,
        region: u64,
    ) -> Result<Option<(u64, EndedRegion)>, Error> {
        let row: Option<(i64, HeirsColumn)> = sqlx::query_as(
            "select version, heirs from ended_regions where map_id = $1 and region = $2",
        )
        .bind(map)
        .bind(to_sql(region))
        .fetch_optional(self.readers())
        .await?;
        let Some((version, Json(heirs))) = row else { return Ok(None) };
        Ok(Some((count(version)?, EndedRegion { region, heirs })))
    }

    /// The regions that a version does not have any more and the one before it had, by id.
    ///
    /// # Errors
    /// Those of reading.
    pub async fn regions_ended_in(
        &self,
        map: &MapId,
        number: u64,
    ) -> Result<Vec<EndedRegion>, Error> {
        let rows: Vec<(i64, HeirsColumn)> = sqlx::query_as(
            "select region, heirs from ended_regions
             where map_id = $1 and version = $2 order by region",
        )
        .bind(map)
        .bind(to_sql(number))
        .fetch_all(self.readers())
        .await?;
        let ended = |(region, Json(heirs))| Ok(EndedRegion { region: count(region)?, heirs });
        rows.into_iter().map(ended).collect()
    }
}

/// Writes what belongs to a version's topology, but its name in the version's row. `content` is
/// that of `new`, unless it is stored already.
pub(crate) async fn save_topology(
    connection: &mut SqliteConnection,
    map: &MapId,
    number: u64,
    new: &NewTopology,
    content: Option<&PackedContent>,
) -> Result<(), Error> {
    if let Some(PackedContent { hash, bytes }) = content {
        sqlx::query(
            "insert into topologies (hash, bytes) values ($1, $2)
             on conflict (hash) do update set bytes = excluded.bytes",
        )
        .bind(hash.0.as_slice())
        .bind(bytes.as_slice())
        .execute(&mut *connection)
        .await?;
    }
    sqlx::query(
        "update maps set next_region = max(next_region, $1), next_arc = max(next_arc, $2)
         where id = $3",
    )
    .bind(to_sql(new.next_ids.region))
    .bind(to_sql(new.next_ids.arc))
    .bind(map)
    .execute(&mut *connection)
    .await?;
    for chunk in new.ended.chunks(ROWS_PER_STATEMENT) {
        let mut query = QueryBuilder::<Sqlite>::new(
            "insert into ended_regions (map_id, region, version, heirs) ",
        );
        query.push_values(chunk, |mut row, ended| {
            row.push_bind(map.clone()).push_bind(to_sql(ended.region));
            row.push_bind(to_sql(number)).push_bind(Json(ended.heirs.clone()));
        });
        query.push(" on conflict (map_id, region) do nothing");
        query.build().execute(&mut *connection).await?;
    }
    Ok(())
}

fn count(column: i64) -> Result<u64, Error> {
    u64::try_from(column).map_err(|_| Error::Damaged(format!("{column} is no count")))
}
