//! Which sessions a job relaxes, and by what.
//!
//! The method is that of what a session carries. With scans it is theirs, and what the session saw of
//! landmarks that have identities takes part in the same graph: scans are right to centimetres where walls
//! tell places apart, landmarks to decimetres anywhere. Landmarks alone, which may all look alike, are
//! another method, expectation maximisation; it is theirs also who ask for landmarks from the grid.

use meetpoint_proto::v1;
use meetpoint_storage::{MapId, SessionFilter, SessionId, SessionRecord};
use v1::sensor::Kind;

use super::saved::{Method, Planned};
use crate::convert::session;
use crate::{error::Error, service::Service};

/// Sessions of a map read at a time.
const N_SESSIONS_READ: u32 = 100;

/// What a job is to do.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Choice {
    /// Those that are relaxed by their scans first, else in the order in which they were opened.
    pub(super) planned: Vec<Planned>,
    /// Sessions whose scans are matched with what was imported: they stay in it.
    pub(super) following: Vec<SessionId>,
}

/// What a job with these parameters relaxes on a map.
pub(super) async fn choice(
    service: &Service,
    map: &MapId,
    params: &v1::RelaxParams,
) -> Result<Choice, Error> {
    let store = &service.store;
    let asked = params.sessions.iter().map(|id| session::id("relax.sessions", id));
    let asked = asked.collect::<Result<Vec<SessionId>, Error>>()?;
    let filter = SessionFilter { map: Some(map.clone()), robot: None };
    let is_imported = store.is_imported(map).await?;
    let (mut choice, mut after) = (Choice::default(), None);
    loop {
        let page = store.sessions(&filter, after, N_SESSIONS_READ).await?;
        let Some(last) = page.last() else {
            choice.planned.sort_by_key(|planned| planned.method != Method::Scans);
            return Ok(choice);
        };
        after = Some(last.id);
        for record in page.iter().filter(|record| record.map_from_session.is_some()) {
            let Some(method) = method(record, params.landmarks_from_grid)? else { continue };
            let is_named = asked.contains(&record.id);
            // What was matched with an imported map has its place from it, which scans alone do not
            // know.
            let follows = method == Method::Scans && is_imported;
            if is_named || (asked.is_empty() && !follows) {
                let through = record.acked_through;
                choice.planned.push(Planned { session: record.id, method, through });
            } else if asked.is_empty() {
                choice.following.push(record.id);
            }
        }
    }
}

/// By what a session can be relaxed; `None` if it carries nothing to go by.
fn method(record: &SessionRecord, is_by_grid: bool) -> Result<Option<Method>, Error> {
    let sensors = session::declaration(&record.declaration)?.sensors;
    let detects =
        sensors.iter().any(|sensor| matches!(sensor.kind, Some(Kind::LandmarkDetector(_))));
    Ok(match (0 < record.n_scans, detects) {
        (true, _) if is_by_grid => Some(Method::GridLandmarks),
        (true, _) => Some(Method::Scans),
        (false, true) => Some(Method::Landmarks),
        (false, false) => None,
    })
}
