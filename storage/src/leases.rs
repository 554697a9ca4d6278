//! Which process maps, and the fence that tells its writes from those of an earlier holder.

use sqlx::SqliteConnection;
use uuid::Uuid;

use crate::maps::require_map;
use crate::number::to_sql;
use crate::{Error, MapId, Store};

/// The right to write a map's versions, until somebody else takes it over.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MapLease {
    /// The map.
    pub map: MapId,
    /// The process that holds it.
    pub owner: Uuid,
    /// Counts up with every change of hands.
    pub fence: u64,
}

impl Store {
    /// Takes the lease of a map until `now_ns + ttl_ns`, both in nanoseconds, if nobody else holds
    /// it. A holder who asks again gets a new fence, and the old one is void. `None` if another
    /// owner holds it.
    ///
    /// # Errors
    /// [`Error::NoSuchMap`].
    pub async fn acquire_map_lease(
        &self,
        map: &MapId,
        owner: Uuid,
        now_ns: i64,
        ttl_ns: i64,
    ) -> Result<Option<MapLease>, Error> {
        let mut write = self.write().await?;
        let result = acquire(&mut write.connection, map, owner, [now_ns, ttl_ns]).await;
        write.end(result).await
    }

    /// Holds the lease until `now_ns + ttl_ns`, in nanoseconds. False if somebody else has it.
    ///
    /// # Errors
    /// Those of writing.
    pub async fn renew_map_lease(
        &self,
        lease: &MapLease,
        now_ns: i64,
        ttl_ns: i64,
    ) -> Result<bool, Error> {
        let mut write = self.write().await?;
        let result = sqlx::query(
            "update map_leases set expire_time_ns = $1
             where map_id = $2 and owner = $3 and fence = $4",
        )
        .bind(now_ns.saturating_add(ttl_ns))
        .bind(&lease.map)
        .bind(lease.owner)
        .bind(to_sql(lease.fence))
        .execute(&mut write.connection)
        .await;
        write.end(result.map(|done| done.rows_affected() == 1).map_err(Error::from)).await
    }

    /// Gives the lease back. Nothing happens if somebody else has it.
    ///
    /// # Errors
    /// Those of writing.
    pub async fn release_map_lease(&self, lease: &MapLease) -> Result<(), Error> {
        let mut write = self.write().await?;
        let result = sqlx::query(
            "update map_leases set owner = null
             where map_id = $1 and owner = $2 and fence = $3",
        )
        .bind(&lease.map)
        .bind(lease.owner)
        .bind(to_sql(lease.fence))
        .execute(&mut write.connection)
        .await;
        write.end(result.map(|_| ()).map_err(Error::from)).await
    }

    /// Voids the leases of all maps and running jobs: for a process that knows, by a lock on the
    /// folder, that it is the only one and has just started.
    ///
    /// # Errors
    /// Those of writing.
    pub async fn release_all_leases(&self) -> Result<(), Error> {
        let mut write = self.write().await?;
        let result = release_all(&mut write.connection).await;
        write.end(result).await
    }
}

/// Checks inside a transaction that the lease is still the one in force.
///
/// # Errors
/// [`Error::LeaseLost`].
pub(crate) async fn require_lease(
    connection: &mut SqliteConnection,
    lease: &MapLease,
) -> Result<(), Error> {
    let held: Option<i64> = sqlx::query_scalar(
        "select fence from map_leases where map_id = $1 and owner = $2 and fence = $3",
    )
    .bind(&lease.map)
    .bind(lease.owner)
    .bind(to_sql(lease.fence))
    .fetch_optional(connection)
    .await?;
    held.map(|_| ()).ok_or(Error::LeaseLost)
}

async fn acquire(
    connection: &mut SqliteConnection,
    map: &MapId,
    owner: Uuid,
    [now_ns, ttl_ns]: [i64; 2],
) -> Result<Option<MapLease>, Error> {
    require_map(&mut *connection, map).await?;
    let fence: Option<i64> = sqlx::query_scalar(
        "insert into map_leases (map_id, owner, fence, expire_time_ns) values ($1, $2, 1, $3)
         on conflict (map_id) do update
         set owner = $2, fence = map_leases.fence + 1, expire_time_ns = $3
         where map_leases.owner is null or map_leases.owner = $2
             or map_leases.expire_time_ns <= $4
         returning fence",
    )
    .bind(map)
    .bind(owner)
    .bind(now_ns.saturating_add(ttl_ns))
    .bind(now_ns)
    .fetch_optional(connection)
    .await?;
    Ok(fence.map(|fence| MapLease { map: map.clone(), owner, fence: fence.unsigned_abs() }))
}

async fn release_all(connection: &mut SqliteConnection) -> Result<(), Error> {
    sqlx::query("update map_leases set owner = null").execute(&mut *connection).await?;
    sqlx::query("update jobs set owner = null, lease_expire_time_ns = 0 where owner is not null")
        .execute(connection)
        .await?;
    Ok(())
}
