//! What changed on a map.

use meetpoint_proto::v1::{
    ListChangesRequest, ListChangesResponse, ListDoorsRequest, ListDoorsResponse,
    change_service_client::ChangeServiceClient,
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

    /// Places whose occupancy keeps changing, by pages.
    ///
    /// # Errors
    ///
    /// `MAP_NOT_FOUND`, `NOTHING_PUBLISHED` or `VERSION_NOT_FOUND`.
    pub async fn doors(&self, request: ListDoorsRequest) -> Result<ListDoorsResponse, Error> {
        let mut changes = ChangeServiceClient::new(self.channel.clone());
        Ok(changes.list_doors(call(request)).await?.into_inner())
    }
}
