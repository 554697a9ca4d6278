//! The ledger of closures.

use meetpoint_proto::v1::{
    Closure, ListClosuresRequest, SwitchClosureOffRequest, SwitchClosureOnRequest,
    closure_service_client::ClosureServiceClient,
};
use tonic::transport::Channel;

use super::{Client, call};
use crate::error::Error;

/// Closures a page of a list: the most that the service gives.
const CLOSURES_PAGE: u32 = 1000;

impl Client {
    /// All closures of a map; only those of one session unless `session` is empty.
    ///
    /// # Errors
    ///
    /// `MAP_NOT_FOUND`.
    pub async fn closures(&self, map: &str, session: &str) -> Result<Vec<Closure>, Error> {
        let mut request = ListClosuresRequest {
            map: map.to_owned(),
            session: session.to_owned(),
            page_size: CLOSURES_PAGE,
            ..ListClosuresRequest::default()
        };
        let mut all = Vec::new();
        loop {
            let page = self.ledger().list_closures(call(request.clone())).await?.into_inner();
            all.extend(page.closures);
            if page.next_page_token.is_empty() {
                return Ok(all);
            }
            request.page_token = page.next_page_token;
        }
    }

    /// Lets no relax job rest poses on a closure any more.
    ///
    /// # Errors
    ///
    /// `MAP_NOT_FOUND` or `CLOSURE_NOT_FOUND`.
    pub async fn switch_closure_off(
        &self,
        request: SwitchClosureOffRequest,
    ) -> Result<Closure, Error> {
        let reply = self.ledger().switch_closure_off(call(request)).await?.into_inner();
        reply.closure.ok_or(Error::Malformed("closure"))
    }

    /// Leaves a closure to the judgement of relax jobs again.
    ///
    /// # Errors
    ///
    /// `MAP_NOT_FOUND` or `CLOSURE_NOT_FOUND`.
    pub async fn switch_closure_on(
        &self,
        request: SwitchClosureOnRequest,
    ) -> Result<Closure, Error> {
        let reply = self.ledger().switch_closure_on(call(request)).await?.into_inner();
        reply.closure.ok_or(Error::Malformed("closure"))
    }

    fn ledger(&self) -> ClosureServiceClient<Channel> {
        ClosureServiceClient::new(self.channel.clone())
    }
}
