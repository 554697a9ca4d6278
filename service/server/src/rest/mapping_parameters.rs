//! `/v1/maps/{map}/parameters`: what readings of a map's sensors are taken to mean.

use axum::extract::State;
use axum::response::Response;
use meetpoint_proto::v1;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::Rest;
use super::integer::Unsigned64;
use super::maps::MapPath;
use super::openapi::{ChangeProblems, ReadProblems};
use super::problem::Refusal;
use super::reply::{filled, ok};
use super::request::{JsonBody, Path};

/// What readings of a map's sensors are taken to mean. In a request, what is absent is as the service has it for
/// buildings.
#[derive(Debug, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default)]
#[derive(Default)]
pub(crate) struct MappingParameters {
    /// Probability that a cell is occupied before anything was seen of it, 0.01 to 0.99.
    #[schema(example = 0.5)]
    prior: Option<f64>,
    /// Decay factor of a cell's log-odds towards the prior with each reading that observes it, 0 to 1.
    #[schema(example = 0.9999)]
    decay: Option<f64>,
    /// No cell is likelier occupied than this, nor likelier free, 0.7 to 0.999999: what is sooner believed when it
    /// changes is less sure before.
    #[schema(example = 0.970_688)]
    probability_max: Option<f64>,
    /// Probability that a cell in which a laser's beam ends is occupied, by that alone, 0.51 to 0.99.
    #[schema(example = 0.700_567)]
    laser_hit: Option<f64>,
    /// Probability that a cell which a laser's beam crosses is occupied, by that alone, 0.01 to 0.49.
    #[schema(example = 0.401_312)]
    laser_miss: Option<f64>,
    /// Where beams end farther away is not drawn, in metres, 0.1 to 200.
    #[schema(example = 40.0)]
    laser_hit_range_max_m: Option<f64>,
    /// Beams that end nowhere, or beyond what is drawn, clear cells up to here, in metres, 0.1 to 200.
    #[schema(example = 5.0)]
    laser_clear_range_max_m: Option<f64>,
    /// Sonar says nothing of what is farther away, in metres, 0.5 to 10.
    #[schema(example = 3.5)]
    sonar_distance_max_m: Option<f64>,
    /// Evidence of a firing that is weaker than this, as log-odds, is none, 0 to 10.
    #[schema(example = 1.5)]
    sonar_evidence_min: Option<f64>,
    /// No firing adds or takes more than this, in log-odds, 0 to 10.
    #[schema(example = 2.0)]
    sonar_evidence_max: Option<f64>,
}

impl From<v1::MappingParameters> for MappingParameters {
    fn from(wire: v1::MappingParameters) -> Self {
        let v1::MappingParameters {
            prior,
            decay,
            probability_max,
            laser_hit,
            laser_miss,
            laser_hit_range_max_m,
            laser_clear_range_max_m,
            sonar_distance_max_m,
            sonar_evidence_min,
            sonar_evidence_max,
        } = wire;
        Self {
            prior,
            decay,
            probability_max,
            laser_hit,
            laser_miss,
            laser_hit_range_max_m,
            laser_clear_range_max_m,
            sonar_distance_max_m,
            sonar_evidence_min,
            sonar_evidence_max,
        }
    }
}

impl From<MappingParameters> for v1::MappingParameters {
    fn from(body: MappingParameters) -> Self {
        let MappingParameters {
            prior,
            decay,
            probability_max,
            laser_hit,
            laser_miss,
            laser_hit_range_max_m,
            laser_clear_range_max_m,
            sonar_distance_max_m,
            sonar_evidence_min,
            sonar_evidence_max,
        } = body;
        Self {
            prior,
            decay,
            probability_max,
            laser_hit,
            laser_miss,
            laser_hit_range_max_m,
            laser_clear_range_max_m,
            sonar_distance_max_m,
            sonar_evidence_min,
            sonar_evidence_max,
        }
    }
}

/// The parameters that hold for a map, and whether it is drawn by them.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct MappingParametersState {
    /// All of them.
    parameters: MappingParameters,
    /// The beginning of their hash, as versions name them; empty for those that the service has for buildings.
    #[schema(example = "8f3a52c01b7e")]
    name: String,
    /// The published version; absent before the first.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    map_version: Option<Unsigned64>,
    /// Whether that was drawn by them. If not, a `REBUILD` draws it anew.
    drawn: bool,
}

impl From<v1::MappingParametersState> for MappingParametersState {
    fn from(wire: v1::MappingParametersState) -> Self {
        let v1::MappingParametersState { parameters, name, map_version, drawn } = wire;
        Self {
            parameters: parameters.unwrap_or_default().into(),
            name,
            map_version: Unsigned64::above_zero(map_version),
            drawn,
        }
    }
}

/// What readings of a map's sensors are taken to mean.
#[utoipa::path(
    get,
    path = "/v1/maps/{map}/parameters",
    tag = "maps",
    params(MapPath),
    responses((status = 200, description = "What holds.", body = MappingParametersState), ReadProblems)
)]
pub(super) async fn get_mapping_parameters(
    State(rest): State<Rest>,
    Path(path): Path<MapPath>,
) -> Result<Response, Refusal> {
    let request = v1::GetMappingParametersRequest { map: path.map };
    let reply = rest.service.get_mapping_parameters(request).await?;
    Ok(ok(&MappingParametersState::from(filled(reply.state, "state")?)))
}

/// Decides what readings of a map's sensors are taken to mean.
///
/// What is absent is as the service has it for buildings. A map is drawn by one set of parameters from its first
/// scan on: others hold at once where nothing was observed yet, and else with the next job that draws the map, a
/// `REBUILD` above all.
#[utoipa::path(
    put,
    path = "/v1/maps/{map}/parameters",
    tag = "maps",
    params(MapPath),
    request_body = MappingParameters,
    responses((status = 200, description = "What holds.", body = MappingParametersState), ChangeProblems)
)]
pub(super) async fn set_mapping_parameters(
    State(rest): State<Rest>,
    Path(path): Path<MapPath>,
    body: JsonBody<MappingParameters>,
) -> Result<Response, Refusal> {
    let parameters = Some(body.value.into());
    let request = v1::SetMappingParametersRequest { map: path.map, parameters };
    let reply = rest.service.set_mapping_parameters(request).await?;
    Ok(ok(&MappingParametersState::from(filled(reply.state, "state")?)))
}
