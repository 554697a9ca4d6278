//! Placements: where merges in force put sessions of unknown start.

use sqlx::SqliteConnection;

use crate::{Error, MapId, SessionId};

/// Where a merge in force puts a session.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// The session.
    pub session: SessionId,
    /// The session in whose frame it lies; `None` for the map's frame.
    pub frame: Option<SessionId>,
    /// Its own frame seen from there: x and y in metres, theta in radians.
    pub frame_from_session: [f64; 3],
}

/// Puts these in place of all placements of a map, inside a transaction.
pub(crate) async fn replace_placements(
    connection: &mut SqliteConnection,
    map: &MapId,
    placements: &[Placement],
) -> Result<(), Error> {
    sqlx::query(
        "delete from placements where session_id in (select id from sessions where map_id = $1)",
    )
    .bind(map)
    .execute(&mut *connection)
    .await?;
    for Placement { session, frame, frame_from_session: [x_m, y_m, theta_rad] } in placements {
        sqlx::query(
            "insert into placements (session_id, frame_id, x_m, y_m, theta_rad)
             values ($1, $2, $3, $4, $5)",
        )
        .bind(session)
        .bind(frame)
        .bind(x_m)
        .bind(y_m)
        .bind(theta_rad)
        .execute(&mut *connection)
        .await?;
    }
    Ok(())
}
