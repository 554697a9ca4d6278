//! What the service does about robots that explore as they are told, whichever protocol carries it.

use meetpoint_client::v1;
use serde_json::{Value, json};
use tonic::transport::Channel;
use v1::qualitative_service_client::QualitativeServiceClient;

use crate::door::Answer;
use crate::qualitative_json;
use crate::rest_door::{RestDoor, answered_bytes};

/// Why something is decided, and who says so.
const SAID: [&str; 2] = ["a beacon was put there", "anna"];

/// The operations, on a session.
pub(crate) trait QualitativeDoor {
    async fn step(&self, session: &str) -> Answer<v1::QualitativeStep>;
    /// Without a drawing.
    async fn known(&self, session: &str) -> Answer<v1::GetQualitativeExplorationResponse>;
    /// The bytes of a PNG.
    async fn graph_drawing(&self, session: &str) -> Answer<Vec<u8>>;
    async fn begin(
        &self,
        request: v1::BeginQualitativeExplorationRequest,
    ) -> Answer<v1::QualitativeExploration>;
    async fn select(
        &self,
        session: &str,
        selection: v1::TravelSelection,
    ) -> Answer<v1::QualitativeExploration>;
    /// The place that is meant.
    async fn home(&self, session: &str, place: Option<u32>, undo: bool) -> Answer<u32>;
}

/// The service's gRPC side.
pub(crate) struct QualitativeGrpc(QualitativeServiceClient<Channel>);

impl QualitativeGrpc {
    pub(crate) fn new(channel: Channel) -> Self {
        Self(QualitativeServiceClient::new(channel))
    }
}

impl QualitativeDoor for QualitativeGrpc {
    async fn step(&self, session: &str) -> Answer<v1::QualitativeStep> {
        let request = v1::GetNextStepRequest { session: session.to_owned() };
        let reply = self.0.clone().get_next_step(request).await?.into_inner();
        Ok(reply.step.expect("a step"))
    }

    async fn known(&self, session: &str) -> Answer<v1::GetQualitativeExplorationResponse> {
        let session = session.to_owned();
        let request = v1::GetQualitativeExplorationRequest { session, picture: false };
        Ok(self.0.clone().get_qualitative_exploration(request).await?.into_inner())
    }

    async fn graph_drawing(&self, session: &str) -> Answer<Vec<u8>> {
        let session = session.to_owned();
        let request = v1::GetQualitativeExplorationRequest { session, picture: true };
        Ok(self.0.clone().get_qualitative_exploration(request).await?.into_inner().png)
    }

    async fn begin(
        &self,
        request: v1::BeginQualitativeExplorationRequest,
    ) -> Answer<v1::QualitativeExploration> {
        let reply = self.0.clone().begin_qualitative_exploration(request).await?.into_inner();
        Ok(reply.exploration.expect("how it explores"))
    }

    async fn select(
        &self,
        session: &str,
        selection: v1::TravelSelection,
    ) -> Answer<v1::QualitativeExploration> {
        let [reason, author] = SAID.map(str::to_owned);
        let (session, selection) = (session.to_owned(), selection.into());
        let request = v1::SelectDirectionsRequest { session, selection, reason, author };
        let reply = self.0.clone().select_directions(request).await?.into_inner();
        Ok(reply.exploration.expect("how it explores"))
    }

    async fn home(&self, session: &str, place: Option<u32>, undo: bool) -> Answer<u32> {
        let [reason, author] = SAID.map(str::to_owned);
        let session = session.to_owned();
        let request = v1::MarkHomeRequest { session, place, undo, reason, author };
        Ok(self.0.clone().mark_home(request).await?.into_inner().place)
    }
}

fn selection_name(selection: v1::TravelSelection) -> &'static str {
    match selection {
        v1::TravelSelection::MostRotation => "MOST_ROTATION",
        _ => "LEAST_ROTATION",
    }
}

impl QualitativeDoor for RestDoor {
    async fn step(&self, session: &str) -> Answer<v1::QualitativeStep> {
        let body = self.get(&format!("/v1/sessions/{session}/next-step"))?;
        Ok(qualitative_json::step(&body))
    }

    async fn known(&self, session: &str) -> Answer<v1::GetQualitativeExplorationResponse> {
        let body = self.get(&format!("/v1/sessions/{session}/qualitative"))?;
        Ok(qualitative_json::detail(&body))
    }

    async fn graph_drawing(&self, session: &str) -> Answer<Vec<u8>> {
        answered_bytes(self.0.get(&format!("/v1/sessions/{session}/qualitative?format=png")))
    }

    async fn begin(
        &self,
        request: v1::BeginQualitativeExplorationRequest,
    ) -> Answer<v1::QualitativeExploration> {
        let selection = selection_name(request.selection());
        let v1::BeginQualitativeExplorationRequest {
            session,
            sensor,
            compass,
            selection: _,
            corridor_width_m,
            rehearsal_edges_max,
            reason,
            author,
        } = request;
        let mut body = json!({
            "sensor": sensor,
            "compass": compass,
            "selection": selection,
            "reason": reason,
            "author": author,
        });
        let numbers = [
            ("corridor_width_m", corridor_width_m.map(Value::from)),
            ("rehearsal_edges_max", rehearsal_edges_max.map(Value::from)),
        ];
        for (name, value) in numbers {
            if let Some(value) = value {
                body[name] = value;
            }
        }
        let path = format!("/v1/sessions/{session}/qualitative/begin");
        Ok(qualitative_json::exploration(&self.post(&path, &body, &[200])?))
    }

    async fn select(
        &self,
        session: &str,
        selection: v1::TravelSelection,
    ) -> Answer<v1::QualitativeExploration> {
        let [reason, author] = SAID;
        let body =
            json!({"selection": selection_name(selection), "reason": reason, "author": author});
        let path = format!("/v1/sessions/{session}/qualitative/selection");
        Ok(qualitative_json::exploration(&self.post(&path, &body, &[200])?))
    }

    async fn home(&self, session: &str, place: Option<u32>, undo: bool) -> Answer<u32> {
        let [reason, author] = SAID;
        let mut body = json!({"undo": undo, "reason": reason, "author": author});
        if let Some(place) = place {
            body["place"] = place.into();
        }
        let path = format!("/v1/sessions/{session}/qualitative/home");
        let reply = self.post(&path, &body, &[200])?;
        Ok(crate::from_json::small(&reply["place"]))
    }
}
