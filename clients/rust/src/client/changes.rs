//! What changed on a map.

use meetpoint_proto::v1::{
    ListChangesRequest, ListChangesResponse, change_service_client::ChangeServiceClient,
};

use super::{Client, call};
use crate::error::Error;

impl Client {
    /// What became of cells between two versions of a map, by pages.
    ///
    /// # Errors
    ///
    /// `MAP_NOT_FOUND`, `VERSION_NOT_FOUND`, or `GRID_TOO_LARGE` if too much differs.
    pub async fn changes(&self, request: ListChangesRequest) -> Result<ListChangesResponse, Error> {
        let mut changes = ChangeServiceClient::new(self.channel.clone());
        Ok(changes.list_changes(call(request)).await?.into_inner())
    }
}
