//! `/v1/maps/{map}/hypotheses`: every map of places that fits a travel, and what people decide about it.

use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use meetpoint_proto::v1;
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use super::Rest;
use super::hypothesis_frame::HypothesisFrame;
use super::hypothesis_tree::{Hypothesis, HypothesisPlace, HypothesisTree, Rehearsal};
use super::maps::MapPath;
use super::openapi::{ChangeProblems, ReadProblems};
use super::problem::Refusal;
use super::reply::{filled, ok};
use super::request::{JsonBody, Path, Query};

/// The path's name for the first of the maps.
const SIMPLEST: &str = "simplest";
/// The path's name for the last that was asserted.
const LAST: &str = "last";

/// Whose travel is meant, and what is taken for granted about the building.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct TreeQuery {
    /// Id of the session; absent or empty for the one that was opened last of those that told of visits.
    #[serde(default)]
    pub(super) session: String,
    /// No two ways cross but at places: no bridges, no stairs.
    #[serde(default)]
    pub(super) planar: bool,
    /// Ways may come back to a place that they pass: corridors in a circle.
    #[serde(default)]
    pub(super) circles: bool,
    /// Maps whose places cannot lie in one frame as odometry says (`moved` of visits) are left out.
    #[serde(default)]
    pub(super) metrical: bool,
}

/// As messages name it.
pub(super) fn tree(map: String, query: TreeQuery) -> v1::TreeName {
    let TreeQuery { session, planar, circles, metrical } = query;
    v1::TreeName { map, session, planar, circles, metrical }
}

/// Which maps are asked for.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct HypothesesQuery {
    /// Id of the session; absent or empty for the one that was opened last of those that told of visits.
    #[serde(default)]
    session: String,
    /// No two ways cross but at places: no bridges, no stairs.
    #[serde(default)]
    planar: bool,
    /// Ways may come back to a place that they pass: corridors in a circle.
    #[serde(default)]
    circles: bool,
    /// Maps whose places cannot lie in one frame as odometry says (`moved` of visits) are left out.
    #[serde(default)]
    metrical: bool,
    /// Rows wanted: 0 or absent for the default of 100; cut at 1000.
    #[serde(default)]
    #[param(minimum = 0, maximum = 4_294_967_295_u32, example = 100)]
    page_size: u32,
    /// The previous reply's `next_page_token`; absent or empty for the first page. Holds until the next
    /// visit or decision.
    #[serde(default)]
    #[param(example = "")]
    page_token: String,
}

/// How a map of places is answered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub(crate) enum HypothesisFormat {
    #[default]
    Json,
    /// A drawing: places as numbered dots, the robot's red, ways that nobody has gone as short lines.
    /// Places lie where they are best told apart, not where they are in the building.
    Png,
}

/// How one map is asked for.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct HypothesisQuery {
    /// Id of the session; absent or empty for the one that was opened last of those that told of visits.
    #[serde(default)]
    session: String,
    /// No two ways cross but at places: no bridges, no stairs.
    #[serde(default)]
    planar: bool,
    /// Ways may come back to a place that they pass: corridors in a circle.
    #[serde(default)]
    circles: bool,
    /// Maps whose places cannot lie in one frame as odometry says (`moved` of visits) are left out.
    #[serde(default)]
    metrical: bool,
    /// JSON if absent.
    #[serde(default)]
    #[param(inline)]
    format: HypothesisFormat,
}

/// Names a map of places.
#[derive(Debug, Deserialize, IntoParams)]
#[into_params(parameter_in = Path)]
pub(crate) struct HypothesisPath {
    /// Id of the map.
    #[param(example = "intel")]
    map: String,
    /// Id of the hypothesis, or `simplest` for the first.
    #[param(example = "simplest")]
    hypothesis: String,
}

impl HypothesisPath {
    /// The map, and the hypothesis as messages name it.
    pub(super) fn named(self) -> (String, String) {
        let Self { map, hypothesis } = self;
        (map, named(hypothesis))
    }
}

/// A hypothesis as messages name it.
pub(super) fn named(hypothesis: String) -> String {
    if hypothesis == SIMPLEST { String::new() } else { hypothesis }
}

/// Why something is said of a map, and who says so.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct HypothesisReason {
    /// For people, up to 200 characters.
    #[serde(default)]
    reason: String,
    /// For people, up to 200 characters.
    #[serde(default)]
    author: String,
}

/// The first visit of which the two simplest maps say different things.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct HypothesisDifference {
    /// Which visit.
    visit: u32,
    /// The earliest visit to the same place as the simplest map says; the visit itself where the place
    /// was new.
    first_visit: u32,
    /// The same as the other map says.
    other_first_visit: u32,
}

/// A page of maps, the simplest first, and what to do to find out which is true.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct HypothesisList {
    tree: HypothesisTree,
    /// The simplest first.
    hypotheses: Vec<Hypothesis>,
    /// Empty on the last page.
    next_page_token: String,
    /// What tells the two simplest maps apart; absent if there is only one.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    difference: Option<HypothesisDifference>,
    /// The travel that would refute one of two maps; absent if nothing but exploring helps.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    next_decision: Option<Rehearsal>,
}

impl From<v1::ListHypothesesResponse> for HypothesisList {
    fn from(wire: v1::ListHypothesesResponse) -> Self {
        let v1::ListHypothesesResponse {
            tree,
            hypotheses,
            next_page_token,
            difference,
            next_decision,
        } = wire;
        let difference = difference.map(|wire| {
            let v1::HypothesisDifference { visit, first_visit, other_first_visit } = wire;
            HypothesisDifference { visit, first_visit, other_first_visit }
        });
        Self {
            tree: tree.unwrap_or_default().into(),
            hypotheses: hypotheses.into_iter().map(Hypothesis::from).collect(),
            next_page_token,
            difference,
            next_decision: next_decision.map(Rehearsal::from),
        }
    }
}

/// A gateway that nobody has been through.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct AgendaItem {
    place: u32,
    gateway: u32,
    /// Turns, each followed by a travel, from where the robot is now to beyond the gateway.
    turns: Vec<u32>,
}

/// The regions that a path bounds, as sets of places; a place that nobody travelled to without the path is in
/// none.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct BoundaryRegions {
    /// Places to the right of one who goes along the path as it is listed.
    right: Vec<u32>,
    /// Places to the left.
    left: Vec<u32>,
    /// Places on neither side, since one comes to them from both: around an end of the path, or over a bridge.
    around: Vec<u32>,
}

/// A map of places.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct HypothesisDetail {
    tree: HypothesisTree,
    hypothesis: Hypothesis,
    /// In the order of their numbers.
    places: Vec<HypothesisPlace>,
    /// Paths, each as its places in order: along them one goes straight on.
    paths: Vec<Vec<u32>>,
    /// One for each of `paths`.
    regions: Vec<BoundaryRegions>,
    /// The place where the robot is by this map.
    at_place: u32,
    /// The gateway where it came in.
    at_gateway: u32,
    /// Gateways that nobody has been through, the nearest first.
    agenda: Vec<AgendaItem>,
    /// Where places lie by odometry; absent unless every visit but the first has `moved`, and of too large a
    /// map (more than 100 million visits times places squared).
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    frame: Option<HypothesisFrame>,
}

/// The maps of places that fit a travel.
///
/// They are made of the visits that a session told of and of what people decided, and of nothing else.
/// While `truncated` is false the true map is among them, as far as it was travelled and if what is assumed
/// holds. `NOTHING_TRAVELLED` where no visit was told of.
#[utoipa::path(
    get,
    path = "/v1/maps/{map}/hypotheses",
    tag = "hypotheses",
    params(MapPath, HypothesesQuery),
    responses((status = 200, description = "A page of maps.", body = HypothesisList), ReadProblems)
)]
pub(super) async fn list_hypotheses(
    State(rest): State<Rest>,
    Path(path): Path<MapPath>,
    Query(query): Query<HypothesesQuery>,
) -> Result<Response, Refusal> {
    let HypothesesQuery { session, planar, circles, metrical, page_size, page_token } = query;
    let tree = Some(tree(path.map, TreeQuery { session, planar, circles, metrical }));
    let request = v1::ListHypothesesRequest { tree, page_size, page_token };
    let told = rest.service.list_hypotheses(request).await?;
    Ok(ok(&HypothesisList::from(told)))
}

/// A map of places: what leads where, and what nobody has seen.
#[utoipa::path(
    get,
    path = "/v1/maps/{map}/hypotheses/{hypothesis}",
    tag = "hypotheses",
    params(HypothesisPath, HypothesisQuery),
    responses(
        (status = 200, description = "The map.", content(
            (HypothesisDetail = "application/json"),
            (Vec<u8> = "image/png"),
        )),
        ReadProblems,
    )
)]
pub(super) async fn get_hypothesis(
    State(rest): State<Rest>,
    Path(path): Path<HypothesisPath>,
    Query(query): Query<HypothesisQuery>,
) -> Result<Response, Refusal> {
    let HypothesisQuery { session, planar, circles, metrical, format } = query;
    let (map, hypothesis) = path.named();
    let tree = Some(tree(map, TreeQuery { session, planar, circles, metrical }));
    let picture = format == HypothesisFormat::Png;
    let request = v1::GetHypothesisRequest { tree, hypothesis, picture };
    let v1::GetHypothesisResponse {
        tree,
        hypothesis,
        places,
        at_place,
        at_gateway,
        agenda,
        png,
        paths,
        frame,
        regions,
    } = rest.service.get_hypothesis(request).await?;
    if picture {
        return Ok(([(header::CONTENT_TYPE, "image/png")], png).into_response());
    }
    let agenda = agenda.into_iter().map(|wire| {
        let v1::AgendaItem { place, gateway, turns } = wire;
        AgendaItem { place, gateway, turns }
    });
    let (tree, hypothesis) = (filled(tree, "tree")?, filled(hypothesis, "hypothesis")?);
    let link = place_link(tree.name.clone().unwrap_or_default(), &hypothesis.id);
    let place = |wire| HypothesisPlace::linked(wire, &link);
    let bounded = |wire: v1::BoundaryRegions| {
        let v1::BoundaryRegions { right, left, around } = wire;
        BoundaryRegions { right, left, around }
    };
    Ok(ok(&HypothesisDetail {
        tree: tree.into(),
        hypothesis: hypothesis.into(),
        places: places.into_iter().map(place).collect(),
        regions: regions.into_iter().map(bounded).collect(),
        paths: paths.into_iter().map(|v1::HypothesisPath { places }| places).collect(),
        at_place,
        at_gateway,
        agenda: agenda.collect(),
        frame: frame.map(HypothesisFrame::from),
    }))
}

/// Where what was seen of a hypothesis's places is, but for their numbers: path and query.
fn place_link(tree: v1::TreeName, hypothesis: &str) -> [String; 2] {
    let v1::TreeName { map, session, planar, circles, metrical } = tree;
    let path = format!("/v1/maps/{map}/hypotheses/{hypothesis}/places");
    [path, format!("session={session}&planar={planar}&circles={circles}&metrical={metrical}")]
}

/// Says that a map is true.
///
/// The others are ruled out, and so is what they would have become. Asserting what is asserted changes
/// nothing. `HYPOTHESIS_NOT_FOUND` if it does not fit, or not any more.
#[utoipa::path(
    post,
    path = "/v1/maps/{map}/hypotheses/{hypothesis}/assert",
    tag = "hypotheses",
    params(HypothesisPath, TreeQuery),
    request_body = HypothesisReason,
    responses((status = 200, description = "The tree as it is now.", body = HypothesisTree), ChangeProblems)
)]
pub(super) async fn assert_hypothesis(
    State(rest): State<Rest>,
    Path(path): Path<HypothesisPath>,
    Query(query): Query<TreeQuery>,
    body: JsonBody<HypothesisReason>,
) -> Result<Response, Refusal> {
    let HypothesisReason { reason, author } = body.value;
    let (map, hypothesis) = path.named();
    let tree = Some(tree(map, query));
    let request = v1::AssertHypothesisRequest { tree, hypothesis, reason, author };
    let v1::AssertHypothesisResponse { tree } = rest.service.assert_hypothesis(request).await?;
    Ok(ok(&HypothesisTree::from(filled(tree, "tree")?)))
}

/// Takes back that a map is true, at any later time.
///
/// The maps are what they would be without. Undoing what is undone changes nothing. `last` stands for the
/// one that was asserted last and not taken back. `HYPOTHESIS_NOT_ASSERTED` if it never was.
#[utoipa::path(
    post,
    path = "/v1/maps/{map}/hypotheses/{hypothesis}/undo",
    tag = "hypotheses",
    params(HypothesisPath, TreeQuery),
    request_body = HypothesisReason,
    responses((status = 200, description = "The tree as it is now.", body = HypothesisTree), ChangeProblems)
)]
pub(super) async fn undo_hypothesis(
    State(rest): State<Rest>,
    Path(path): Path<HypothesisPath>,
    Query(query): Query<TreeQuery>,
    body: JsonBody<HypothesisReason>,
) -> Result<Response, Refusal> {
    let HypothesisReason { reason, author } = body.value;
    let HypothesisPath { map, hypothesis } = path;
    let hypothesis = if hypothesis == LAST { String::new() } else { hypothesis };
    let tree = Some(tree(map, query));
    let request = v1::UndoHypothesisRequest { tree, hypothesis, reason, author };
    let v1::UndoHypothesisResponse { tree } = rest.service.undo_hypothesis(request).await?;
    Ok(ok(&HypothesisTree::from(filled(tree, "tree")?)))
}
