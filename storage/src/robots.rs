//! Robots: machines, and how often they started anew.

use sqlx::SqliteConnection;

use crate::error::violated;
use crate::{Error, RobotId, Store};

/// A robot to be registered.
#[derive(Clone, Debug)]
pub struct NewRobot {
    /// Its id.
    pub id: RobotId,
    /// What people call it.
    pub display_name: String,
    /// The service's clock, nanoseconds since 1970.
    pub time_ns: i64,
}

/// A robot as it is stored.
#[derive(Clone, Debug, PartialEq, Eq, sqlx::FromRow)]
pub struct RobotRecord {
    /// Its id.
    pub id: RobotId,
    /// What people call it.
    pub display_name: String,
    /// The newest epoch that a session was opened with; 0 before the first.
    #[sqlx(try_from = "i64")]
    pub epoch: u64,
    /// The service's clock, nanoseconds since 1970.
    pub create_time_ns: i64,
}

impl Store {
    /// Registers a robot. Opening a session does so on the way.
    ///
    /// # Errors
    /// [`Error::RobotExists`].
    pub async fn create_robot(&self, new: &NewRobot) -> Result<RobotRecord, Error> {
        let mut write = self.write().await?;
        let result = insert_robot(&mut write.connection, new).await;
        write.end(result).await
    }

    /// One robot, or `None`.
    ///
    /// # Errors
    /// Those of reading.
    pub async fn robot(&self, id: &RobotId) -> Result<Option<RobotRecord>, Error> {
        let robot = sqlx::query_as("select * from robots where id = $1")
            .bind(id)
            .fetch_optional(self.readers())
            .await?;
        Ok(robot)
    }

    /// At most `limit` robots by id, those behind `after`.
    ///
    /// # Errors
    /// Those of reading.
    pub async fn robots(
        &self,
        after: Option<&RobotId>,
        limit: u32,
    ) -> Result<Vec<RobotRecord>, Error> {
        let robots = sqlx::query_as("select * from robots where $1 < id order by id limit $2")
            .bind(after.map_or("", RobotId::as_str))
            .bind(limit)
            .fetch_all(self.readers())
            .await?;
        Ok(robots)
    }
}

/// The robot inside a transaction, registered if it is new, under its id as display name.
pub(crate) async fn find_or_register(
    connection: &mut SqliteConnection,
    id: &RobotId,
    time_ns: i64,
) -> Result<RobotRecord, Error> {
    let found = sqlx::query_as("select * from robots where id = $1")
        .bind(id)
        .fetch_optional(&mut *connection)
        .await?;
    if let Some(robot) = found {
        return Ok(robot);
    }
    let new = NewRobot { id: id.clone(), display_name: id.as_str().to_owned(), time_ns };
    insert_robot(connection, &new).await
}

/// Raises the robot's epoch.
pub(crate) async fn set_epoch(
    connection: &mut SqliteConnection,
    id: &RobotId,
    epoch: i64,
) -> Result<(), Error> {
    sqlx::query("update robots set epoch = $1 where id = $2")
        .bind(epoch)
        .bind(id)
        .execute(connection)
        .await?;
    Ok(())
}

async fn insert_robot(
    connection: &mut SqliteConnection,
    new: &NewRobot,
) -> Result<RobotRecord, Error> {
    sqlx::query(
        "insert into robots (id, display_name, epoch, create_time_ns) values ($1, $2, 0, $3)",
    )
    .bind(&new.id)
    .bind(&new.display_name)
    .bind(new.time_ns)
    .execute(connection)
    .await
    .map_err(|error| match violated(&error) {
        Some("robots.id") => Error::RobotExists(new.id.clone()),
        _ => Error::from(error),
    })?;
    Ok(RobotRecord {
        id: new.id.clone(),
        display_name: new.display_name.clone(),
        epoch: 0,
        create_time_ns: new.time_ns,
    })
}
