//! Robots that explore as they are told, step by step.

use std::ops::RangeInclusive;

use meetpoint_places::PlaceId;
use meetpoint_places::qualitative::Guide;
use meetpoint_proto::v1;
use meetpoint_storage::{MapId, NewExplorationDecision, SessionRecord};
use tokio::sync::OwnedMutexGuard;

use crate::convert::{
    distinctive_place, place_graph_picture, qualitative, qualitative_decision, sensor, session,
    slug,
};
use crate::hypotheses::{Moment, Visit};
use crate::qualitative::{Begun, Decided, Decision, Explored};
use crate::{clock, error::Error, service::Service};

/// Batches read from the journal at once.
const N_BATCHES_A_PAGE: u32 = 64;
/// More bytes are read off the async threads: some half a millisecond.
const INLINE_BYTES_MAX: usize = 64 * 1024;
/// Characters of a reason or an author.
const TEXT_LEN_MAX: usize = 200;
/// Widths of corridors that the pilot can tell, in metres.
const CORRIDOR_WIDTHS_M: RangeInclusive<f64> = 1.2..=3.0;
/// Edges of a rehearsal, at most: the paper's search radius is a few.
const N_REHEARSAL_EDGES_MAX: u32 = 8;

/// An exploration that is up to the journal, and whose it is.
struct Asked {
    map: MapId,
    /// Batches up to this number were durable before it was read.
    acked_through: u64,
    explored: OwnedMutexGuard<Explored>,
}

impl Service {
    /// What a robot is to do next.
    pub(crate) async fn get_next_step(
        &self,
        request: v1::GetNextStepRequest,
    ) -> Result<v1::GetNextStepResponse, Error> {
        let v1::GetNextStepRequest { session } = request;
        let Asked { explored, .. } = self.explored(&session).await?;
        let guide = explored.guide().ok_or_else(|| Error::NothingFired(session))?;
        Ok(v1::GetNextStepResponse { step: Some(qualitative::step(guide, explored.stamp_ns())) })
    }

    /// All that is known of an exploration.
    pub(crate) async fn get_qualitative_exploration(
        &self,
        request: v1::GetQualitativeExplorationRequest,
    ) -> Result<v1::GetQualitativeExplorationResponse, Error> {
        let v1::GetQualitativeExplorationRequest { session, picture } = request;
        let Asked { map, explored, .. } = self.explored(&session).await?;
        let answering = tokio::task::spawn_blocking(move || {
            let guide = explored.guide().ok_or_else(|| Error::NothingFired(session))?;
            let explorer = guide.explorer();
            let png = if picture { place_graph_picture::png(explorer)? } else { Vec::new() };
            Ok(v1::GetQualitativeExplorationResponse {
                exploration: Some(qualitative::exploration(&map.0, &explored)),
                step: Some(qualitative::step(guide, explored.stamp_ns())),
                whereabouts: Some(qualitative::whereabouts(explorer)),
                outlook: explorer.outlook().as_ref().map(qualitative::outlook),
                places: distinctive_place::places(explorer.graph()),
                edges: distinctive_place::edges(explorer.graph()),
                agenda: qualitative::agenda(explorer),
                rehearsal: qualitative::rehearsal(explorer),
                rehearsals: explorer.n_rehearsals(),
                rehearsals_refuted: explorer.n_refuted(),
                surprises: explorer.n_surprises(),
                png,
            })
        });
        answering.await.map_err(Error::internal)?
    }

    /// Begins anew.
    pub(crate) async fn begin_qualitative_exploration(
        &self,
        request: v1::BeginQualitativeExplorationRequest,
    ) -> Result<v1::BeginQualitativeExplorationResponse, Error> {
        let v1::BeginQualitativeExplorationRequest {
            session,
            sensor,
            compass,
            selection,
            corridor_width_m,
            rehearsal_edges_max,
            reason,
            author,
        } = request;
        let selection = qualitative::selection(selection)?;
        let corridor_width_m = corridor_width_m.unwrap_or(Begun::DEFAULT.corridor_width_m);
        if !CORRIDOR_WIDTHS_M.contains(&corridor_width_m) {
            let (least, most) = CORRIDOR_WIDTHS_M.into_inner();
            let problem = format!("{corridor_width_m} m, must be {least} to {most} m");
            return Err(Error::field("corridor_width_m", problem));
        }
        let n_edges = rehearsal_edges_max.unwrap_or(if compass { 1 } else { 2 });
        if N_REHEARSAL_EDGES_MAX < n_edges {
            let problem = format!("{n_edges}, at most {N_REHEARSAL_EDGES_MAX}");
            return Err(Error::field("rehearsal_edges_max", problem));
        }
        let said_by = said_by(&reason, &author)?;
        let asked = self.explored(&session).await?;
        // The one that it is now, whatever else the session may declare later.
        let sensor = asked.explored.eye_of(&sensor)?.sensor().to_owned();
        let begun = Begun {
            sensor,
            has_compass: compass,
            selection,
            corridor_width_m,
            n_rehearsal_edges_max: n_edges as usize,
        };
        let exploration =
            Some(self.decide_exploration(asked, Decided::Begun(begun), said_by).await?);
        Ok(v1::BeginQualitativeExplorationResponse { exploration })
    }

    /// Chooses the rule of selection.
    pub(crate) async fn select_directions(
        &self,
        request: v1::SelectDirectionsRequest,
    ) -> Result<v1::SelectDirectionsResponse, Error> {
        let v1::SelectDirectionsRequest { session, selection, reason, author } = request;
        let decided = Decided::Selected(qualitative::selection(selection)?);
        let said_by = said_by(&reason, &author)?;
        let asked = self.explored(&session).await?;
        let exploration = Some(self.decide_exploration(asked, decided, said_by).await?);
        Ok(v1::SelectDirectionsResponse { exploration })
    }

    /// Marks a place as unique, or takes that back.
    pub(crate) async fn mark_home(
        &self,
        request: v1::MarkHomeRequest,
    ) -> Result<v1::MarkHomeResponse, Error> {
        let v1::MarkHomeRequest { session, place, undo, reason, author } = request;
        let said_by = said_by(&reason, &author)?;
        let asked = self.explored(&session).await?;
        let explorer = asked.explored.guide().map(Guide::explorer);
        let explorer = explorer.ok_or_else(|| Error::NothingFired(session))?;
        let last = explorer.last_place().map(|came_by| came_by.place);
        let meant = place.map(PlaceId).or(last).unwrap_or(PlaceId(0));
        if explorer.graph().place(meant).is_none() {
            return Err(Error::NoSuchPlace(meant.0));
        }
        let decided = Decided::Marked { place: meant, is_home: !undo };
        let exploration = Some(self.decide_exploration(asked, decided, said_by).await?);
        Ok(v1::MarkHomeResponse { exploration, place: meant.0 })
    }

    /// Where a session arrived that is told step by step, and when; nothing of one that cannot be.
    pub(super) async fn arrivals(&self, session: &str) -> Result<Vec<(Visit, Moment)>, Error> {
        match self.explored(session).await {
            Ok(asked) => Ok(asked.explored.arrivals()),
            Err(Error::NotAllAround(_)) => Ok(Vec::new()),
            Err(error) => Err(error),
        }
    }

    /// Records a decision and lets it hold.
    async fn decide_exploration(
        &self,
        asked: Asked,
        decided: Decided,
        said_by: [String; 2],
    ) -> Result<v1::QualitativeExploration, Error> {
        let Asked { map, acked_through, mut explored } = asked;
        let time_ns = clock::now_ns();
        let after_batch = acked_through.max(explored.read_through());
        let decision = Decision { after_batch, decided, said_by, time_ns };
        let payload = qualitative_decision::recorded(explored.session(), &decision);
        let new = NewExplorationDecision { map: map.clone(), payload, time_ns };
        self.store.decide_exploration(&new).await?;
        // The journal has grown by this decision.
        self.actors.wake(&map);
        self.read_on(&map, &mut explored).await?;
        Ok(qualitative::exploration(&map.0, &explored))
    }

    /// A session's exploration, brought up to the journal.
    async fn explored(&self, session: &str) -> Result<Asked, Error> {
        let record = self.session_record(session).await?;
        let SessionRecord { id, map, declaration, acked_through, .. } = record;
        let kept = self.explorations.of(id, || {
            let sensors = sensor::sensors(&session::declaration(&declaration)?.sensors)?;
            Explored::new(id, sensors, &self.settings.qualitative)
        })?;
        let mut explored = kept.lock_owned().await;
        self.read_on(&map, &mut explored).await?;
        Ok(Asked { map, acked_through, explored })
    }

    /// Takes in what the journal has that is new.
    async fn read_on(&self, map: &MapId, explored: &mut Explored) -> Result<(), Error> {
        let session = explored.session();
        let read = self.read_journal(map, explored).await;
        if read.is_err() {
            // It may have ended halfway.
            self.explorations.forget(session);
        }
        read
    }

    async fn read_journal(&self, map: &MapId, explored: &mut Explored) -> Result<(), Error> {
        let session = explored.session();
        let decisions = self.store.exploration_decisions(map).await?;
        explored.set_decisions(qualitative_decision::decisions(session, &decisions)?)?;
        loop {
            let from = explored.read_through() + 1;
            let batches = self.store.session_batches(session, from, N_BATCHES_A_PAGE).await?;
            let n_bytes: usize = batches.iter().map(|batch| batch.payload.len()).sum();
            let mut read = || batches.iter().try_for_each(|batch| explored.read(batch));
            if n_bytes <= INLINE_BYTES_MAX { read() } else { tokio::task::block_in_place(read) }?;
            if batches.len() < N_BATCHES_A_PAGE as usize {
                break;
            }
        }
        explored.catch_up()
    }
}

fn said_by(reason: &str, author: &str) -> Result<[String; 2], Error> {
    Ok([slug::text("reason", reason, TEXT_LEN_MAX)?, slug::text("author", author, TEXT_LEN_MAX)?])
}
