//! The doors of a map.

use meetpoint_occupancy::{DoorParams, doors};
use meetpoint_proto::v1;

use super::page;
use crate::convert::door;
use crate::{error::Error, service::Service};

impl Service {
    /// A page of the doors of a version.
    pub(crate) async fn list_doors(
        &self,
        request: v1::ListDoorsRequest,
    ) -> Result<v1::ListDoorsResponse, Error> {
        let v1::ListDoorsRequest { map, version, page_size, page_token } = request;
        let size = page::size(page_size, &self.settings.limits) as usize;
        let begin = page::after(&page_token, |token| token.parse::<usize>().ok())?.unwrap_or(0);
        let version = self.version_grid(&map, version).await?;
        let (grid, frame) = (version.grid.clone(), version.grid.frame());
        let found = tokio::task::spawn_blocking(move || doors(&grid, &DoorParams::INDOOR))
            .await
            .map_err(Error::internal)?;
        let end = begin.saturating_add(size);
        let is_last = found.len() <= end;
        let page = found.iter().skip(begin).take(size);
        Ok(v1::ListDoorsResponse {
            doors: page.map(|one| door::to_wire(one, frame)).collect(),
            next_page_token: if is_last { String::new() } else { end.to_string() },
            map_version: version.version,
        })
    }
}
