//! A tree of maps of places and its maps, in JSON.

use meetpoint_proto::v1;
use serde::Serialize;
use utoipa::ToSchema;

use super::integer::{Signed64, Unsigned64};

/// All maps of places that fit a travel.
#[derive(Debug, Serialize, ToSchema)]
#[expect(
    clippy::struct_excessive_bools,
    reason = "each is a word of the question, and of the wire"
)]
pub(crate) struct HypothesisTree {
    /// Id of the map.
    map: String,
    /// Id of the session whose travel it is.
    session: String,
    /// Whether it was assumed that no two ways cross but at places.
    planar: bool,
    /// Whether ways were allowed to come back to a place that they pass.
    circles: bool,
    /// Whether maps were left out whose places cannot lie in one frame as odometry says.
    metrical: bool,
    /// Visits that it is made of: the number of the next one.
    visits: u32,
    /// Visits that were told of and are not in it.
    visits_left_out: u32,
    /// Why the last of these is not, for people; absent if there are none.
    #[serde(skip_serializing_if = "String::is_empty")]
    left_out_reason: String,
    /// Maps that fit. None if something was seen, assumed or asserted wrongly, or if `truncated`.
    consistent: u32,
    /// Those of them that are simplest: of the fewest places and, among these, paths.
    minimal: u32,
    /// Maps that fitted and were ruled out by what people said.
    ruled_out: Unsigned64,
    /// Maps that were given up for want of memory, each with all that it would have become.
    given_up: Unsigned64,
    /// Whether any was: then the true one may be missing, which is else among those that fit.
    truncated: bool,
    /// What people said of it, in order; what was taken back is left out.
    assertions: Vec<HypothesisAssertion>,
    /// Maps that fit but for odometry, and are left out, where the tree is metrical.
    contradicted: Unsigned64,
    /// Whether the tree was to be metrical and visits are without odometry.
    unmeasured: bool,
    /// Whether the session told of no visits, and these are read from its firings: of a robot that is told step by
    /// step.
    by_steps: bool,
}

impl From<v1::HypothesisTree> for HypothesisTree {
    fn from(wire: v1::HypothesisTree) -> Self {
        let v1::HypothesisTree {
            name,
            visits,
            visits_left_out,
            left_out_reason,
            consistent,
            minimal,
            ruled_out,
            given_up,
            truncated,
            assertions,
            contradicted,
            unmeasured,
            by_steps,
        } = wire;
        let v1::TreeName { map, session, planar, circles, metrical } = name.unwrap_or_default();
        Self {
            map,
            session,
            planar,
            circles,
            metrical,
            visits,
            visits_left_out,
            left_out_reason,
            consistent,
            minimal,
            ruled_out: Unsigned64(ruled_out),
            given_up: Unsigned64(given_up),
            truncated,
            assertions: assertions.into_iter().map(HypothesisAssertion::from).collect(),
            contradicted: Unsigned64(contradicted),
            unmeasured,
            by_steps,
        }
    }
}

/// That somebody said that a map is true.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct HypothesisAssertion {
    /// Id of the hypothesis.
    hypothesis: String,
    /// The visits that it is of.
    visits: u32,
    /// Whether the tree rests on it: not if it does not hold what is assumed in it.
    in_force: bool,
    /// Why, for people.
    reason: String,
    /// Who said so, for people.
    author: String,
    /// By the service's clock.
    time_ns: Signed64,
}

impl From<v1::HypothesisAssertion> for HypothesisAssertion {
    fn from(wire: v1::HypothesisAssertion) -> Self {
        let v1::HypothesisAssertion { hypothesis, visits, in_force, reason, author, time_ns } =
            wire;
        Self { hypothesis, visits, in_force, reason, author, time_ns: Signed64(time_ns) }
    }
}

/// A map that fits a travel.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Hypothesis {
    /// The visits that it fits, and what it says of them: the same whatever else is assumed. After the
    /// next visit it is another map with another id.
    #[schema(example = "14-9f3c2a71d05be6aa")]
    id: String,
    /// 1 for the simplest; of maps that are equally simple for the oldest.
    rank: u32,
    /// Whether none is simpler.
    minimal: bool,
    /// Number of places.
    places: u32,
    /// Number of edges between them.
    edges: u32,
    /// Number of paths: those that are not known to be one count as several.
    paths: u32,
    /// Number of gateways that nobody has been through.
    unexplored: u32,
    /// The place of each visit, by its number: places are numbered from 0 by first visit.
    visits: Vec<u32>,
}

impl From<v1::Hypothesis> for Hypothesis {
    fn from(wire: v1::Hypothesis) -> Self {
        let v1::Hypothesis { id, rank, minimal, places, edges, paths, unexplored, visits } = wire;
        Self { id, rank, minimal, places, edges, paths, unexplored, visits }
    }
}

/// A travel that tells two maps apart.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Rehearsal {
    /// Id of the simplest.
    hypothesis: String,
    /// Id of the other.
    other_hypothesis: String,
    /// Turns, each followed by a travel, from where the robot is now: gateways clockwise from the one
    /// where it came in.
    turns: Vec<u32>,
    /// What the simplest map says that will be seen at the end, as a star and a view; empty where it knows
    /// nothing of that.
    #[schema(example = "aba@hall")]
    expected: String,
    /// What the other says.
    #[schema(example = "abab")]
    other_expected: String,
}

impl From<v1::HypothesisDecision> for Rehearsal {
    fn from(wire: v1::HypothesisDecision) -> Self {
        let v1::HypothesisDecision {
            hypothesis,
            other_hypothesis,
            turns,
            expected,
            other_expected,
        } = wire;
        Self { hypothesis, other_hypothesis, turns, expected, other_expected }
    }
}

/// A place of a map.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct HypothesisPlace {
    /// From 0, by first visit.
    number: u32,
    /// Its gateways in clockwise order from the one of the first visit, as in a `place_visit`.
    #[schema(example = "aba")]
    star: String,
    /// Its looks; empty where nobody compared them.
    view: String,
    /// Whether no other place has them.
    view_is_unique: bool,
    /// In the order of the star.
    gateways: Vec<HypothesisGateway>,
    /// Where what was seen of it is: its local map, gateways and stars; `&format=png` behind it for a picture.
    #[schema(example = "/v1/maps/intel/hypotheses/14-9f3c2a71d05be6aa/places/3?session=0199")]
    local_map: String,
}

impl HypothesisPlace {
    /// With the path before its number and the query behind it.
    pub(super) fn linked(wire: v1::HypothesisPlace, [path, query]: &[String; 2]) -> Self {
        let v1::HypothesisPlace { number, star, view, view_is_unique, gateways } = wire;
        let gateways = gateways.into_iter().map(HypothesisGateway::from).collect();
        let local_map = format!("{path}/{number}?{query}");
        Self { number, star, view, view_is_unique, gateways, local_map }
    }
}

/// A gateway of a place.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct HypothesisGateway {
    /// The place that it leads to; absent where nobody has been through.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    to_place: Option<u32>,
    /// The gateway of that place where one comes in; absent likewise.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    to_gateway: Option<u32>,
    /// Mean length of the way, in metres, over the travels either way that told it; absent if none did.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    length_m: Option<f64>,
    /// By how much the heading changes on the way in the mean, radians counter-clockwise; absent if nobody
    /// told.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    turned_rad: Option<f64>,
    /// Travels along it, either way.
    travels: u32,
}

impl From<v1::HypothesisGateway> for HypothesisGateway {
    fn from(wire: v1::HypothesisGateway) -> Self {
        let v1::HypothesisGateway { to_place, to_gateway, length_m, turned_rad, travels } = wire;
        let to_gateway = to_place.map(|_| to_gateway);
        Self { to_place, to_gateway, length_m, turned_rad, travels }
    }
}
