//! Replies to requests that carried an idempotency key, so that sending again is safe.

use crate::{ContentHash, Error, Store};

/// What was answered to a request.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RememberedReply {
    /// Hash of the request. The same key with another fingerprint is a mistake of the caller.
    pub fingerprint: ContentHash,
    /// HTTP status.
    pub status: u16,
    /// The body sent.
    pub body: Vec<u8>,
    /// When, by the service's clock, nanoseconds since 1970.
    pub time_ns: i64,
}

#[derive(sqlx::FromRow)]
struct Row {
    fingerprint: Vec<u8>,
    status: u16,
    body: Vec<u8>,
    time_ns: i64,
}

impl Store {
    /// What was answered to `key` on `route`, or `None`.
    ///
    /// # Errors
    /// Those of reading.
    pub async fn remembered_reply(
        &self,
        key: &str,
        route: &str,
    ) -> Result<Option<RememberedReply>, Error> {
        let row: Option<Row> =
            sqlx::query_as("select * from replies where key = $1 and route = $2")
                .bind(key)
                .bind(route)
                .fetch_optional(self.readers())
                .await?;
        let Some(Row { fingerprint, status, body, time_ns }) = row else { return Ok(None) };
        let fingerprint = ContentHash::from_column(&fingerprint)?;
        Ok(Some(RememberedReply { fingerprint, status, body, time_ns }))
    }

    /// Keeps a reply. The first one to a key on a route stays.
    ///
    /// # Errors
    /// Those of writing.
    pub async fn remember_reply(
        &self,
        key: &str,
        route: &str,
        reply: &RememberedReply,
    ) -> Result<(), Error> {
        let mut write = self.write().await?;
        let result = sqlx::query(
            "insert into replies (key, route, fingerprint, status, body, time_ns)
             values ($1, $2, $3, $4, $5, $6) on conflict (key, route) do nothing",
        )
        .bind(key)
        .bind(route)
        .bind(reply.fingerprint.0.as_slice())
        .bind(reply.status)
        .bind(reply.body.as_slice())
        .bind(reply.time_ns)
        .execute(&mut write.connection)
        .await;
        write.end(result.map(|_| ()).map_err(Error::from)).await
    }

    /// Forgets replies given before `time_ns`; says how many.
    ///
    /// # Errors
    /// Those of writing.
    pub async fn forget_replies_before(&self, time_ns: i64) -> Result<u64, Error> {
        let mut write = self.write().await?;
        let result = sqlx::query("delete from replies where time_ns < $1")
            .bind(time_ns)
            .execute(&mut write.connection)
            .await;
        write.end(result.map(|done| done.rows_affected()).map_err(Error::from)).await
    }
}
