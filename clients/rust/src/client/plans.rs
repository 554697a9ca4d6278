//! Questions about ways through a map.

use meetpoint_proto::v1::{
    DownloadPlanTablesRequest, NextMotionRequest, NextMotionResponse, PlanMatrixRequest,
    PlanMatrixResponse, PlanPathRequest, PlanPathResponse, RobotChoice,
    plan_service_client::PlanServiceClient, robot_choice::Kind,
};
use tonic::{codec::CompressionEncoding, transport::Channel};

use super::{ANSWER_BYTES_MAX, Client, call};
use crate::{error::Error, plan_tables::PlanTables};

impl Client {
    /// The best path between two points of a map, and others if asked for.
    ///
    /// # Errors
    ///
    /// `MAP_NOT_FOUND`, `NOTHING_PUBLISHED`, `PROFILE_NOT_FOUND`, or what is wrong with the request.
    /// That there is no path is an answer.
    pub async fn plan_path(&self, request: PlanPathRequest) -> Result<PlanPathResponse, Error> {
        Ok(self.plans().plan_path(call(request)).await?.into_inner())
    }

    /// Lengths of the best paths from each of several points to each of others.
    ///
    /// # Errors
    ///
    /// As [`Client::plan_path`], and `MATRIX_TOO_LARGE`.
    pub async fn plan_matrix(
        &self,
        request: PlanMatrixRequest,
    ) -> Result<PlanMatrixResponse, Error> {
        Ok(self.plans().plan_matrix(call(request)).await?.into_inner())
    }

    /// Which way to go now, for a robot that may stand anywhere.
    ///
    /// # Errors
    ///
    /// As [`Client::plan_path`].
    pub async fn next_motion(
        &self,
        request: NextMotionRequest,
    ) -> Result<NextMotionResponse, Error> {
        Ok(self.plans().next_motion(call(request)).await?.into_inner())
    }

    /// The plan tables of a profile of a map (`default` if empty), to go on without the network, and
    /// as bytes to be kept.
    ///
    /// # Errors
    ///
    /// `MAP_NOT_FOUND`, `NOTHING_PUBLISHED`, `PROFILE_NOT_FOUND`, `PLAN_TABLES_NOT_READY`;
    /// [`Error::Malformed`] if they cannot be read.
    pub async fn plan_tables(
        &self,
        map: &str,
        profile: &str,
    ) -> Result<(PlanTables, Vec<u8>), Error> {
        let kind = (!profile.is_empty()).then(|| Kind::Profile(profile.to_owned()));
        let robot = kind.map(|kind| RobotChoice { kind: Some(kind) });
        let request = DownloadPlanTablesRequest { map: map.to_owned(), robot, map_version: 0 };
        // Megabytes, of which compression leaves a part; an answer of a few hundred bytes would only
        // come later for it.
        let mut plans = self.plans().accept_compressed(CompressionEncoding::Zstd);
        let mut pieces = plans.download_plan_tables(call(request)).await?.into_inner();
        let mut bytes = Vec::new();
        while let Some(piece) = pieces.message().await? {
            bytes.extend_from_slice(&piece.piece);
        }
        let tables = PlanTables::read(&bytes).map_err(|_| Error::Malformed("plan tables"))?;
        Ok((tables, bytes))
    }

    fn plans(&self) -> PlanServiceClient<Channel> {
        PlanServiceClient::new(self.channel.clone()).max_decoding_message_size(ANSWER_BYTES_MAX)
    }
}
