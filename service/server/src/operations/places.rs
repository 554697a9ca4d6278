//! The places of a map.

use meetpoint_places::{GatewayCriterion, LocalParams, parsed_map};
use meetpoint_proto::v1;

use super::page;
use crate::convert::place;
use crate::{error::Error, service::Service};

/// By which gateways are found: the one of the paper's figures, and by far the fastest.
const PARAMS: LocalParams =
    LocalParams { criterion: GatewayCriterion::Constriction, ..LocalParams::INDOOR };

impl Service {
    /// A page of the places of a version.
    pub(crate) async fn list_places(
        &self,
        request: v1::ListPlacesRequest,
    ) -> Result<v1::ListPlacesResponse, Error> {
        let v1::ListPlacesRequest { map, version, page_size, page_token } = request;
        let size = page::size(page_size, &self.settings.limits) as usize;
        let begin = page::after(&page_token, |token| token.parse::<usize>().ok())?.unwrap_or(0);
        let version = self.version_grid(&map, version).await?;
        let raster = self.raster(&version, None).await?;
        let _permit = self.planner.searching.acquire().await.map_err(|_| Error::Stopping)?;
        let parsed = tokio::task::spawn_blocking(move || parsed_map(&raster, &PARAMS))
            .await
            .map_err(Error::internal)?;
        let end = begin.saturating_add(size);
        let n_places = parsed.map.n_places();
        let page = parsed.places().skip(begin).take(size);
        Ok(v1::ListPlacesResponse {
            places: page.map(|(id, local)| place::to_wire(id, local, &parsed.map)).collect(),
            next_page_token: if n_places <= end { String::new() } else { end.to_string() },
            map_version: version.version,
            place_count: place::count(n_places),
            edges: place::count(parsed.map.n_edges()),
            paths: place::count(parsed.map.n_paths()),
        })
    }
}
