//! `/v1/sessions/{session}/batches`: the unary twin of the ingest stream, in JSON.

use axum::extract::State;
use axum::response::Response;
use meetpoint_proto::v1;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;
use v1::ingest_batch_request::Kind;

use super::Rest;
use super::integer::Unsigned64;
use super::observations::Observation;
use super::openapi::ChangeProblems;
use super::problem::Refusal;
use super::reply::{filled, ok};
use super::request::{JsonBody, Path, only_one};
use super::session_routes::SessionPath;
use crate::error::Error;

/// A batch, or a skip. One of the two is required.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({
    "epoch": 1,
    "batch": {"number": 1, "observations": [
        {"stamp_ns": "1763840000000000000",
         "odometry_pose": {"odometry_from_robot": {"x_m": 0.0, "y_m": 0.0, "theta_rad": 0.0}}},
        {"stamp_ns": "1763840000010000000", "sensor_id": "front_laser",
         "laser_scan": {"ranges_m": [2.5, 2.51, null, "inf"]}}
    ]}
}))]
pub(crate) struct Upload {
    /// The session's own epoch.
    epoch: Unsigned64,
    #[serde(default)]
    batch: Option<Batch>,
    #[serde(default)]
    skip: Option<Skip>,
}

/// What a session sends at once: at most 4096 observations and 1 MiB as the binary protocol encodes
/// it.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Batch {
    /// 1, 2, 3... within the session, without gaps. Sending a number again with the same content is
    /// acknowledged and not applied; with other content it is refused.
    number: Unsigned64,
    /// In the order in which they happened.
    #[serde(default)]
    observations: Vec<Observation>,
}

/// Batches that the robot had to drop: numbers `from` to `through` will never come.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Skip {
    /// The next number expected.
    from: Unsigned64,
    /// The last number that will never come.
    through: Unsigned64,
    /// For people: 0 to 200 characters.
    #[serde(default)]
    #[schema(max_length = 200, example = "the disk was full")]
    reason: String,
}

impl Upload {
    fn into_wire(self, session: String) -> Result<v1::IngestBatchRequest, Error> {
        let Self { epoch, batch, skip } = self;
        let batch = batch.map(Batch::into_wire).transpose()?;
        let skip = skip.map(v1::Skip::from);
        let alternatives = [("batch", batch.map(Kind::Batch)), ("skip", skip.map(Kind::Skip))];
        let kind = only_one("body", alternatives)?
            .ok_or_else(|| Error::field("body", "neither `batch` nor `skip`"))?;
        Ok(v1::IngestBatchRequest { session, epoch: epoch.0, kind: Some(kind) })
    }
}

impl Batch {
    fn into_wire(self) -> Result<v1::Batch, Error> {
        let Self { number, observations } = self;
        let numbered = observations.into_iter().enumerate();
        let observations = numbered
            .map(|(index, observation)| {
                observation.into_wire(&format!("batch.observations[{index}]"))
            })
            .collect::<Result<_, _>>()?;
        Ok(v1::Batch { number: number.0, observations })
    }
}

impl From<Skip> for v1::Skip {
    fn from(skip: Skip) -> Self {
        let Skip { from, through, reason } = skip;
        Self { from: from.0, through: through.0, reason }
    }
}

/// Durable: after the disk's fsync, cumulative.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Ack {
    /// Every batch up to this number is kept for ever.
    acked_through: Unsigned64,
    /// What was kept but will not be used. Not to be sent again.
    rejected: Vec<Rejection>,
}

impl From<v1::Ack> for Ack {
    fn from(wire: v1::Ack) -> Self {
        let v1::Ack { acked_through, rejected } = wire;
        Self {
            acked_through: Unsigned64(acked_through),
            rejected: rejected.into_iter().map(Rejection::from).collect(),
        }
    }
}

/// An observation that was kept in the journal but will not be used, and why.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Rejection {
    batch_number: Unsigned64,
    /// Index into the batch's observations, from 0.
    index: u32,
    /// Stable, for programs: `EMPTY_OBSERVATION`, `UNKNOWN_SENSOR`, `WRONG_SENSOR_KIND`,
    /// `WRONG_BEAM_COUNT`, `NOT_FINITE`, `OUT_OF_RANGE`, `DUPLICATE_STAMP`, `STAMP_OUT_OF_RANGE`,
    /// `NO_USABLE_READING` or `TOO_LONG`.
    #[schema(example = "WRONG_BEAM_COUNT")]
    code: String,
    /// For people: the value at fault and the limit.
    #[schema(example = "180 readings, 181 are declared")]
    detail: String,
}

impl From<v1::Rejection> for Rejection {
    fn from(wire: v1::Rejection) -> Self {
        let v1::Rejection { batch_number, index, code, detail } = wire;
        Self { batch_number: Unsigned64(batch_number), index, code, detail }
    }
}

/// Takes a batch of observations, or notes that some will never come.
///
/// Answered when durable. For poor links and small programs; robots better use the gRPC stream, which
/// has acknowledgements, corrections and flow control. A gap is refused with `SEQUENCE_GAP` and the
/// `expected_number`; single unusable observations are listed and the rest of the batch counts.
#[utoipa::path(
    post,
    path = "/v1/sessions/{session}/batches",
    tag = "sessions",
    params(SessionPath),
    request_body = Upload,
    responses((status = 200, description = "Kept for ever.", body = Ack), ChangeProblems)
)]
pub(super) async fn ingest_batch(
    State(rest): State<Rest>,
    Path(path): Path<SessionPath>,
    body: JsonBody<Upload>,
) -> Result<Response, Refusal> {
    let request = body.value.into_wire(path.session)?;
    let v1::IngestBatchResponse { ack } = rest.service.ingest_batch(request).await?;
    Ok(ok(&Ack::from(filled(ack, "ack")?)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn upload(body: serde_json::Value) -> Result<v1::IngestBatchRequest, String> {
        let read: Upload = serde_json::from_value(body).map_err(|error| error.to_string())?;
        read.into_wire("s".to_owned()).map_err(|error| error.to_string())
    }

    #[test]
    fn a_batch_or_a_skip() {
        let batch = upload(json!({"epoch": 2, "batch": {"number": "7", "observations": []}}));
        let wire = batch.expect("a batch");
        assert_eq!(wire.epoch, 2, "as given");
        assert!(matches!(wire.kind, Some(Kind::Batch(v1::Batch { number: 7, .. }))), "in digits");
        let skip = json!({"from": 7, "through": 9, "reason": "full"});
        let wire = upload(json!({"epoch": 1, "skip": skip})).expect("a skip");
        assert!(matches!(wire.kind, Some(Kind::Skip(v1::Skip { from: 7, through: 9, .. }))), "so");
        let both = json!({"epoch": 1, "batch": {"number": 1}, "skip": skip});
        assert_eq!(
            upload(both).expect_err("both"),
            "body: `batch` and `skip`, one is taken",
            "not both"
        );
        assert!(upload(json!({"epoch": 1})).is_err(), "one of them");
    }
}
