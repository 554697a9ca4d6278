//! Where to go to see what nobody has seen.

use meetpoint_proto::v1::{
    GetExplorationRequest, GetExplorationResponse,
    exploration_service_client::ExplorationServiceClient,
};
use tonic::codec::CompressionEncoding;

use super::{ANSWER_BYTES_MAX, Client, call};
use crate::error::Error;

impl Client {
    /// The next goal of every robot, and how much of a map is unexplored. A robot asks again while it
    /// drives.
    ///
    /// # Errors
    ///
    /// `MAP_NOT_FOUND`, `ROBOT_NOT_FOUND`, `PROFILE_NOT_FOUND`, `NOTHING_OBSERVED` before the first scan
    /// is mapped, or what is wrong with the request.
    pub async fn exploration(
        &self,
        request: GetExplorationRequest,
    ) -> Result<GetExplorationResponse, Error> {
        let mut service = ExplorationServiceClient::new(self.channel.clone())
            .accept_compressed(CompressionEncoding::Zstd)
            .max_decoding_message_size(ANSWER_BYTES_MAX);
        Ok(service.get_exploration(call(request)).await?.into_inner())
    }
}
