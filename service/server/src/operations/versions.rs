//! Map versions: look at, list, publish.

use meetpoint_proto::v1;
use meetpoint_storage::{MapId, VersionRecord};

use super::page;
use crate::convert::map;
use crate::live::Event;
use crate::{clock, error::Error, service::Service};

impl Service {
    /// The versions of a map, newest first.
    pub(crate) async fn list_map_versions(
        &self,
        request: v1::ListMapVersionsRequest,
    ) -> Result<v1::ListMapVersionsResponse, Error> {
        let v1::ListMapVersionsRequest { map, page_size, page_token } = request;
        let record = self.map_record(&map).await?;
        let size = page::size(page_size, &self.settings.limits);
        let before = page::after(&page_token, |token| token.parse().ok())?;
        let records = self.store.versions(&record.id, before, size).await?;
        Ok(v1::ListMapVersionsResponse {
            next_page_token: page::token(&records, size, |record| record.number.to_string()),
            versions: records.iter().map(map::version_to_wire).collect(),
        })
    }

    /// One version.
    pub(crate) async fn get_map_version(
        &self,
        request: v1::GetMapVersionRequest,
    ) -> Result<v1::GetMapVersionResponse, Error> {
        let v1::GetMapVersionRequest { map, number } = request;
        let record = self.version_record(&map, number).await?;
        Ok(v1::GetMapVersionResponse { version: Some(map::version_to_wire(&record)) })
    }

    /// Moves the pointer of a map.
    pub(crate) async fn publish_map_version(
        &self,
        request: v1::PublishMapVersionRequest,
    ) -> Result<v1::PublishMapVersionResponse, Error> {
        let v1::PublishMapVersionRequest { map, number } = request;
        let version = self.version_record(&map, number).await?;
        let record =
            self.store.publish_version(&version.map, version.number, clock::now_ns()).await?;
        // The journal has grown by this decision.
        self.actors.wake(&record.id);
        let published = VersionRecord { published: true, ..version };
        let event = Event::Version(map::version_to_wire(&published));
        self.live.announce(record.id.clone(), event);
        Ok(v1::PublishMapVersionResponse { map: Some(map::to_wire(record)) })
    }

    /// The record of a version that has to exist; 0 is the published one.
    pub(crate) async fn version_record(
        &self,
        map: &str,
        number: u64,
    ) -> Result<VersionRecord, Error> {
        let record = self.map_record(map).await?;
        let number = if number == 0 { record.published_version } else { number };
        if number == 0 {
            return Err(Error::NothingPublished(map.to_owned()));
        }
        let missing = || Error::NoSuchVersion { map: map.to_owned(), number };
        self.store.version(&MapId(map.to_owned()), number).await?.ok_or_else(missing)
    }
}
