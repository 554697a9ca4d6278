//! What a robot is told that explores step by step.

use meetpoint_proto::v1::{
    BeginQualitativeExplorationRequest, BeginQualitativeExplorationResponse, GetNextStepRequest,
    GetQualitativeExplorationRequest, GetQualitativeExplorationResponse, QualitativeStep,
    qualitative_service_client::QualitativeServiceClient,
};
use tonic::transport::Channel;

use super::{ANSWER_BYTES_MAX, Client, call};
use crate::error::Error;

impl Client {
    /// Begins an exploration anew from the session's next firing on.
    ///
    /// # Errors
    ///
    /// `SESSION_NOT_FOUND`, `SENSOR_NOT_FOUND`, `NOT_ALL_AROUND` or `INVALID_FIELD`.
    pub async fn begin_qualitative_exploration(
        &self,
        request: BeginQualitativeExplorationRequest,
    ) -> Result<BeginQualitativeExplorationResponse, Error> {
        let mut service = self.qualitative_service();
        Ok(service.begin_qualitative_exploration(call(request)).await?.into_inner())
    }

    /// The next step of a robot whose firings are acknowledged: to be asked after each.
    ///
    /// # Errors
    ///
    /// `SESSION_NOT_FOUND`, `NOT_ALL_AROUND` or `NOTHING_FIRED`.
    pub async fn next_step(&self, session: &str) -> Result<QualitativeStep, Error> {
        let request = GetNextStepRequest { session: session.to_owned() };
        let reply = self.qualitative_service().get_next_step(call(request)).await?.into_inner();
        Ok(reply.step.unwrap_or_default())
    }

    /// All that is known of a session's exploration.
    ///
    /// # Errors
    ///
    /// Those of [`Self::next_step`].
    pub async fn qualitative_exploration(
        &self,
        request: GetQualitativeExplorationRequest,
    ) -> Result<GetQualitativeExplorationResponse, Error> {
        let reply = self.qualitative_service().get_qualitative_exploration(call(request)).await?;
        Ok(reply.into_inner())
    }

    fn qualitative_service(&self) -> QualitativeServiceClient<Channel> {
        QualitativeServiceClient::new(self.channel.clone())
            .max_decoding_message_size(ANSWER_BYTES_MAX)
    }
}
