//! Paths on maps of places, in the words of paths on map versions.

use std::time::Instant;

use meetpoint_places::{ConsistentFrame, EdgeRecords, Gateway, Hypothesis, PlaceId, route};
use meetpoint_proto::v1;

use super::hypotheses::{SIMPLEST, edges, found};
use crate::convert::plan::micros;
use crate::convert::{hypothesis, hypothesis_graph};
use crate::{error::Error, service::Service};

/// Longer than any travel is: what an edge costs of which nothing is known, in metres, so that it is taken only
/// where there is no other way.
const UNKNOWN_EDGE_M: f64 = 1e9;

impl Service {
    /// The shortest path between two places of a hypothesis.
    pub(super) async fn plan_path_of_places(
        &self,
        request: v1::PlanPathRequest,
    ) -> Result<v1::PlanPathResponse, Error> {
        check_nothing_else(&request)?;
        let v1::PlanPathRequest { map, hypothesis: id, tree, from_place, to_place, .. } = request;
        let id = if id == SIMPLEST { String::new() } else { id };
        let asked = self.asked(Some(v1::TreeName { map, ..tree.unwrap_or_default() })).await?;
        let begun = Instant::now();
        self.with_tree(asked, move |name, travelled, tree| {
            let of @ (_, map) = found(travelled, tree, &id)?;
            let edges = edges(travelled, tree, map)?;
            // Without a common frame there are no points, and yet there may be lengths.
            let frame = tree.frame(map, &travelled.records());
            let no_points = frame.as_ref().err().map(|why| format!("no points are known: {why}"));
            let frame = frame.ok();
            let ends = [from_place, to_place].map(|end| end.map_or(map.at.place, PlaceId));
            let path = path(map, ends, frame.as_ref(), &edges)?;
            let basis = v1::PlanBasis {
                map: name.map,
                answered_by: v1::AnsweredBy::Places.into(),
                hypothesis: hypothesis::hypothesis(travelled, tree, of).id,
                ..v1::PlanBasis::default()
            };
            let reply = v1::PlanPathResponse {
                basis: Some(basis),
                warnings: no_points.into_iter().collect(),
                planning_time_us: micros(begun.elapsed()),
                ..v1::PlanPathResponse::default()
            };
            Ok(match path {
                Ok(path) => v1::PlanPathResponse {
                    code: v1::PlanCode::Ok.into(),
                    path: Some(path),
                    ..reply
                },
                Err((code, what_to_do)) => {
                    v1::PlanPathResponse { code: code.into(), what_to_do, ..reply }
                }
            })
        })
        .await
    }
}

/// A path, or what is true of an end that is no place of the map.
type Answer = Result<v1::PlannedPath, (v1::PlanCode, String)>;

/// # Errors
/// [`Error::TravelNotMeasured`] if no path is known all edges of which have a length.
fn path(
    map: &Hypothesis,
    [from, to]: [PlaceId; 2],
    frame: Option<&ConsistentFrame>,
    edges: &EdgeRecords,
) -> Result<Answer, Error> {
    for (code, place) in [(v1::PlanCode::StartUnknown, from), (v1::PlanCode::GoalUnknown, to)] {
        if map.map.place(place).is_none() {
            let n_places = map.map.n_places();
            let what_to_do =
                format!("there is no place {}: this map has {n_places}, from 0 on", place.0);
            return Ok(Err((code, what_to_do)));
        }
    }
    let cost_m = |from: Gateway| {
        let length_m = map
            .map
            .leads_to(from)
            .and_then(|to| hypothesis_graph::length_m(from, to, frame, edges));
        length_m.unwrap_or(UNKNOWN_EDGE_M)
    };
    let Some(legs) = route(&map.map, from, to, cost_m) else {
        return Ok(Err((
            v1::PlanCode::NoRoute,
            "nobody has travelled from there to here".to_owned(),
        )));
    };
    let path = hypothesis_graph::path(map, (from, &legs), frame, edges);
    path.ok_or(Error::TravelNotMeasured).map(Ok)
}

/// Refuses what has no meaning where there is no grid, and would be overlooked.
fn check_nothing_else(request: &v1::PlanPathRequest) -> Result<(), Error> {
    let v1::PlanPathRequest {
        map: _,
        start,
        goal,
        robot,
        mode,
        alternatives,
        map_version,
        route_only: _,
        cells,
        hypothesis: _,
        tree: _,
        from_place: _,
        to_place: _,
    } = request;
    let is_exact = [v1::PlanMode::Unspecified, v1::PlanMode::Exact].map(i32::from).contains(mode);
    let given = [
        ("start", start.is_some()),
        ("goal", goal.is_some()),
        ("robot", robot.is_some()),
        ("mode", !is_exact),
        ("alternatives", *alternatives != 0),
        ("map_version", *map_version != 0),
        ("cells", *cells),
    ];
    match given.into_iter().find(|(_, is_given)| *is_given) {
        Some((name, _)) => {
            let problem = "not together with `hypothesis`: it has places, no grid and no versions";
            Err(Error::field(name, problem))
        }
        None => Ok(()),
    }
}
