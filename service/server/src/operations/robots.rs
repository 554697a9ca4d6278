//! Robots: register, look at, list.

use meetpoint_proto::v1;
use meetpoint_storage::{NewRobot, RobotId};

use super::maps::{DISPLAY_NAME_LEN_MAX, shortened};
use super::page;
use crate::convert::{map::robot_to_wire, slug};
use crate::{clock, error::Error, service::Service};

impl Service {
    /// Registers a robot.
    pub(crate) async fn create_robot(
        &self,
        request: v1::CreateRobotRequest,
    ) -> Result<v1::CreateRobotResponse, Error> {
        let v1::CreateRobotRequest { robot } = request;
        let v1::Robot { id, display_name, .. } =
            robot.ok_or_else(|| Error::field("robot", "missing"))?;
        let new = NewRobot {
            id: RobotId(slug::slug("robot.id", &id)?),
            display_name: slug::text("robot.display_name", &display_name, DISPLAY_NAME_LEN_MAX)?,
            time_ns: clock::now_ns(),
        };
        match self.store.create_robot(&new).await {
            Ok(record) => Ok(v1::CreateRobotResponse { robot: Some(robot_to_wire(record)) }),
            Err(meetpoint_storage::Error::RobotExists(_)) => Err(Error::RobotExists(id)),
            Err(error) => Err(error.into()),
        }
    }

    /// One robot.
    pub(crate) async fn get_robot(
        &self,
        request: v1::GetRobotRequest,
    ) -> Result<v1::GetRobotResponse, Error> {
        let v1::GetRobotRequest { robot } = request;
        let record = self.store.robot(&RobotId(robot.clone())).await?;
        let record = record.ok_or_else(|| Error::NoSuchRobot(shortened(&robot)))?;
        Ok(v1::GetRobotResponse { robot: Some(robot_to_wire(record)) })
    }

    /// All robots, by id.
    pub(crate) async fn list_robots(
        &self,
        request: v1::ListRobotsRequest,
    ) -> Result<v1::ListRobotsResponse, Error> {
        let v1::ListRobotsRequest { page_size, page_token } = request;
        let size = page::size(page_size, &self.settings.limits);
        let after = page::after(&page_token, |token| slug::slug("", token).ok().map(RobotId))?;
        let records = self.store.robots(after.as_ref(), size).await?;
        let next_page_token = page::token(&records, size, |record| record.id.0.clone());
        Ok(v1::ListRobotsResponse {
            robots: records.into_iter().map(robot_to_wire).collect(),
            next_page_token,
        })
    }
}
