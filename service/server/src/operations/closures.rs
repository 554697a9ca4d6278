//! The ledger of closures: looked at, switched off, switched on.

use meetpoint_proto::v1;
use meetpoint_storage::{ClosureFilter, ClosureRecord, ClosureSwitch};

use super::maps::shortened;
use super::page;
use crate::convert::{closure, session};
use crate::{clock, error::Error, service::Service};

impl Service {
    /// A page of the closures of a map.
    pub(crate) async fn list_closures(
        &self,
        request: v1::ListClosuresRequest,
    ) -> Result<v1::ListClosuresResponse, Error> {
        let v1::ListClosuresRequest { map, session, verdict, page_size, page_token } = request;
        let session =
            (!session.is_empty()).then(|| session::id("session", &session)).transpose()?;
        let filter = ClosureFilter { session, is_accepted: closure::verdict(verdict)? };
        let map = self.map_record(&map).await?.id;
        let size = page::size(page_size, &self.settings.limits);
        let after = page::after(&page_token, |token| token.parse::<u64>().ok())?;
        let records = self.store.closures(&map, filter, after, size).await?;
        let next_page_token = page::token(&records, size, |record| record.position.to_string());
        let to_wire = |record: &ClosureRecord| closure::to_wire(&map.0, record);
        let closures = records.iter().map(to_wire).collect::<Result<_, Error>>()?;
        Ok(v1::ListClosuresResponse { closures, next_page_token })
    }

    /// Switches a closure off.
    pub(crate) async fn switch_closure_off(
        &self,
        request: v1::SwitchClosureOffRequest,
    ) -> Result<v1::SwitchClosureOffResponse, Error> {
        let v1::SwitchClosureOffRequest { map, closure, reason, author } = request;
        let closure = self.switch_closure([&map, &closure], true, [&reason, &author]).await?;
        Ok(v1::SwitchClosureOffResponse { closure: Some(closure) })
    }

    /// Switches a closure on again.
    pub(crate) async fn switch_closure_on(
        &self,
        request: v1::SwitchClosureOnRequest,
    ) -> Result<v1::SwitchClosureOnResponse, Error> {
        let v1::SwitchClosureOnRequest { map, closure, reason, author } = request;
        let closure = self.switch_closure([&map, &closure], false, [&reason, &author]).await?;
        Ok(v1::SwitchClosureOnResponse { closure: Some(closure) })
    }

    async fn switch_closure(
        &self,
        [map, text]: [&str; 2],
        is_off: bool,
        said: [&str; 2],
    ) -> Result<v1::Closure, Error> {
        let id = closure::id(text)?;
        let payload = closure::decision(id, is_off, said)?;
        let map = self.map_record(map).await?.id;
        let switch = ClosureSwitch { map, id, is_off, payload, time_ns: clock::now_ns() };
        let map = &switch.map;
        match self.store.switch_closure(&switch).await? {
            Some(record) => {
                // The journal has grown by this decision.
                self.actors.wake(map);
                closure::to_wire(&map.0, &record)
            }
            None => Err(Error::NoSuchClosure { map: map.0.clone(), closure: shortened(text) }),
        }
    }
}
