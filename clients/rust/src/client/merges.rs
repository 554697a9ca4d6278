//! Where sessions of unknown start lie, and what is decided about it.

use meetpoint_proto::v1::{
    AcceptMergeRequest, AcceptMergeResponse, GetMergePreviewRequest, GetMergeRequest,
    GetSessionGridRequest, Grid, ListMergesRequest, Merge, RejectMergeRequest, UndoMergeRequest,
    UndoMergeResponse, grid_service_client::GridServiceClient,
    merge_service_client::MergeServiceClient,
};
use tonic::transport::Channel;

use super::{ANSWER_BYTES_MAX, Client, call};
use crate::error::Error;

/// Merges a page of a list: the most that the service gives.
const MERGES_PAGE: u32 = 1000;

impl Client {
    /// All merges of a map; only that of one session unless `session` is empty.
    ///
    /// # Errors
    ///
    /// `INVALID_FIELD` for a session that is no UUID.
    pub async fn merges(&self, map: &str, session: &str) -> Result<Vec<Merge>, Error> {
        let mut request = ListMergesRequest {
            map: map.to_owned(),
            session: session.to_owned(),
            page_size: MERGES_PAGE,
            ..ListMergesRequest::default()
        };
        let mut all = Vec::new();
        loop {
            let page = self.merging().list_merges(call(request.clone())).await?.into_inner();
            all.extend(page.merges);
            if page.next_page_token.is_empty() {
                return Ok(all);
            }
            request.page_token = page.next_page_token;
        }
    }

    /// One merge.
    ///
    /// # Errors
    ///
    /// `MERGE_NOT_FOUND`.
    pub async fn merge(&self, id: &str) -> Result<Merge, Error> {
        let request = GetMergeRequest { merge: id.to_owned() };
        let reply = self.merging().get_merge(call(request)).await?.into_inner();
        reply.merge.ok_or(Error::Malformed("merge"))
    }

    /// A PNG of one map laid over the other by an alignment, the first if that is empty.
    ///
    /// # Errors
    ///
    /// `MERGE_NOT_FOUND` or `ALIGNMENT_NOT_FOUND`.
    pub async fn merge_preview(&self, id: &str, alignment: &str) -> Result<Vec<u8>, Error> {
        let (merge, alignment) = (id.to_owned(), alignment.to_owned());
        let request = GetMergePreviewRequest { merge, alignment };
        Ok(self.merging().get_merge_preview(call(request)).await?.into_inner().png)
    }

    /// Puts a session where an alignment says.
    ///
    /// # Errors
    ///
    /// `MERGE_NOT_FOUND`, `ALIGNMENT_NOT_FOUND`, `MERGE_ACCEPTED` or `MERGE_CYCLE`.
    pub async fn accept_merge(
        &self,
        request: AcceptMergeRequest,
    ) -> Result<AcceptMergeResponse, Error> {
        Ok(self.merging().accept_merge(call(request)).await?.into_inner())
    }

    /// Leaves a session where it is.
    ///
    /// # Errors
    ///
    /// `MERGE_NOT_FOUND` or `MERGE_ACCEPTED`.
    pub async fn reject_merge(&self, request: RejectMergeRequest) -> Result<Merge, Error> {
        let reply = self.merging().reject_merge(call(request)).await?.into_inner();
        reply.merge.ok_or(Error::Malformed("merge"))
    }

    /// Takes an accepted merge back.
    ///
    /// # Errors
    ///
    /// `MERGE_NOT_FOUND` or `MERGE_NOT_ACCEPTED`.
    pub async fn undo_merge(&self, request: UndoMergeRequest) -> Result<UndoMergeResponse, Error> {
        Ok(self.merging().undo_merge(call(request)).await?.into_inner())
    }

    /// What a session that is not placed has drawn, as a version of its map has it (0 for the published
    /// one).
    ///
    /// # Errors
    ///
    /// `SESSION_NOT_FOUND`, `SESSION_PLACED`, `NOTHING_PUBLISHED`, `VERSION_NOT_FOUND`,
    /// `NOTHING_OBSERVED` or `GRID_TOO_LARGE`.
    pub async fn session_grid(&self, session: &str, version: u64) -> Result<Grid, Error> {
        let session = session.to_owned();
        let request = GetSessionGridRequest { session, version, bounding_box: None };
        let mut grids = GridServiceClient::new(self.channel.clone())
            .max_decoding_message_size(ANSWER_BYTES_MAX);
        let response = grids.get_session_grid(call(request)).await?;
        response.into_inner().grid.ok_or(Error::Malformed("grid"))
    }

    fn merging(&self) -> MergeServiceClient<Channel> {
        MergeServiceClient::new(self.channel.clone())
    }
}
