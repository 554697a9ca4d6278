//! Sessions: open, look at, list, close.

use meetpoint_proto::v1;
use meetpoint_storage::{
    MapId, NewSession, RobotId, SessionFilter, SessionId, SessionRecord, SessionState,
};
use uuid::Uuid;

use super::maps::shortened;
use super::page;
use crate::convert::session::{self, Opening, Present};
use crate::live::Event;
use crate::{clock, error::Error, service::Service};

impl Service {
    /// Opens a session, or finds the one of that client key.
    pub(crate) async fn open_session(
        &self,
        request: v1::OpenSessionRequest,
    ) -> Result<v1::OpenSessionResponse, Error> {
        let Opening { map, robot, client_key, epoch, declaration, map_from_session } =
            session::opening(request)?;
        self.map_record(&map).await?;
        let new = NewSession {
            id: SessionId(Uuid::now_v7()),
            map: MapId(map),
            robot: RobotId(robot),
            client_key,
            epoch,
            declaration,
            map_from_session: map_from_session.map(crate::convert::pose::to_record),
            time_ns: clock::now_ns(),
        };
        let opened = self.store.open_session(&new).await?;
        for fenced in &opened.fenced {
            self.ended(*fenced).await?;
        }
        if !opened.resumed {
            self.actors.wake(&opened.session.map);
        }
        let session = self.present(opened.session).await?;
        if !opened.resumed {
            self.announce_session(&session);
        }
        Ok(v1::OpenSessionResponse {
            session: Some(session),
            resumed: opened.resumed,
            limits: Some(session::limits(&self.settings.limits)),
        })
    }

    /// One session.
    pub(crate) async fn get_session(
        &self,
        request: v1::GetSessionRequest,
    ) -> Result<v1::GetSessionResponse, Error> {
        let v1::GetSessionRequest { session } = request;
        let record = self.session_record(&session).await?;
        Ok(v1::GetSessionResponse { session: Some(self.present(record).await?) })
    }

    /// Sessions, oldest first.
    pub(crate) async fn list_sessions(
        &self,
        request: v1::ListSessionsRequest,
    ) -> Result<v1::ListSessionsResponse, Error> {
        let v1::ListSessionsRequest { map, robot, page_size, page_token } = request;
        let filter = SessionFilter {
            map: (!map.is_empty()).then_some(MapId(map)),
            robot: (!robot.is_empty()).then_some(RobotId(robot)),
        };
        let size = page::size(page_size, &self.settings.limits);
        let after = page::after(&page_token, |token| session::id("", token).ok())?;
        let records = self.store.sessions(&filter, after, size).await?;
        let next_page_token = page::token(&records, size, |record| record.id.0.to_string());
        let mut sessions = Vec::with_capacity(records.len());
        for record in records {
            sessions.push(self.present(record).await?);
        }
        Ok(v1::ListSessionsResponse { sessions, next_page_token })
    }

    /// Says that nothing more will come.
    pub(crate) async fn close_session(
        &self,
        request: v1::CloseSessionRequest,
    ) -> Result<v1::CloseSessionResponse, Error> {
        let v1::CloseSessionRequest { session, epoch } = request;
        let id = self.session_record(&session).await?.id;
        let record = self.store.close_session(id, epoch, clock::now_ns()).await?;
        self.ended(id).await?;
        Ok(v1::CloseSessionResponse { session: Some(self.present(record).await?) })
    }

    /// The record of a session that has to exist.
    pub(crate) async fn session_record(&self, id: &str) -> Result<SessionRecord, Error> {
        let record = self.store.session(session::id("session", id)?).await?;
        record.ok_or_else(|| Error::NoSuchSession(shortened(id)))
    }

    /// A session ended: its map is to be completed, watchers are told.
    async fn ended(&self, id: SessionId) -> Result<(), Error> {
        self.known_sessions.forget(id);
        let Some(record) = self.store.session(id).await? else { return Ok(()) };
        self.actors.wake(&record.map);
        let session = self.present(record).await?;
        self.announce_session(&session);
        Ok(())
    }

    /// A session was put somewhere, or was taken back: watchers are told.
    pub(crate) async fn announce_place(&self, id: SessionId) -> Result<(), Error> {
        let Some(record) = self.store.session(id).await? else { return Ok(()) };
        let session = self.present(record).await?;
        self.announce_session(&session);
        Ok(())
    }

    fn announce_session(&self, session: &v1::Session) {
        let map = MapId(session.map.clone());
        self.live.announce(map, Event::Session(Box::new(session.clone())));
    }

    /// A record with what only the present tells.
    async fn present(&self, record: SessionRecord) -> Result<v1::Session, Error> {
        let progress = self.live.session(record.id);
        let mapped_through = match &progress {
            Some(progress) => progress.mapped_through,
            None if record.state == SessionState::Open && self.actors.is_running(&record.map) => 0,
            None => record.acked_through,
        };
        let lost = progress.and_then(|progress| progress.correction).is_some_and(|last| last.lost);
        let complete_in_version = match record.end_seq {
            Some(end) => {
                let newest = self.store.versions(&record.map, None, 1).await?;
                newest.first().filter(|version| version.journal_seq >= end).map_or(0, |v| v.number)
            }
            None => 0,
        };
        session::to_wire(record, Present { mapped_through, lost, complete_in_version })
    }
}
