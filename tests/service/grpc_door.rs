//! The operations over gRPC, by the generated stubs.

use meetpoint_client::v1;
use tonic::Status;
use tonic::transport::Channel;
use tonic_types::StatusExt;
use v1::change_service_client::ChangeServiceClient;
use v1::closure_service_client::ClosureServiceClient;
use v1::cost_service_client::CostServiceClient;
use v1::exploration_service_client::ExplorationServiceClient;
use v1::graph_service_client::GraphServiceClient;
use v1::grid_service_client::GridServiceClient;
use v1::import_map_request::Kind as Part;
use v1::ingest_batch_request::Kind as Upload;
use v1::job_service_client::JobServiceClient;
use v1::landmark_service_client::LandmarkServiceClient;
use v1::map_service_client::MapServiceClient;
use v1::merge_service_client::MergeServiceClient;
use v1::place_service_client::PlaceServiceClient;
use v1::plan_service_client::PlanServiceClient;
use v1::robot_choice::Kind as Robot;
use v1::robot_service_client::RobotServiceClient;
use v1::session_service_client::SessionServiceClient;

use crate::door::{Answer, Door, Page, Refused, Rows};

/// The largest answer taken: a grid.
const ANSWER_BYTES_MAX: usize = 64 << 20;

/// Why something is decided, and by whom.
const REASON: &str = "there is a glass wall";
const AUTHOR: &str = "anna";

/// The service's gRPC side.
#[derive(Clone, Debug)]
pub(crate) struct GrpcDoor {
    pub(crate) maps: MapServiceClient<Channel>,
    pub(crate) robots: RobotServiceClient<Channel>,
    pub(crate) sessions: SessionServiceClient<Channel>,
    pub(crate) grids: GridServiceClient<Channel>,
    pub(crate) graphs: GraphServiceClient<Channel>,
    pub(crate) jobs: JobServiceClient<Channel>,
    changes: ChangeServiceClient<Channel>,
    landmarks: LandmarkServiceClient<Channel>,
    closures: ClosureServiceClient<Channel>,
    merges: MergeServiceClient<Channel>,
    pub(crate) places: PlaceServiceClient<Channel>,
    pub(crate) plans: PlanServiceClient<Channel>,
    pub(crate) costs: CostServiceClient<Channel>,
    explorations: ExplorationServiceClient<Channel>,
}

impl GrpcDoor {
    pub(crate) fn new(channel: Channel) -> Self {
        Self {
            maps: MapServiceClient::new(channel.clone()),
            robots: RobotServiceClient::new(channel.clone()),
            sessions: SessionServiceClient::new(channel.clone())
                .max_decoding_message_size(ANSWER_BYTES_MAX),
            grids: GridServiceClient::new(channel.clone())
                .max_decoding_message_size(ANSWER_BYTES_MAX),
            graphs: GraphServiceClient::new(channel.clone())
                .max_decoding_message_size(ANSWER_BYTES_MAX),
            jobs: JobServiceClient::new(channel.clone()),
            changes: ChangeServiceClient::new(channel.clone()),
            landmarks: LandmarkServiceClient::new(channel.clone()),
            closures: ClosureServiceClient::new(channel.clone()),
            merges: MergeServiceClient::new(channel.clone()),
            places: PlaceServiceClient::new(channel.clone()),
            plans: PlanServiceClient::new(channel.clone()),
            costs: CostServiceClient::new(channel.clone()),
            explorations: ExplorationServiceClient::new(channel),
        }
    }
}

impl From<Status> for Refused {
    fn from(status: Status) -> Self {
        let details = status.get_error_details();
        let info = details.error_info().unwrap_or_else(|| panic!("no ErrorInfo in {status:?}"));
        assert_eq!(info.domain, "meetpoint", "whose code it is");
        Self {
            code: info.reason.clone(),
            message: status.message().to_owned(),
            facts: info.metadata.clone().into_iter().collect(),
            retry_after: details.retry_info().and_then(|retry| retry.retry_delay),
        }
    }
}

pub(crate) fn filled<T>(part: Option<T>) -> T {
    part.expect("answers hold what the contract promises")
}

impl Door for GrpcDoor {
    async fn create_map(&self, id: &str, resolution_m: f64) -> Answer<v1::Map> {
        let map = v1::Map { id: id.to_owned(), resolution_m, ..v1::Map::default() };
        let request = v1::CreateMapRequest { map: Some(map) };
        Ok(filled(self.maps.clone().create_map(request).await?.into_inner().map))
    }

    async fn map(&self, map: &str) -> Answer<v1::Map> {
        let request = v1::GetMapRequest { map: map.to_owned() };
        Ok(filled(self.maps.clone().get_map(request).await?.into_inner().map))
    }

    async fn maps(&self, Page(page_size, token): Page<'_>) -> Answer<Rows<v1::Map>> {
        let request = v1::ListMapsRequest { page_size, page_token: token.to_owned() };
        let reply = self.maps.clone().list_maps(request).await?.into_inner();
        Ok((reply.maps, reply.next_page_token))
    }

    async fn versions(&self, map: &str, page: Page<'_>) -> Answer<Rows<v1::MapVersion>> {
        let Page(page_size, token) = page;
        let (map, page_token) = (map.to_owned(), token.to_owned());
        let request = v1::ListMapVersionsRequest { map, page_size, page_token };
        let reply = self.maps.clone().list_map_versions(request).await?.into_inner();
        Ok((reply.versions, reply.next_page_token))
    }

    async fn version(&self, map: &str, number: u64) -> Answer<v1::MapVersion> {
        let request = v1::GetMapVersionRequest { map: map.to_owned(), number };
        Ok(filled(self.maps.clone().get_map_version(request).await?.into_inner().version))
    }

    async fn parameters(&self, map: &str) -> Answer<v1::MappingParametersState> {
        let request = v1::GetMappingParametersRequest { map: map.to_owned() };
        Ok(filled(self.maps.clone().get_mapping_parameters(request).await?.into_inner().state))
    }

    async fn set_parameters(
        &self,
        map: &str,
        parameters: v1::MappingParameters,
    ) -> Answer<v1::MappingParametersState> {
        let (map, parameters) = (map.to_owned(), Some(parameters));
        let request = v1::SetMappingParametersRequest { map, parameters };
        Ok(filled(self.maps.clone().set_mapping_parameters(request).await?.into_inner().state))
    }

    async fn publish(&self, map: &str, number: u64) -> Answer<v1::Map> {
        let request = v1::PublishMapVersionRequest { map: map.to_owned(), number };
        Ok(filled(self.maps.clone().publish_map_version(request).await?.into_inner().map))
    }

    async fn import(&self, map: &str, yaml: &str, image: &[u8]) -> Answer<v1::ImportMapResponse> {
        let head = v1::ImportHead { map: map.to_owned(), yaml: yaml.to_owned() };
        // Pieces of an odd size.
        let pieces = image.chunks(77_777).map(|piece| Part::Image(piece.to_vec()));
        let kinds: Vec<Part> = std::iter::once(Part::Head(head)).chain(pieces).collect();
        let messages = kinds.into_iter().map(|kind| v1::ImportMapRequest { kind: Some(kind) });
        Ok(self.maps.clone().import_map(tokio_stream::iter(messages)).await?.into_inner())
    }

    async fn grid(
        &self,
        map: &str,
        version: u64,
        bounding_box: Option<v1::BoundingBox>,
    ) -> Answer<v1::Grid> {
        let request = v1::GetGridRequest { map: map.to_owned(), version, bounding_box };
        Ok(filled(self.grids.clone().get_grid(request).await?.into_inner().grid))
    }

    async fn graph(
        &self,
        map: &str,
        version: u64,
        pruning: v1::GraphPruning,
        outlines: bool,
    ) -> Answer<v1::Graph> {
        let (map, pruning) = (map.to_owned(), pruning.into());
        let request = v1::GetGraphRequest { map, version, pruning, outlines, ..Default::default() };
        Ok(filled(self.graphs.clone().get_graph(request).await?.into_inner().graph))
    }

    async fn region(&self, map: &str, region: u64, version: u64) -> Answer<v1::GetRegionResponse> {
        let request = v1::GetRegionRequest { map: map.to_owned(), region, version };
        Ok(self.graphs.clone().get_region(request).await?.into_inner())
    }

    async fn plan(&self, request: v1::PlanPathRequest) -> Answer<v1::PlanPathResponse> {
        Ok(self.plans.clone().plan_path(request).await?.into_inner())
    }

    async fn matrix(&self, request: v1::PlanMatrixRequest) -> Answer<v1::PlanMatrixResponse> {
        Ok(self.plans.clone().plan_matrix(request).await?.into_inner())
    }

    async fn motion(&self, request: v1::NextMotionRequest) -> Answer<v1::NextMotionResponse> {
        Ok(self.plans.clone().next_motion(request).await?.into_inner())
    }

    async fn exploration(&self, request: v1::GetExplorationRequest) -> Answer<v1::Exploration> {
        let reply = self.explorations.clone().get_exploration(request).await?.into_inner();
        assert!(reply.png.is_empty(), "nobody asked for it");
        Ok(filled(reply.exploration))
    }

    async fn exploration_picture(&self, request: v1::GetExplorationRequest) -> Answer<Vec<u8>> {
        Ok(self.explorations.clone().get_exploration(request).await?.into_inner().png)
    }

    async fn nearest(
        &self,
        request: v1::GetNearestFreePointRequest,
    ) -> Answer<v1::GetNearestFreePointResponse> {
        Ok(self.plans.clone().get_nearest_free_point(request).await?.into_inner())
    }

    async fn reachable(
        &self,
        request: v1::GetReachableAreaRequest,
    ) -> Answer<v1::GetReachableAreaResponse> {
        Ok(self.plans.clone().get_reachable_area(request).await?.into_inner())
    }

    async fn tables(&self, map: &str, profile: &str) -> Answer<Vec<u8>> {
        let robot = v1::RobotChoice { kind: Some(Robot::Profile(profile.to_owned())) };
        let request = v1::DownloadPlanTablesRequest {
            map: map.to_owned(),
            robot: Some(robot),
            map_version: 0,
        };
        let mut pieces = self.plans.clone().download_plan_tables(request).await?.into_inner();
        let mut bytes = Vec::new();
        while let Some(piece) = pieces.message().await? {
            bytes.extend(piece.piece);
        }
        Ok(bytes)
    }

    async fn costs(&self, map: &str) -> Answer<(Vec<v1::Cost>, u64)> {
        let request = v1::ListCostsRequest { map: map.to_owned() };
        let reply = self.costs.clone().list_costs(request).await?.into_inner();
        Ok((reply.costs, reply.cost_revision))
    }

    async fn create_cost(&self, map: &str, cost: v1::Cost) -> Answer<v1::Cost> {
        let request = v1::CreateCostRequest { map: map.to_owned(), cost: Some(cost) };
        Ok(filled(self.costs.clone().create_cost(request).await?.into_inner().cost))
    }

    async fn delete_cost(&self, map: &str, cost: &str) -> Answer<u64> {
        let (map, id) = (map.to_owned(), cost.to_owned());
        let request = v1::DeleteCostRequest { map, id, ..Default::default() };
        Ok(self.costs.clone().delete_cost(request).await?.into_inner().cost_revision)
    }

    async fn close_arc(&self, map: &str, arc: u64, author: &str) -> Answer<v1::Cost> {
        let (map, author) = (map.to_owned(), author.to_owned());
        let request = v1::CloseArcRequest { map, arc, author, ..Default::default() };
        Ok(filled(self.costs.clone().close_arc(request).await?.into_inner().cost))
    }

    async fn open_arc(&self, map: &str, arc: u64) -> Answer<u64> {
        let request = v1::OpenArcRequest { map: map.to_owned(), arc, ..Default::default() };
        Ok(self.costs.clone().open_arc(request).await?.into_inner().cost_revision)
    }

    async fn toll(&self, map: &str, arc: u64, toll_m: f64) -> Answer<v1::Cost> {
        let map = map.to_owned();
        let request = v1::SetArcTollRequest { map, arc, toll_m, ..Default::default() };
        Ok(filled(self.costs.clone().set_arc_toll(request).await?.into_inner().cost))
    }

    async fn profiles(&self, map: &str) -> Answer<Vec<v1::Profile>> {
        let request = v1::ListProfilesRequest { map: map.to_owned() };
        Ok(self.costs.clone().list_profiles(request).await?.into_inner().profiles)
    }

    async fn set_profile(&self, map: &str, profile: v1::Profile) -> Answer<v1::Profile> {
        let request = v1::SetProfileRequest { map: map.to_owned(), profile: Some(profile) };
        Ok(filled(self.costs.clone().set_profile(request).await?.into_inner().profile))
    }

    async fn delete_profile(&self, map: &str, name: &str) -> Answer<u64> {
        let request = v1::DeleteProfileRequest { map: map.to_owned(), name: name.to_owned() };
        Ok(self.costs.clone().delete_profile(request).await?.into_inner().cost_revision)
    }

    async fn create_robot(&self, id: &str) -> Answer<v1::Robot> {
        let robot = v1::Robot { id: id.to_owned(), ..v1::Robot::default() };
        let request = v1::CreateRobotRequest { robot: Some(robot) };
        Ok(filled(self.robots.clone().create_robot(request).await?.into_inner().robot))
    }

    async fn robot(&self, robot: &str) -> Answer<v1::Robot> {
        let request = v1::GetRobotRequest { robot: robot.to_owned() };
        Ok(filled(self.robots.clone().get_robot(request).await?.into_inner().robot))
    }

    async fn robots(&self, Page(page_size, token): Page<'_>) -> Answer<Rows<v1::Robot>> {
        let request = v1::ListRobotsRequest { page_size, page_token: token.to_owned() };
        let reply = self.robots.clone().list_robots(request).await?.into_inner();
        Ok((reply.robots, reply.next_page_token))
    }

    async fn open(&self, request: v1::OpenSessionRequest) -> Answer<v1::OpenSessionResponse> {
        Ok(self.sessions.clone().open_session(request).await?.into_inner())
    }

    async fn session(&self, session: &str) -> Answer<v1::Session> {
        let request = v1::GetSessionRequest { session: session.to_owned() };
        Ok(filled(self.sessions.clone().get_session(request).await?.into_inner().session))
    }

    async fn sessions(&self, map: &str, page: Page<'_>) -> Answer<Rows<v1::Session>> {
        let Page(page_size, token) = page;
        let request = v1::ListSessionsRequest {
            map: map.to_owned(),
            robot: String::new(),
            page_size,
            page_token: token.to_owned(),
        };
        let reply = self.sessions.clone().list_sessions(request).await?.into_inner();
        Ok((reply.sessions, reply.next_page_token))
    }

    async fn close(&self, session: &str, epoch: u64) -> Answer<v1::Session> {
        let request = v1::CloseSessionRequest { session: session.to_owned(), epoch };
        Ok(filled(self.sessions.clone().close_session(request).await?.into_inner().session))
    }

    async fn upload(&self, session: &str, epoch: u64, upload: Upload) -> Answer<v1::Ack> {
        let (session, kind) = (session.to_owned(), Some(upload));
        let request = v1::IngestBatchRequest { session, epoch, kind };
        Ok(filled(self.sessions.clone().ingest_batch(request).await?.into_inner().ack))
    }

    async fn trajectory(&self, request: v1::GetTrajectoryRequest) -> Answer<(v1::Trajectory, u64)> {
        let reply = self.sessions.clone().get_trajectory(request).await?.into_inner();
        Ok((filled(reply.trajectory), reply.next_offset))
    }

    async fn landmarks(
        &self,
        map: &str,
        version: u64,
        Page(page_size, token): Page<'_>,
    ) -> Answer<Rows<v1::Landmark>> {
        let (map, page_token) = (map.to_owned(), token.to_owned());
        let request = v1::ListLandmarksRequest { map, version, page_size, page_token };
        let reply = self.landmarks.clone().list_landmarks(request).await?.into_inner();
        Ok((reply.landmarks, reply.next_page_token))
    }

    async fn whereabouts(&self, session: &str, step: Option<u32>) -> Answer<v1::Whereabouts> {
        let session = session.to_owned();
        let request = v1::GetWhereaboutsRequest { session, step, picture: false };
        let reply = self.landmarks.clone().get_whereabouts(request).await?.into_inner();
        assert!(reply.png.is_empty(), "nobody asked for it");
        Ok(filled(reply.whereabouts))
    }

    async fn whereabouts_picture(&self, session: &str, step: Option<u32>) -> Answer<Vec<u8>> {
        let session = session.to_owned();
        let request = v1::GetWhereaboutsRequest { session, step, picture: true };
        Ok(self.landmarks.clone().get_whereabouts(request).await?.into_inner().png)
    }

    async fn changes(&self, request: v1::ListChangesRequest) -> Answer<v1::ListChangesResponse> {
        Ok(self.changes.clone().list_changes(request).await?.into_inner())
    }

    async fn doors(&self, request: v1::ListDoorsRequest) -> Answer<v1::ListDoorsResponse> {
        Ok(self.changes.clone().list_doors(request).await?.into_inner())
    }

    async fn closures(&self, request: v1::ListClosuresRequest) -> Answer<Rows<v1::Closure>> {
        let reply = self.closures.clone().list_closures(request).await?.into_inner();
        Ok((reply.closures, reply.next_page_token))
    }

    async fn switch_closure(&self, map: &str, closure: &str, is_off: bool) -> Answer<v1::Closure> {
        let (map, closure) = (map.to_owned(), closure.to_owned());
        let (reason, author) = (REASON.to_owned(), String::new());
        let mut closures = self.closures.clone();
        let now = if is_off {
            let request = v1::SwitchClosureOffRequest { map, closure, reason, author };
            closures.switch_closure_off(request).await?.into_inner().closure
        } else {
            let request = v1::SwitchClosureOnRequest { map, closure, reason, author };
            closures.switch_closure_on(request).await?.into_inner().closure
        };
        Ok(filled(now))
    }

    async fn session_grid(&self, session: &str, version: u64) -> Answer<v1::Grid> {
        let session = session.to_owned();
        let request = v1::GetSessionGridRequest { session, version, bounding_box: None };
        Ok(filled(self.grids.clone().get_session_grid(request).await?.into_inner().grid))
    }

    async fn merges(&self, request: v1::ListMergesRequest) -> Answer<Rows<v1::Merge>> {
        let reply = self.merges.clone().list_merges(request).await?.into_inner();
        Ok((reply.merges, reply.next_page_token))
    }

    async fn merge(&self, merge: &str) -> Answer<v1::Merge> {
        let request = v1::GetMergeRequest { merge: merge.to_owned() };
        Ok(filled(self.merges.clone().get_merge(request).await?.into_inner().merge))
    }

    async fn preview(&self, merge: &str, alignment: &str) -> Answer<Vec<u8>> {
        let (merge, alignment) = (merge.to_owned(), alignment.to_owned());
        let request = v1::GetMergePreviewRequest { merge, alignment };
        Ok(self.merges.clone().get_merge_preview(request).await?.into_inner().png)
    }

    async fn accept(&self, merge: &str, alignment: &str) -> Answer<(v1::Merge, String)> {
        let [merge, alignment, reason, author] =
            [merge, alignment, REASON, AUTHOR].map(str::to_owned);
        let request = v1::AcceptMergeRequest { merge, alignment, reason, author };
        let reply = self.merges.clone().accept_merge(request).await?.into_inner();
        Ok((filled(reply.merge), reply.job))
    }

    async fn reject(&self, merge: &str) -> Answer<v1::Merge> {
        let [merge, reason, author] = [merge, REASON, AUTHOR].map(str::to_owned);
        let request = v1::RejectMergeRequest { merge, reason, author };
        Ok(filled(self.merges.clone().reject_merge(request).await?.into_inner().merge))
    }

    async fn undo(&self, merge: &str) -> Answer<(v1::Merge, String)> {
        let [merge, reason, author] = [merge, REASON, AUTHOR].map(str::to_owned);
        let request = v1::UndoMergeRequest { merge, reason, author };
        let reply = self.merges.clone().undo_merge(request).await?.into_inner();
        Ok((filled(reply.merge), reply.job))
    }

    async fn picture(&self, job: &str, picture: v1::JobPicture) -> Answer<Vec<u8>> {
        let (job, session) = (job.to_owned(), String::new());
        let request = v1::GetJobPictureRequest { job, picture: picture.into(), session, step: 1 };
        Ok(self.jobs.clone().get_job_picture(request).await?.into_inner().png)
    }

    async fn start_job(&self, request: v1::CreateJobRequest) -> Answer<v1::Job> {
        Ok(filled(self.jobs.clone().create_job(request).await?.into_inner().job))
    }

    async fn job(&self, job: &str) -> Answer<v1::Job> {
        let request = v1::GetJobRequest { job: job.to_owned() };
        Ok(filled(self.jobs.clone().get_job(request).await?.into_inner().job))
    }

    async fn jobs(&self, map: &str, Page(page_size, token): Page<'_>) -> Answer<Rows<v1::Job>> {
        let (map, page_token) = (map.to_owned(), token.to_owned());
        let request = v1::ListJobsRequest { map, page_size, page_token };
        let reply = self.jobs.clone().list_jobs(request).await?.into_inner();
        Ok((reply.jobs, reply.next_page_token))
    }

    async fn cancel_job(&self, job: &str) -> Answer<v1::Job> {
        let request = v1::CancelJobRequest { job: job.to_owned() };
        Ok(filled(self.jobs.clone().cancel_job(request).await?.into_inner().job))
    }
}
