//! Maps of places that fit a session's travel: looked at, asserted, driven by.

use meetpoint_places::{
    ConsistentFrame, EdgeRecords, Gateway, Hypothesis, PlaceId, next_decision, next_errand, route,
};
use meetpoint_proto::v1;
use meetpoint_storage::{MapId, NewHypothesisDecision, SessionId};
use tokio::sync::OwnedMutexGuard;

use super::maps::shortened;
use super::page;
use crate::convert::{
    hypothesis, hypothesis_decision, hypothesis_graph, place_picture, session, slug,
};
use crate::hypotheses::{Assertion, Travelled, Tree, hypothesis_id};
use crate::{clock, error::Error, service::Service};

/// Batches read from the journal at once.
const N_BATCHES_A_PAGE: u32 = 64;
/// The name of the first of the maps where a graph or a path is asked for.
pub(super) const SIMPLEST: &str = "simplest";
/// Characters of a reason or an author.
const TEXT_LEN_MAX: usize = 200;

/// A tree that somebody asked for.
pub(super) struct Asked {
    map: MapId,
    pub(super) session: SessionId,
    /// With the session.
    name: v1::TreeName,
}

impl Service {
    /// A page of the maps that fit, and what to do to find out which is true.
    pub(crate) async fn list_hypotheses(
        &self,
        request: v1::ListHypothesesRequest,
    ) -> Result<v1::ListHypothesesResponse, Error> {
        let v1::ListHypothesesRequest { tree, page_size, page_token } = request;
        let asked = self.asked(tree).await?;
        let size = page::size(page_size, &self.settings.limits) as usize;
        let skipped = page::after(&page_token, |token| token.parse::<usize>().ok())?.unwrap_or(0);
        self.with_tree(asked, move |name, travelled, tree| {
            let maps = tree.maps().hypotheses();
            let page = maps.iter().enumerate().skip(skipped).take(size);
            let listed: Vec<_> =
                page.map(|ranked| hypothesis::hypothesis(travelled, tree, ranked)).collect();
            let end = skipped.saturating_add(listed.len());
            let decision = next_decision(maps);
            Ok(v1::ListHypothesesResponse {
                tree: Some(hypothesis::tree(name, travelled, tree)),
                hypotheses: listed,
                next_page_token: if end < maps.len() { end.to_string() } else { String::new() },
                difference: hypothesis::difference(tree),
                next_decision: decision
                    .map(|decision| hypothesis::decision(travelled, tree, decision)),
            })
        })
        .await
    }

    /// One map with its places and edges.
    pub(crate) async fn get_hypothesis(
        &self,
        request: v1::GetHypothesisRequest,
    ) -> Result<v1::GetHypothesisResponse, Error> {
        let v1::GetHypothesisRequest { tree, hypothesis: id, picture } = request;
        let asked = self.asked(tree).await?;
        self.with_tree(asked, move |name, travelled, tree| {
            let found @ (_, map) = found(travelled, tree, &id)?;
            let edges = edges(travelled, tree, map)?;
            let png = if picture { place_picture::png(map)? } else { Vec::new() };
            Ok(v1::GetHypothesisResponse {
                tree: Some(hypothesis::tree(name, travelled, tree)),
                hypothesis: Some(hypothesis::hypothesis(travelled, tree, found)),
                places: hypothesis::places(map, &edges),
                paths: hypothesis::paths(map),
                at_place: map.at.place.0,
                at_gateway: map.at.index.into(),
                agenda: hypothesis::agenda(map),
                frame: frame_if_any(tree.frame(map, &travelled.records()))?,
                regions: hypothesis::regions(map),
                png,
            })
        })
        .await
    }

    /// One map in the words of a graph of regions.
    pub(crate) async fn hypothesis_graph(
        &self,
        name: v1::TreeName,
        id: String,
    ) -> Result<v1::Graph, Error> {
        let id = if id == SIMPLEST { String::new() } else { id };
        let asked = self.asked(Some(name)).await?;
        self.with_tree(asked, move |name, travelled, tree| {
            let found @ (_, map) = found(travelled, tree, &id)?;
            let edges = edges(travelled, tree, map)?;
            let frame = tree.frame(map, &travelled.records())?;
            Ok(v1::Graph {
                map: name.map,
                hypothesis: hypothesis::hypothesis(travelled, tree, found).id,
                ..hypothesis_graph::to_wire(map, &frame, &edges)
            })
        })
        .await
    }

    /// Says that a map is true.
    pub(crate) async fn assert_hypothesis(
        &self,
        request: v1::AssertHypothesisRequest,
    ) -> Result<v1::AssertHypothesisResponse, Error> {
        let v1::AssertHypothesisRequest { tree, hypothesis: id, reason, author } = request;
        let [reason, author] = said_by(&reason, &author)?;
        let asked = self.asked(tree).await?;
        let (map, session, name) = (asked.map.clone(), asked.session, asked.name.clone());
        let assumptions = hypothesis::assumptions(&asked.name);
        let said = self
            .with_tree(asked, move |_, travelled, tree| {
                // Odometry may speak against the first of those that are not metrical.
                let id = if id.is_empty() {
                    let (_, first) = found(travelled, tree, &id)?;
                    hypothesis_id(travelled.session(), &tree.told(first))
                } else {
                    id
                };
                travelled.assertion(assumptions, &id)
            })
            .await?;
        if let Some(said) = said {
            let said = Assertion { reason, author, time_ns: clock::now_ns(), ..said };
            let payload = hypothesis_decision::asserted(session, &said)?;
            self.decide_hypothesis(map.clone(), payload).await?;
        }
        let tree = self.tree_of(Asked { map, session, name }).await?;
        Ok(v1::AssertHypothesisResponse { tree: Some(tree) })
    }

    /// Takes back that a map is true.
    pub(crate) async fn undo_hypothesis(
        &self,
        request: v1::UndoHypothesisRequest,
    ) -> Result<v1::UndoHypothesisResponse, Error> {
        let v1::UndoHypothesisRequest { tree, hypothesis: id, reason, author } = request;
        let said_by = said_by(&reason, &author)?;
        let Asked { map, session, name } = self.asked(tree).await?;
        let decisions = self.store.hypothesis_decisions(&map).await?;
        let said = hypothesis_decision::said(session, &decisions)?;
        let last = said.in_force.last().map(|last| last.hypothesis.clone());
        let id = if id.is_empty() { last.unwrap_or_default() } else { id };
        if said.in_force.iter().any(|known| known.hypothesis == id) {
            let time_ns = clock::now_ns();
            let payload = hypothesis_decision::undone(session, &id, said_by, time_ns);
            self.decide_hypothesis(map.clone(), payload).await?;
        } else if !said.undone.contains(&id) {
            return Err(Error::HypothesisNotAsserted(shortened(&id)));
        }
        let tree = self.tree_of(Asked { map, session, name }).await?;
        Ok(v1::UndoHypothesisResponse { tree: Some(tree) })
    }

    /// The best way between two places of a map.
    pub(crate) async fn plan_travel(
        &self,
        request: v1::PlanTravelRequest,
    ) -> Result<v1::PlanTravelResponse, Error> {
        let v1::PlanTravelRequest { tree, hypothesis: id, from_place, to_place } = request;
        let asked = self.asked(tree).await?;
        self.with_tree(asked, move |name, travelled, tree| {
            let found @ (_, map) = found(travelled, tree, &id)?;
            let edges = edges(travelled, tree, map)?;
            let from = from_place.map_or(map.at.place, PlaceId);
            let cost = |gateway: Gateway| match edges.leaving(gateway) {
                Some(edge) if edges.have_lengths() => edge.length_m.unwrap_or(0.0),
                _ => 1.0,
            };
            let way = route(&map.map, from, PlaceId(to_place), cost);
            let is_here = from == map.at.place;
            let came_in = if is_here { map.at } else { Gateway { place: from, index: 0 } };
            let code = match way {
                Some(_) => v1::TravelPlanCode::Ok,
                None => v1::TravelPlanCode::PlaceUnknown,
            };
            let way = way.unwrap_or_default();
            let legs = hypothesis::legs(map, &edges, (came_in, &way));
            let is_known = code == v1::TravelPlanCode::Ok;
            let lengths_m: Option<Vec<f64>> = legs.iter().map(|leg| leg.length_m).collect();
            Ok(v1::PlanTravelResponse {
                hypothesis: hypothesis::hypothesis(travelled, tree, found).id,
                tree: Some(hypothesis::tree(name, travelled, tree)),
                code: code.into(),
                length_m: lengths_m.filter(|_| is_known).map(|lengths_m| lengths_m.iter().sum()),
                legs,
            })
        })
        .await
    }

    /// What a robot is to do next.
    pub(crate) async fn get_next_travel(
        &self,
        request: v1::GetNextTravelRequest,
    ) -> Result<v1::GetNextTravelResponse, Error> {
        let v1::GetNextTravelRequest { tree, selection } = request;
        let selection = hypothesis::selection(selection)?;
        let asked = self.asked(tree).await?;
        self.with_tree(asked, move |name, travelled, tree| {
            let errand = next_errand(tree.maps(), selection);
            let told = hypothesis::errand(errand, tree.maps().hypotheses().first());
            let tree = Some(hypothesis::tree(name, travelled, tree));
            Ok(v1::GetNextTravelResponse { tree, ..told })
        })
        .await
    }

    /// What a request names: the map's last travelled session if it names none.
    pub(super) async fn asked(&self, name: Option<v1::TreeName>) -> Result<Asked, Error> {
        let name = name.ok_or_else(|| Error::field("tree", "missing"))?;
        let map = self.map_record(&name.map).await?.id;
        let session = if name.session.is_empty() {
            let last = self.store.travelled_session(&map).await?;
            last.ok_or_else(|| Error::NothingTravelled(map.0.clone()))?
        } else {
            let id = session::id("session", &name.session)?;
            let record = self.store.session(id).await?.filter(|record| record.map == map);
            record.ok_or_else(|| Error::NoSuchSession(shortened(&name.session)))?.id
        };
        let name = v1::TreeName { session: session.0.to_string(), ..name };
        Ok(Asked { map, session, name })
    }

    /// A tree, and nothing of its maps.
    async fn tree_of(&self, asked: Asked) -> Result<v1::HypothesisTree, Error> {
        self.with_tree(asked, |name, travelled, tree| Ok(hypothesis::tree(name, travelled, tree)))
            .await
    }

    /// Answers from the tree that was asked for, brought up to the journal: beside the async threads,
    /// since it may take seconds after a start.
    pub(super) async fn with_tree<T: Send + 'static>(
        &self,
        asked: Asked,
        answer: impl FnOnce(v1::TreeName, &Travelled, &Tree) -> Result<T, Error> + Send + 'static,
    ) -> Result<T, Error> {
        let mut travelled = self.travelled(&asked).await?;
        let Asked { map, session, name } = asked;
        let _permit = self.travels.growing.acquire().await.map_err(|_| Error::Stopping)?;
        let answering = tokio::task::spawn_blocking(move || {
            let assumptions = hypothesis::assumptions(&name);
            travelled.grow(assumptions);
            let nothing = || Error::NothingTravelled(map.0.clone());
            let tree = travelled.tree(assumptions).ok_or_else(nothing)?;
            if name.metrical {
                let tree = tree.metrical(&travelled.records())?;
                return answer(name, &travelled, &tree);
            }
            answer(name, &travelled, tree)
        });
        answering.await.map_err(|error| {
            // It may have ended halfway.
            self.travels.forget(session);
            Error::internal(error)
        })?
    }

    /// A session's travel, brought up to the journal.
    pub(super) async fn travelled(
        &self,
        asked: &Asked,
    ) -> Result<OwnedMutexGuard<Travelled>, Error> {
        let Asked { map, session, name } = asked;
        // One after the other, and who waits for that keeps no other query waiting.
        let kept = self.travels.of(*session, &self.settings.hypotheses);
        let mut travelled = kept.lock_owned().await;
        loop {
            let after = travelled.read_through();
            let batches = self.store.visit_batches(*session, after, N_BATCHES_A_PAGE).await?;
            batches.iter().try_for_each(|batch| travelled.read(batch))?;
            if batches.len() < N_BATCHES_A_PAGE as usize {
                break;
            }
        }
        if !travelled.is_told() {
            travelled.follow(self.arrivals(&name.session).await?);
        }
        let decisions = self.store.hypothesis_decisions(map).await?;
        travelled.set_assertions(hypothesis_decision::said(*session, &decisions)?.in_force);
        Ok(travelled)
    }

    async fn decide_hypothesis(&self, map: MapId, payload: Vec<u8>) -> Result<(), Error> {
        let new = NewHypothesisDecision { map, payload, time_ns: clock::now_ns() };
        self.store.decide_hypothesis(&new).await?;
        // The journal has grown by this decision.
        self.actors.wake(&new.map);
        Ok(())
    }
}

fn said_by(reason: &str, author: &str) -> Result<[String; 2], Error> {
    Ok([slug::text("reason", reason, TEXT_LEN_MAX)?, slug::text("author", author, TEXT_LEN_MAX)?])
}

/// The map of that id with its rank, or the first.
pub(super) fn found<'a>(
    travelled: &Travelled,
    tree: &'a Tree,
    id: &str,
) -> Result<(usize, &'a Hypothesis), Error> {
    let found = tree.find(travelled.session(), id);
    found.ok_or_else(|| Error::NoSuchHypothesis(shortened(id)))
}

/// A frame, or none where odometry cannot say or it were too much work.
fn frame_if_any(
    frame: Result<ConsistentFrame, Error>,
) -> Result<Option<v1::HypothesisFrame>, Error> {
    match frame {
        Ok(frame) => Ok(Some(hypothesis::frame(&frame))),
        Err(Error::TravelNotMeasured | Error::TravelTooLarge { .. }) => Ok(None),
        Err(error) => Err(error),
    }
}

/// What was measured along the edges of one of a tree's maps.
pub(super) fn edges(
    travelled: &Travelled,
    tree: &Tree,
    map: &Hypothesis,
) -> Result<EdgeRecords, Error> {
    let edges = EdgeRecords::new(map, tree.maps().travel(), &travelled.records());
    edges.ok_or_else(|| Error::internal("a map that does not fit its own travel"))
}
