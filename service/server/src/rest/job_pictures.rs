//! `/v1/jobs/{job}/pictures/{picture}`.

use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use meetpoint_proto::v1;
use serde::Deserialize;
use utoipa::{IntoParams, ToSchema};

use super::Rest;
use super::openapi::ReadProblems;
use super::problem::Refusal;
use super::request::{Path, Query};

/// What a picture shows: a session's way and landmarks, or a table of probabilities over places.
#[derive(Clone, Copy, Debug, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub(crate) enum JobPicture {
    /// In the version before the one that the job made.
    Before,
    /// In the version that the job made.
    After,
    /// Where the robot was by what came before a step, and what was seen at it.
    Alpha,
    /// By what came after it.
    Beta,
    /// By all.
    Posterior,
}

impl From<JobPicture> for v1::JobPicture {
    fn from(picture: JobPicture) -> Self {
        match picture {
            JobPicture::Before => Self::Before,
            JobPicture::After => Self::After,
            JobPicture::Alpha => Self::Alpha,
            JobPicture::Beta => Self::Beta,
            JobPicture::Posterior => Self::Posterior,
        }
    }
}

/// Names a picture of a job.
#[derive(Debug, Deserialize, IntoParams)]
#[into_params(parameter_in = Path)]
pub(crate) struct JobPicturePath {
    /// Id of the job.
    #[param(format = "uuid", example = "0199d3a6-6ac5-7c4e-9d51-2d9a3f1f3c11")]
    job: String,
    /// `before` or `after` for the way; `alpha`, `beta` or `posterior` for a table.
    #[param(inline)]
    picture: JobPicture,
}

/// Which session a picture shows.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct JobPictureQuery {
    /// Id of a session that the job relaxed; absent for the first.
    #[serde(default)]
    #[param(example = "")]
    session: String,
    /// Of a table: from 0 to one below the session's `steps`.
    #[serde(default)]
    #[param(minimum = 0, example = 0)]
    step: u32,
}

/// A picture of what a relax job found.
///
/// Both pictures of a session have the same scale and place, with a line every 10 m. The way is blue
/// from a green start, orange where a landmark was seen; landmarks are red, in an ellipse of two
/// standard deviations. Tables are black where the probability is highest. `PICTURE_NOT_MADE` until
/// the job has succeeded; of tables, where expectation maximisation did not run.
#[utoipa::path(
    get,
    path = "/v1/jobs/{job}/pictures/{picture}",
    tag = "jobs",
    params(JobPicturePath, JobPictureQuery),
    responses(
        (status = 200, description = "The picture.", content_type = "image/png", body = [u8]),
        ReadProblems,
    )
)]
pub(super) async fn get_job_picture(
    State(rest): State<Rest>,
    Path(path): Path<JobPicturePath>,
    Query(query): Query<JobPictureQuery>,
) -> Result<Response, Refusal> {
    let JobPicturePath { job, picture } = path;
    let JobPictureQuery { session, step } = query;
    let picture = v1::JobPicture::from(picture).into();
    let request = v1::GetJobPictureRequest { job, picture, session, step };
    let v1::GetJobPictureResponse { png } = rest.service.get_job_picture(request).await?;
    Ok(([(header::CONTENT_TYPE, "image/png")], png).into_response())
}
