//! The two doors of the service, as a client of each uses them.

use axum::body::Bytes;
use meetpoint_client::{Client, v1};

use super::question::Question;
use super::rest::RestConnection;

/// By which door questions go in.
#[derive(Clone, Copy, Debug)]
pub(super) enum DoorKind {
    Grpc,
    Rest,
}

impl DoorKind {
    /// Both.
    pub(super) const ALL: [Self; 2] = [Self::Grpc, Self::Rest];

    /// For the table.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Grpc => "gRPC",
            Self::Rest => "REST",
        }
    }
}

/// A connection of its own by one of the doors.
pub(super) enum Door {
    Grpc(Client),
    Rest(RestConnection),
}

/// An answer as it came.
pub(super) enum Reply {
    Path(Box<v1::PlanPathResponse>),
    Motion(v1::NextMotionResponse),
    Matrix(v1::PlanMatrixResponse),
    Json(Bytes),
}

impl Door {
    /// Opens a connection to the service at `url`.
    pub(super) async fn open(kind: DoorKind, url: &str) -> anyhow::Result<Self> {
        Ok(match kind {
            DoorKind::Grpc => Self::Grpc(Client::connect(url)?),
            DoorKind::Rest => Self::Rest(RestConnection::open(url).await?),
        })
    }

    /// Asks, and waits for the whole answer.
    ///
    /// # Errors
    /// If the service refuses or does not answer.
    pub(super) async fn ask(&mut self, question: &Question) -> anyhow::Result<Reply> {
        let client = match self {
            Self::Rest(connection) => {
                return Ok(Reply::Json(connection.ask(question.to_rest()).await?));
            }
            Self::Grpc(client) => client,
        };
        Ok(match question.clone() {
            Question::Path(request) => Reply::Path(Box::new(client.plan_path(request).await?)),
            Question::Motion(request) => Reply::Motion(client.next_motion(request).await?),
            Question::Matrix(request) => Reply::Matrix(client.plan_matrix(request).await?),
        })
    }
}
