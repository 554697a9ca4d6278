//! Merges: looked at, accepted, rejected, undone.

use meetpoint_geometry::{Point2, Pose};
use meetpoint_merging::preview;
use meetpoint_proto::v1;
use meetpoint_storage::{MapId, MergeFilter, MergeRecord, SessionId};

use super::maps::shortened;
use super::page;
use crate::convert::merge_decision::{Deciding, MergeDecided};
use crate::convert::way_picture::{self, Way};
use crate::convert::{landmark, merge, session};
use crate::live::Event;
use crate::merging::{Known, accepting, rejecting, undoing};
use crate::{clock, error::Error, service::Service};

/// Pixels on the longer side of a preview.
const PREVIEW_PIXELS: u32 = 1024;
/// Decisions that are made between reading and writing are rare, and each time somebody gets on.
const N_ATTEMPTS_MAX: usize = 8;

/// What is to be decided, seen from how things are.
type Decide<'a> =
    dyn Fn(&MergeRecord, &Known) -> Result<Option<Deciding>, Error> + Send + Sync + 'a;

impl Service {
    /// The way of a session that has drawn nothing, laid over the landmarks of what it may lie on; over where
    /// these were seen, if that is a session too.
    async fn landmark_preview(
        &self,
        merge: &v1::Merge,
        onto: Option<SessionId>,
        onto_from_session: Pose,
    ) -> Result<Vec<u8>, Error> {
        let (map, version) = (&merge.map, merge.map_version);
        let moved = |points: Vec<Point2<f64>>| -> Vec<Point2<f64>> {
            points.into_iter().map(|at| onto_from_session * at).collect()
        };
        let own = self.way(map, &merge.session, version).await?;
        let mut shown =
            Way { points: moved(own.points), seen: moved(own.seen), landmarks: Vec::new() };
        match onto {
            Some(older) => {
                shown.seen.extend(self.way(map, &older.0.to_string(), version).await?.seen);
            }
            None => {
                let landmarks = self.all_landmarks(map, version).await?;
                shown.landmarks = landmarks.iter().map(landmark::place).collect();
            }
        }
        let drawn = tokio::task::spawn_blocking(move || way_picture::png(&shown, &Way::default()));
        drawn.await.map_err(Error::internal)?
    }

    /// A page of merges.
    pub(crate) async fn list_merges(
        &self,
        request: v1::ListMergesRequest,
    ) -> Result<v1::ListMergesResponse, Error> {
        let v1::ListMergesRequest { map, session, state, page_size, page_token } = request;
        let filter = MergeFilter {
            map: (!map.is_empty()).then_some(MapId(map)),
            session: (!session.is_empty()).then(|| session::id("session", &session)).transpose()?,
            state: merge::state(state)?,
        };
        let size = page::size(page_size, &self.settings.limits);
        let after = page::after(&page_token, |token| token.parse::<u64>().ok())?;
        let records = self.store.merges(&filter, after, size).await?;
        let next_page_token = page::token(&records, size, |record| record.position.to_string());
        let merges = records.iter().map(merge::to_wire).collect::<Result<_, Error>>()?;
        Ok(v1::ListMergesResponse { merges, next_page_token })
    }

    /// One merge.
    pub(crate) async fn get_merge(
        &self,
        request: v1::GetMergeRequest,
    ) -> Result<v1::GetMergeResponse, Error> {
        let record = self.merge_record(&request.merge).await?;
        Ok(v1::GetMergeResponse { merge: Some(merge::to_wire(&record)?) })
    }

    /// A picture of one map laid over the other.
    pub(crate) async fn get_merge_preview(
        &self,
        request: v1::GetMergePreviewRequest,
    ) -> Result<v1::GetMergePreviewResponse, Error> {
        let v1::GetMergePreviewRequest { merge: id, alignment: wanted } = request;
        let record = self.merge_record(&id).await?;
        let merge = merge::to_wire(&record)?;
        let mut alignments = merge.alignments.iter();
        let found = alignments.find(|one| wanted.is_empty() || one.id == wanted);
        let Some(found) = found else {
            let (merge, alignment) = (shortened(&id), shortened(&wanted));
            return Err(Error::NoSuchAlignment { merge, alignment });
        };
        let (onto, onto_from_session) = merge::place(found)?;
        let (map, version) = (&merge.map, merge.map_version);
        let still = self.frame_grid(map, version, onto).await?.grid;
        let moved = self.frame_grid(map, version, Some(record.session)).await?.grid;
        if moved.bounds().is_none() {
            let png = self.landmark_preview(&merge, onto, onto_from_session).await?;
            return Ok(v1::GetMergePreviewResponse { png });
        }
        let drawn = move || preview(&still, &moved, onto_from_session, PREVIEW_PIXELS);
        let png = tokio::task::spawn_blocking(drawn).await.map_err(Error::internal)?;
        Ok(v1::GetMergePreviewResponse { png })
    }

    /// Puts a session where an alignment says.
    pub(crate) async fn accept_merge(
        &self,
        request: v1::AcceptMergeRequest,
    ) -> Result<v1::AcceptMergeResponse, Error> {
        let v1::AcceptMergeRequest { merge, alignment, reason, author } = request;
        let alignment = shortened(&alignment);
        let decide =
            |record: &MergeRecord, known: &Known| accepting(record, &alignment, known.placements());
        let (merge, job) = self.decide_merge(&merge, [&reason, &author], &decide).await?;
        Ok(v1::AcceptMergeResponse { merge: Some(merge), job })
    }

    /// Leaves a session where it is.
    pub(crate) async fn reject_merge(
        &self,
        request: v1::RejectMergeRequest,
    ) -> Result<v1::RejectMergeResponse, Error> {
        let v1::RejectMergeRequest { merge, reason, author } = request;
        let decide = |record: &MergeRecord, _: &Known| rejecting(record);
        let (merge, _) = self.decide_merge(&merge, [&reason, &author], &decide).await?;
        Ok(v1::RejectMergeResponse { merge: Some(merge) })
    }

    /// Takes an accepted merge back.
    pub(crate) async fn undo_merge(
        &self,
        request: v1::UndoMergeRequest,
    ) -> Result<v1::UndoMergeResponse, Error> {
        let v1::UndoMergeRequest { merge, reason, author } = request;
        let decide = |record: &MergeRecord, _: &Known| undoing(record);
        let (merge, job) = self.decide_merge(&merge, [&reason, &author], &decide).await?;
        Ok(v1::UndoMergeResponse { merge: Some(merge), job })
    }

    /// Decides about a merge for a person: the merge as it is then, and the job that draws the map by it
    /// (empty if there is none).
    async fn decide_merge(
        &self,
        id: &str,
        said: [&str; 2],
        decide: &Decide<'_>,
    ) -> Result<(v1::Merge, String), Error> {
        let [reason, author] = merge::said(said)?;
        for _ in 0..N_ATTEMPTS_MAX {
            let record = self.merge_record(id).await?;
            let mut known = Known::load(&self.store, &record.map, clock::now_ns()).await?;
            let Some(what) = decide(&record, &known)? else {
                return Ok((merge::to_wire(&record)?, String::new()));
            };
            let (author, reason) = (author.clone(), reason.clone());
            let (merge, session) = (record.id, record.session);
            known.decide(&MergeDecided {
                merge,
                session,
                what: what.clone(),
                by_rule: false,
                author,
                reason,
            });
            let job = self.then_drawn(&mut known, &what);
            match self.store.decide_merges(&known.into_decisions()).await {
                Ok(()) => {}
                Err(meetpoint_storage::Error::MergesChanged(_)) => continue,
                Err(error) => return Err(error.into()),
            }
            self.merge_decided(&record, job.is_some()).await?;
            let now = merge::to_wire(&self.merge_record(id).await?)?;
            return Ok((now, job.unwrap_or_default()));
        }
        Err(Error::StorageBusy)
    }

    /// What follows from a decision: the map is drawn by it, and relaxed with who is new.
    fn then_drawn(&self, known: &mut Known, what: &Deciding) -> Option<String> {
        if *what == Deciding::Rejected {
            return None;
        }
        let job = known.then_draw();
        if matches!(what, Deciding::Accepted { .. }) && self.settings.merging.relaxes_after {
            known.then_relax();
        }
        Some(job.0.to_string())
    }

    /// Tells everybody that something was decided about a merge.
    async fn merge_decided(&self, record: &MergeRecord, starts_job: bool) -> Result<(), Error> {
        let map = &record.map;
        // The journal has grown by this decision.
        self.actors.wake(map);
        if starts_job && let Some(newest) = self.store.jobs(Some(map), None, 1).await?.first() {
            self.live.announce(map.clone(), Event::Job(newest.id));
        }
        self.announce_place(record.session).await
    }

    /// The record of a merge that has to exist.
    pub(crate) async fn merge_record(&self, id: &str) -> Result<MergeRecord, Error> {
        let record = self.store.merge(merge::id(id)?).await?;
        record.ok_or_else(|| Error::NoSuchMerge(shortened(id)))
    }
}
