//! `/v1/maps/{map}/costs`.

use axum::extract::State;
use axum::http::StatusCode;
use axum::response::Response;
use meetpoint_proto::v1;
use meetpoint_storage::ContentHash;
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use super::Rest;
use super::geometry::Point;
use super::idempotency::{Creation, IdempotencyKey, Reply, once};
use super::integer::{Signed64, Unsigned64};
use super::maps::MapPath;
use super::openapi::{ChangeProblems, CreationProblems, ReadProblems};
use super::problem::Refusal;
use super::reply::{filled, ok};
use super::request::{JsonBody, Path, Query, only_one};
use crate::error::Error;

const CREATION: Creation =
    Creation { route: "POST /v1/maps/{map}/costs", collection: None, id: "/id" };

/// Who says so.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
pub(crate) enum Origin {
    /// A person.
    #[default]
    Operator,
    /// A rule, by what robots observed.
    Evidence,
}

impl From<Origin> for i32 {
    fn from(origin: Origin) -> Self {
        match origin {
            Origin::Operator => v1::CostOrigin::Operator.into(),
            Origin::Evidence => v1::CostOrigin::Evidence.into(),
        }
    }
}

/// What is in force on a map was changed, or its profiles.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct CostsChanged {
    /// Id of the map.
    map: String,
    /// From now on answers are computed from this one or a later one.
    cost_revision: Unsigned64,
}

impl From<v1::CostsChanged> for CostsChanged {
    fn from(wire: v1::CostsChanged) -> Self {
        let v1::CostsChanged { map, cost_revision } = wire;
        Self { map, cost_revision: Unsigned64(cost_revision) }
    }
}

/// What crossing an arc costs beyond its length.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Toll {
    /// Id of the arc.
    arc: Unsigned64,
    /// Metres of free travel, above 0 up to 10 000.
    toll_m: f64,
}

/// Something that no sensor sees and no robot gets through: one of a polygon and a line.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Obstacle {
    /// 3 to 1000 points in the map's frame, the first not repeated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    polygon: Option<Vec<Point>>,
    /// 2 to 1000 points in the map's frame.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    polyline: Option<Vec<Point>>,
    /// Of the line, in metres, 0 to 100.
    #[serde(default, skip_serializing_if = "is_zero")]
    width_m: f64,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks for a reference")]
fn is_zero(width_m: &f64) -> bool {
    *width_m == 0.0
}

/// An area that is dearer to go through, or slower.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Zone {
    /// 3 to 1000 points in the map's frame, the first not repeated.
    polygon: Vec<Point>,
    /// A metre inside costs as much as so many outside, 1 to 8.
    #[schema(minimum = 1.0, maximum = 8.0)]
    factor: f64,
}

/// Something in force on a map: a closed arc, a toll, an obstacle or a zone.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Cost {
    id: String,
    /// Id of an arc that is not crossed.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    closed_arc: Option<Unsigned64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    toll: Option<Toll>,
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    obstacle: Option<Obstacle>,
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    zone: Option<Zone>,
    /// For people: why.
    reason: String,
    /// For people: who says so.
    author: String,
    origin: Origin,
    /// Since which revision it is in force.
    cost_revision: Unsigned64,
    /// The service's clock, nanoseconds since 1970.
    create_time_ns: Signed64,
    /// Chosen by the caller; absent for none.
    #[serde(skip_serializing_if = "String::is_empty")]
    client_key: String,
}

fn points(points: Vec<v1::Point>) -> Vec<Point> {
    points.into_iter().map(Point::from).collect()
}

impl From<v1::Cost> for Cost {
    fn from(wire: v1::Cost) -> Self {
        use v1::cost::Kind;
        let origin = match wire.origin() {
            v1::CostOrigin::Unspecified | v1::CostOrigin::Operator => Origin::Operator,
            v1::CostOrigin::Evidence => Origin::Evidence,
        };
        let v1::Cost {
            id,
            kind,
            reason,
            author,
            origin: _,
            cost_revision,
            create_time_ns,
            client_key,
        } = wire;
        let (mut closed_arc, mut toll, mut obstacle, mut zone) = (None, None, None, None);
        match kind {
            Some(Kind::Closure(v1::ArcClosure { arc })) => closed_arc = Some(Unsigned64(arc)),
            Some(Kind::Toll(v1::ArcToll { arc, toll_m })) => {
                toll = Some(Toll { arc: Unsigned64(arc), toll_m });
            }
            Some(Kind::Obstacle(wire)) => obstacle = Some(Obstacle::from(wire)),
            Some(Kind::Zone(v1::Zone { polygon, factor })) => {
                let polygon = points(polygon.unwrap_or_default().points);
                zone = Some(Zone { polygon, factor });
            }
            None => {}
        }
        Self {
            id,
            closed_arc,
            toll,
            obstacle,
            zone,
            reason,
            author,
            origin,
            cost_revision: Unsigned64(cost_revision),
            create_time_ns: Signed64(create_time_ns),
            client_key,
        }
    }
}

impl From<v1::Obstacle> for Obstacle {
    fn from(wire: v1::Obstacle) -> Self {
        use v1::obstacle::Shape;
        let v1::Obstacle { shape } = wire;
        let (polygon, polyline, width_m) = match shape {
            Some(Shape::Polygon(v1::Polygon { points: of })) => (Some(points(of)), None, 0.0),
            Some(Shape::Polyline(v1::Polyline { points: of, width_m })) => {
                (None, Some(points(of)), width_m)
            }
            None => (None, None, 0.0),
        };
        Self { polygon, polyline, width_m }
    }
}

/// All that is in force.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct CostList {
    /// Oldest first.
    costs: Vec<Cost>,
    cost_revision: Unsigned64,
}

/// What is to be in force: one of `closed_arc`, `toll`, `obstacle` and `zone`.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct NewCost {
    /// Id of an arc that is not to be crossed.
    #[schema(nullable = false)]
    closed_arc: Option<Unsigned64>,
    #[schema(nullable = false)]
    toll: Option<Toll>,
    #[schema(nullable = false)]
    obstacle: Option<Obstacle>,
    #[schema(nullable = false)]
    zone: Option<Zone>,
    /// For people, up to 200 characters: why.
    #[serde(default)]
    reason: String,
    /// For people, up to 200 characters: who says so.
    #[serde(default)]
    author: String,
    #[serde(default)]
    origin: Origin,
    /// Chosen by the caller, so that sending again finds what was made before: up to 255 characters.
    #[serde(default)]
    client_key: String,
}

fn to_wire(points: Vec<Point>) -> v1::Polygon {
    v1::Polygon { points: points.into_iter().map(v1::Point::from).collect() }
}

fn shape(obstacle: Obstacle) -> Result<v1::Obstacle, Error> {
    use v1::obstacle::Shape;
    let Obstacle { polygon, polyline, width_m } = obstacle;
    let line = |points| v1::Polyline { points: to_wire(points).points, width_m };
    let shape = only_one(
        "obstacle",
        [
            ("polygon", polygon.map(|points| Shape::Polygon(to_wire(points)))),
            ("polyline", polyline.map(|points| Shape::Polyline(line(points)))),
        ],
    )?;
    Ok(v1::Obstacle { shape })
}

impl NewCost {
    fn into_wire(self) -> Result<v1::Cost, Error> {
        use v1::cost::Kind;
        let Self { closed_arc, toll, obstacle, zone, reason, author, origin, client_key } = self;
        let toll = toll.map(|Toll { arc, toll_m }| v1::ArcToll { arc: arc.0, toll_m });
        let zone = zone
            .map(|Zone { polygon, factor }| v1::Zone { polygon: Some(to_wire(polygon)), factor });
        let kind = only_one(
            "cost",
            [
                ("closed_arc", closed_arc.map(|arc| Kind::Closure(v1::ArcClosure { arc: arc.0 }))),
                ("toll", toll.map(Kind::Toll)),
                ("obstacle", obstacle.map(shape).transpose()?.map(Kind::Obstacle)),
                ("zone", zone.map(Kind::Zone)),
            ],
        )?;
        let origin = origin.into();
        Ok(v1::Cost { kind, reason, author, origin, client_key, ..v1::Cost::default() })
    }
}

/// What is in force on a map.
#[utoipa::path(
    get,
    path = "/v1/maps/{map}/costs",
    tag = "costs",
    params(MapPath),
    responses((status = 200, description = "All of it.", body = CostList), ReadProblems)
)]
pub(super) async fn list_costs(
    State(rest): State<Rest>,
    Path(path): Path<MapPath>,
) -> Result<Response, Refusal> {
    let request = v1::ListCostsRequest { map: path.map };
    let v1::ListCostsResponse { costs, cost_revision } = rest.service.list_costs(request).await?;
    let costs = costs.into_iter().map(Cost::from).collect();
    Ok(ok(&CostList { costs, cost_revision: Unsigned64(cost_revision) }))
}

/// Draws an obstacle or a zone, closes an arc or sets its toll.
///
/// In force in every answer that is asked for from now on.
#[utoipa::path(
    post,
    path = "/v1/maps/{map}/costs",
    tag = "costs",
    params(MapPath, IdempotencyKey),
    request_body = NewCost,
    responses((status = 201, description = "What is in force.", body = Cost), CreationProblems)
)]
pub(super) async fn create_cost(
    State(rest): State<Rest>,
    Path(path): Path<MapPath>,
    key: IdempotencyKey,
    body: JsonBody<NewCost>,
) -> Result<Response, Refusal> {
    let service = rest.service.clone();
    // The same body for another map is another request.
    let request = [path.map.as_bytes(), &body.fingerprint.0].concat();
    let fingerprint = ContentHash::of(&request);
    once(&rest, &CREATION, key, fingerprint, async move {
        let cost = Some(body.value.into_wire()?);
        let request = v1::CreateCostRequest { map: path.map, cost };
        let v1::CreateCostResponse { cost, cost_revision: _ } =
            service.create_cost(request).await?;
        Ok(Reply::new(StatusCode::CREATED, &Cost::from(filled(cost, "cost")?))?)
    })
    .await
}

/// Names a cost.
#[derive(Debug, Deserialize, IntoParams)]
#[into_params(parameter_in = Path)]
pub(crate) struct CostPath {
    /// Id of the map.
    #[param(example = "intel")]
    map: String,
    /// Id of the cost.
    cost: String,
}

/// Why it is taken back.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct RemovalQuery {
    /// For people, up to 200 characters: why.
    #[serde(default)]
    reason: String,
    /// For people, up to 200 characters: who says so.
    #[serde(default)]
    author: String,
    /// `OPERATOR` (also if absent) or `EVIDENCE`.
    #[serde(default)]
    #[param(inline)]
    origin: Origin,
}

/// Takes an obstacle, a zone, a closure or a toll back.
#[utoipa::path(
    delete,
    path = "/v1/maps/{map}/costs/{cost}",
    tag = "costs",
    params(CostPath, RemovalQuery),
    responses((status = 200, description = "It is not in force any more.", body = CostsChanged), ChangeProblems)
)]
pub(super) async fn delete_cost(
    State(rest): State<Rest>,
    Path(path): Path<CostPath>,
    Query(query): Query<RemovalQuery>,
) -> Result<Response, Refusal> {
    let CostPath { map, cost: id } = path;
    let RemovalQuery { reason, author, origin } = query;
    let origin = origin.into();
    let request = v1::DeleteCostRequest { map: map.clone(), id, reason, author, origin };
    let v1::DeleteCostResponse { cost_revision } = rest.service.delete_cost(request).await?;
    Ok(ok(&CostsChanged { map, cost_revision: Unsigned64(cost_revision) }))
}

/// A map's costs as they are now, after a change.
pub(super) fn changed(map: String, cost_revision: u64) -> CostsChanged {
    CostsChanged { map, cost_revision: Unsigned64(cost_revision) }
}
