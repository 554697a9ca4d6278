//! The service's operations, whichever protocol carries them: a scenario written once against
//! [`Door`] runs over gRPC and over REST.

use std::collections::BTreeMap;
use std::future::Future;
use std::time::Duration;

use meetpoint_client::v1;
use v1::ingest_batch_request::Kind as Upload;

/// What an operation answers.
pub(crate) type Answer<T> = Result<T, Refused>;

/// An error as a program sees it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Refused {
    /// Stable, the same over both protocols.
    pub(crate) code: String,
    /// For people.
    pub(crate) message: String,
    /// Facts for programs.
    pub(crate) facts: BTreeMap<String, String>,
    /// How long to wait before the same is tried again.
    pub(crate) retry_after: Option<Duration>,
}

impl Refused {
    pub(crate) fn fact(&self, name: &str) -> &str {
        self.facts.get(name).map_or("", String::as_str)
    }
}

/// A page of a list: how many rows, after which token.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Page<'a>(pub(crate) u32, pub(crate) &'a str);

/// All rows that fit on the first page.
pub(crate) const FIRST_PAGE: Page<'static> = Page(0, "");

/// Rows and the token of the next page.
pub(crate) type Rows<T> = (Vec<T>, String);

/// The operations.
pub(crate) trait Door {
    async fn create_map(&self, id: &str, resolution_m: f64) -> Answer<v1::Map>;
    async fn map(&self, map: &str) -> Answer<v1::Map>;
    async fn maps(&self, page: Page<'_>) -> Answer<Rows<v1::Map>>;
    async fn versions(&self, map: &str, page: Page<'_>) -> Answer<Rows<v1::MapVersion>>;
    /// 0 is the published one.
    async fn version(&self, map: &str, number: u64) -> Answer<v1::MapVersion>;
    async fn parameters(&self, map: &str) -> Answer<v1::MappingParametersState>;
    async fn set_parameters(
        &self,
        map: &str,
        parameters: v1::MappingParameters,
    ) -> Answer<v1::MappingParametersState>;
    async fn publish(&self, map: &str, number: u64) -> Answer<v1::Map>;
    async fn import(&self, map: &str, yaml: &str, image: &[u8]) -> Answer<v1::ImportMapResponse>;
    async fn grid(
        &self,
        map: &str,
        version: u64,
        bbox: Option<v1::BoundingBox>,
    ) -> Answer<v1::Grid>;
    async fn graph(
        &self,
        map: &str,
        version: u64,
        pruning: v1::GraphPruning,
        outlines: bool,
    ) -> Answer<v1::Graph>;
    async fn region(&self, map: &str, region: u64, version: u64) -> Answer<v1::GetRegionResponse>;
    async fn plan(&self, request: v1::PlanPathRequest) -> Answer<v1::PlanPathResponse>;
    async fn matrix(&self, request: v1::PlanMatrixRequest) -> Answer<v1::PlanMatrixResponse>;
    async fn motion(&self, request: v1::NextMotionRequest) -> Answer<v1::NextMotionResponse>;
    async fn nearest(
        &self,
        request: v1::GetNearestFreePointRequest,
    ) -> Answer<v1::GetNearestFreePointResponse>;
    async fn reachable(
        &self,
        request: v1::GetReachableAreaRequest,
    ) -> Answer<v1::GetReachableAreaResponse>;
    async fn exploration(&self, request: v1::GetExplorationRequest) -> Answer<v1::Exploration>;
    /// The values as the bytes of a PNG.
    async fn exploration_picture(&self, request: v1::GetExplorationRequest) -> Answer<Vec<u8>>;
    /// The file of a profile's tables.
    async fn tables(&self, map: &str, profile: &str) -> Answer<Vec<u8>>;
    /// What is in force, and the revision.
    async fn costs(&self, map: &str) -> Answer<(Vec<v1::Cost>, u64)>;
    async fn create_cost(&self, map: &str, cost: v1::Cost) -> Answer<v1::Cost>;
    /// The revision.
    async fn delete_cost(&self, map: &str, cost: &str) -> Answer<u64>;
    async fn close_arc(&self, map: &str, arc: u64, author: &str) -> Answer<v1::Cost>;
    /// The revision.
    async fn open_arc(&self, map: &str, arc: u64) -> Answer<u64>;
    async fn toll(&self, map: &str, arc: u64, toll_m: f64) -> Answer<v1::Cost>;
    async fn profiles(&self, map: &str) -> Answer<Vec<v1::Profile>>;
    async fn set_profile(&self, map: &str, profile: v1::Profile) -> Answer<v1::Profile>;
    /// The revision.
    async fn delete_profile(&self, map: &str, name: &str) -> Answer<u64>;
    async fn create_robot(&self, id: &str) -> Answer<v1::Robot>;
    async fn robot(&self, robot: &str) -> Answer<v1::Robot>;
    async fn robots(&self, page: Page<'_>) -> Answer<Rows<v1::Robot>>;
    async fn open(&self, request: v1::OpenSessionRequest) -> Answer<v1::OpenSessionResponse>;
    async fn session(&self, session: &str) -> Answer<v1::Session>;
    async fn sessions(&self, map: &str, page: Page<'_>) -> Answer<Rows<v1::Session>>;
    async fn close(&self, session: &str, epoch: u64) -> Answer<v1::Session>;
    async fn upload(&self, session: &str, epoch: u64, upload: Upload) -> Answer<v1::Ack>;
    /// A page of poses, and the offset of the next one.
    async fn trajectory(&self, request: v1::GetTrajectoryRequest) -> Answer<(v1::Trajectory, u64)>;
    /// A page of the landmarks of a version.
    async fn landmarks(
        &self,
        map: &str,
        version: u64,
        page: Page<'_>,
    ) -> Answer<Rows<v1::Landmark>>;
    /// Where a session's robot is among landmarks at a step, the last if none is given.
    async fn whereabouts(&self, session: &str, step: Option<u32>) -> Answer<v1::Whereabouts>;
    /// The same as a picture.
    async fn whereabouts_picture(&self, session: &str, step: Option<u32>) -> Answer<Vec<u8>>;
    /// A page of the changes between two versions.
    async fn changes(&self, request: v1::ListChangesRequest) -> Answer<v1::ListChangesResponse>;
    /// A page of the doors of a version.
    async fn doors(&self, request: v1::ListDoorsRequest) -> Answer<v1::ListDoorsResponse>;
    /// A page of the ledger of closures.
    async fn closures(&self, request: v1::ListClosuresRequest) -> Answer<Rows<v1::Closure>>;
    /// The closure as it is then.
    async fn switch_closure(&self, map: &str, closure: &str, is_off: bool) -> Answer<v1::Closure>;
    /// What a session that is not placed has drawn, in a version; 0 is the published one.
    async fn session_grid(&self, session: &str, version: u64) -> Answer<v1::Grid>;
    /// A page of merges.
    async fn merges(&self, request: v1::ListMergesRequest) -> Answer<Rows<v1::Merge>>;
    async fn merge(&self, merge: &str) -> Answer<v1::Merge>;
    /// The bytes of a PNG. Empty for the first alignment.
    async fn preview(&self, merge: &str, alignment: &str) -> Answer<Vec<u8>>;
    /// The merge as it is then, and the job that draws the map by it.
    async fn accept(&self, merge: &str, alignment: &str) -> Answer<(v1::Merge, String)>;
    async fn reject(&self, merge: &str) -> Answer<v1::Merge>;
    async fn undo(&self, merge: &str) -> Answer<(v1::Merge, String)>;
    /// The bytes of a PNG.
    async fn picture(&self, job: &str, picture: v1::JobPicture) -> Answer<Vec<u8>>;
    async fn start_job(&self, request: v1::CreateJobRequest) -> Answer<v1::Job>;
    /// A rebuild.
    async fn create_job(&self, map: &str) -> Answer<v1::Job> {
        let (map, kind) = (map.to_owned(), v1::JobKind::Rebuild.into());
        self.start_job(v1::CreateJobRequest { map, kind, ..Default::default() }).await
    }
    async fn job(&self, job: &str) -> Answer<v1::Job>;
    async fn jobs(&self, map: &str, page: Page<'_>) -> Answer<Rows<v1::Job>>;
    async fn cancel_job(&self, job: &str) -> Answer<v1::Job>;
}

/// The refusal of an operation that is to be refused with this code.
#[track_caller]
pub(crate) fn refused<T: std::fmt::Debug>(answer: Answer<T>, code: &str) -> Refused {
    let refused = answer.expect_err(code);
    assert_eq!(refused.code, code, "{refused:?}");
    refused
}

/// Longer than anything takes on the slowest machine: a guard against hanging for ever.
const GUARD: Duration = Duration::from_mins(2);
/// Between two looks.
const LOOK_INTERVAL: Duration = Duration::from_millis(25);

/// Looks until there is something.
pub(crate) async fn eventually<T, F: Future<Output = Option<T>>>(
    what: &str,
    mut look: impl FnMut() -> F,
) -> T {
    let looking = async {
        loop {
            if let Some(found) = look().await {
                return found;
            }
            tokio::time::sleep(LOOK_INTERVAL).await;
        }
    };
    tokio::time::timeout(GUARD, looking).await.unwrap_or_else(|_| panic!("never: {what}"))
}

/// A job at its end.
pub(crate) async fn job_done<D: Door>(door: &D, job: &str) -> v1::Job {
    eventually("the job's end", || async {
        let now = door.job(job).await.expect("it was made");
        now.done.then_some(now)
    })
    .await
}

/// Closes a session and waits until a version holds all of it.
pub(crate) async fn finished<D: Door>(door: &D, session: &v1::Session) -> v1::Session {
    door.close(&session.id, session.epoch).await.expect("an open session can be closed");
    complete(door, &session.id).await
}

/// An ended session once a version holds all of it.
pub(crate) async fn complete<D: Door>(door: &D, session: &str) -> v1::Session {
    eventually("a version that holds all of the session", || async {
        let now = door.session(session).await.expect("it was opened");
        (0 < now.complete_in_version).then_some(now)
    })
    .await
}
