//! Landmarks of map versions.

use meetpoint_proto::v1;

use super::page;
use crate::convert::landmark;
use crate::{error::Error, service::Service};

impl Service {
    /// A page of the landmarks of a version.
    pub(crate) async fn list_landmarks(
        &self,
        request: v1::ListLandmarksRequest,
    ) -> Result<v1::ListLandmarksResponse, Error> {
        let v1::ListLandmarksRequest { map, version, page_size, page_token } = request;
        let version = self.version_record(&map, version).await?;
        let size = page::size(page_size, &self.settings.limits);
        let begin = page::after(&page_token, |token| token.parse::<usize>().ok())?.unwrap_or(0);
        let landmarks = self.all_landmarks(&version.map.0, version.number).await?;
        let end = begin.saturating_add(size as usize);
        let is_last = landmarks.len() <= end;
        Ok(v1::ListLandmarksResponse {
            landmarks: landmarks.into_iter().skip(begin).take(size as usize).collect(),
            next_page_token: if is_last { String::new() } else { end.to_string() },
            map_version: version.number,
        })
    }

    /// The landmarks of a version that exists.
    pub(crate) async fn all_landmarks(
        &self,
        map: &str,
        number: u64,
    ) -> Result<Vec<v1::Landmark>, Error> {
        let version = self.version_record(map, number).await?;
        let saved = self.store.landmarks(&version.map, version.number).await?;
        saved.map_or(Ok(Vec::new()), |bytes| landmark::set_from_bytes(&bytes))
    }
}
