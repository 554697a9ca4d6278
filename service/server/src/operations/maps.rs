//! Maps: create, look at, list.

use meetpoint_proto::v1;
use meetpoint_storage::{MapId, MapRecord, NewMap};

use super::page;
use crate::convert::{map, slug};
use crate::{clock, error::Error, service::Service};

/// Characters of a display name.
pub(crate) const DISPLAY_NAME_LEN_MAX: usize = 200;

impl Service {
    /// Makes an empty map.
    pub(crate) async fn create_map(
        &self,
        request: v1::CreateMapRequest,
    ) -> Result<v1::CreateMapResponse, Error> {
        let v1::CreateMapRequest { map } = request;
        let v1::Map { id, display_name, resolution_m, .. } =
            map.ok_or_else(|| Error::field("map", "missing"))?;
        let new = NewMap {
            id: MapId(slug::slug("map.id", &id)?),
            display_name: slug::text("map.display_name", &display_name, DISPLAY_NAME_LEN_MAX)?,
            resolution_m: map::resolution_or_default_m(resolution_m)?,
            time_ns: clock::now_ns(),
        };
        match self.store.create_map(&new).await {
            Ok(record) => Ok(v1::CreateMapResponse { map: Some(map::to_wire(record)) }),
            Err(meetpoint_storage::Error::MapExists(_)) => Err(Error::MapExists(id)),
            Err(error) => Err(error.into()),
        }
    }

    /// One map.
    pub(crate) async fn get_map(
        &self,
        request: v1::GetMapRequest,
    ) -> Result<v1::GetMapResponse, Error> {
        let v1::GetMapRequest { map } = request;
        let record = self.map_record(&map).await?;
        Ok(v1::GetMapResponse { map: Some(map::to_wire(record)) })
    }

    /// All maps, by id.
    pub(crate) async fn list_maps(
        &self,
        request: v1::ListMapsRequest,
    ) -> Result<v1::ListMapsResponse, Error> {
        let v1::ListMapsRequest { page_size, page_token } = request;
        let size = page::size(page_size, &self.settings.limits);
        let after = page::after(&page_token, |token| slug::slug("", token).ok().map(MapId))?;
        let records = self.store.maps(after.as_ref(), size).await?;
        let next_page_token = page::token(&records, size, |record| record.id.0.clone());
        Ok(v1::ListMapsResponse {
            maps: records.into_iter().map(map::to_wire).collect(),
            next_page_token,
        })
    }

    /// The record of a map that has to exist.
    pub(crate) async fn map_record(&self, id: &str) -> Result<MapRecord, Error> {
        let record = self.store.map(&MapId(id.to_owned())).await?;
        record.ok_or_else(|| Error::NoSuchMap(shortened(id)))
    }
}

/// What a caller sent, for a message: no longer than any id.
pub(crate) fn shortened(text: &str) -> String {
    text.chars().take(64).collect()
}
