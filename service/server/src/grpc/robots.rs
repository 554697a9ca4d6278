//! `RobotService`.

use meetpoint_proto::v1;
use tonic::{Request, Response, Status};
use v1::robot_service_server::RobotService;

use crate::service::Service;

#[tonic::async_trait]
impl RobotService for Service {
    async fn create_robot(
        &self,
        request: Request<v1::CreateRobotRequest>,
    ) -> Result<Response<v1::CreateRobotResponse>, Status> {
        Ok(self.create_robot(request.into_inner()).await?.into())
    }

    async fn get_robot(
        &self,
        request: Request<v1::GetRobotRequest>,
    ) -> Result<Response<v1::GetRobotResponse>, Status> {
        Ok(self.get_robot(request.into_inner()).await?.into())
    }

    async fn list_robots(
        &self,
        request: Request<v1::ListRobotsRequest>,
    ) -> Result<Response<v1::ListRobotsResponse>, Status> {
        Ok(self.list_robots(request.into_inner()).await?.into())
    }
}
