//! `/v1/maps/{map}/profiles`: the robots that plan tables are made for.

use axum::extract::State;
use axum::response::Response;
use meetpoint_proto::v1;
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use super::Rest;
use super::costs::{CostsChanged, changed};
use super::integer::Unsigned64;
use super::maps::MapPath;
use super::openapi::{ChangeProblems, ReadProblems};
use super::problem::Refusal;
use super::reply::{filled, ok};
use super::request::{JsonBody, Path};

/// A robot that plan tables are made for, and how it is to drive.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Profile {
    name: String,
    #[serde(flatten)]
    preferences: Preferences,
}

/// How large a robot is and how it is to drive.
#[derive(Debug, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Preferences {
    /// Radius of the circle around the robot's centre that it stays within, in metres.
    #[schema(minimum = 0.0, maximum = 5.0, example = 0.3)]
    robot_radius_m: f64,
    /// A cell whose centre is nearer to an obstacle than this is dearer, in metres; 0 for none.
    #[serde(default)]
    #[schema(minimum = 0.0, maximum = 10.0)]
    clearance_distance_m: f64,
    /// How much dearer a metre right beside an obstacle is, 1 to 8.
    #[serde(default = "one")]
    #[schema(minimum = 1.0, maximum = 8.0)]
    clearance_factor: f64,
    /// How much dearer a metre is through cells that are as likely occupied as free, 1 to 8.
    #[serde(default = "one")]
    #[schema(minimum = 1.0, maximum = 8.0)]
    occupancy_factor: f64,
}

fn one() -> f64 {
    1.0
}

impl From<v1::Profile> for Profile {
    fn from(wire: v1::Profile) -> Self {
        let v1::Profile {
            name,
            robot_radius_m,
            clearance_distance_m,
            clearance_factor,
            occupancy_factor,
        } = wire;
        let preferences = Preferences {
            robot_radius_m,
            clearance_distance_m,
            clearance_factor,
            occupancy_factor,
        };
        Self { name, preferences }
    }
}

/// The profiles of a map.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct ProfileList {
    /// By name; always with one called `default`.
    profiles: Vec<Profile>,
    cost_revision: Unsigned64,
}

/// Names a profile.
#[derive(Debug, Deserialize, IntoParams)]
#[into_params(parameter_in = Path)]
pub(crate) struct ProfilePath {
    /// Id of the map.
    #[param(example = "intel")]
    map: String,
    /// Name of the profile: 1 to 63 of a-z, 0-9, `-`, `_`, beginning with a letter or digit.
    #[param(example = "default")]
    profile: String,
}

/// The robots that plan tables are made for.
#[utoipa::path(
    get,
    path = "/v1/maps/{map}/profiles",
    tag = "costs",
    params(MapPath),
    responses((status = 200, description = "All of them.", body = ProfileList), ReadProblems)
)]
pub(super) async fn list_profiles(
    State(rest): State<Rest>,
    Path(path): Path<MapPath>,
) -> Result<Response, Refusal> {
    let request = v1::ListProfilesRequest { map: path.map };
    let v1::ListProfilesResponse { profiles, cost_revision } =
        rest.service.list_profiles(request).await?;
    let profiles = profiles.into_iter().map(Profile::from).collect();
    Ok(ok(&ProfileList { profiles, cost_revision: Unsigned64(cost_revision) }))
}

/// Declares a profile, or changes it.
///
/// The same again changes nothing.
#[utoipa::path(
    put,
    path = "/v1/maps/{map}/profiles/{profile}",
    tag = "costs",
    params(ProfilePath),
    request_body = Preferences,
    responses((status = 200, description = "The profile.", body = Profile), ChangeProblems)
)]
pub(super) async fn set_profile(
    State(rest): State<Rest>,
    Path(path): Path<ProfilePath>,
    body: JsonBody<Preferences>,
) -> Result<Response, Refusal> {
    let ProfilePath { map, profile: name } = path;
    let Preferences { robot_radius_m, clearance_distance_m, clearance_factor, occupancy_factor } =
        body.value;
    let profile = v1::Profile {
        name,
        robot_radius_m,
        clearance_distance_m,
        clearance_factor,
        occupancy_factor,
    };
    let request = v1::SetProfileRequest { map, profile: Some(profile) };
    let v1::SetProfileResponse { profile, cost_revision: _ } =
        rest.service.set_profile(request).await?;
    Ok(ok(&Profile::from(filled(profile, "profile")?)))
}

/// Takes a profile back.
///
/// `default` becomes again what the service's settings say.
#[utoipa::path(
    delete,
    path = "/v1/maps/{map}/profiles/{profile}",
    tag = "costs",
    params(ProfilePath),
    responses((status = 200, description = "It is not declared any more.", body = CostsChanged), ChangeProblems)
)]
pub(super) async fn delete_profile(
    State(rest): State<Rest>,
    Path(path): Path<ProfilePath>,
) -> Result<Response, Refusal> {
    let ProfilePath { map, profile: name } = path;
    let request = v1::DeleteProfileRequest { map: map.clone(), name };
    let v1::DeleteProfileResponse { cost_revision } = rest.service.delete_profile(request).await?;
    Ok(ok(&changed(map, cost_revision)))
}
