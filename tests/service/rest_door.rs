//! The operations over REST, by JSON.

use meetpoint_client::v1;
use serde_json::{Value, json};
use v1::ingest_batch_request::Kind as Upload;

use crate::change_json;
use crate::closure_json;
use crate::door::{Answer, Door, Page, Rows};
use crate::exploration_json;
use crate::from_json;
use crate::graph_json;
use crate::http::Http;
use crate::job_json;
use crate::merge_json;
use crate::parameters_json;
use crate::plan_json;
use crate::to_json;

pub(crate) use crate::rest_answer::{answer, answered_bytes};

/// The service's REST side.
#[derive(Clone, Debug)]
pub(crate) struct RestDoor(pub(crate) Http);

impl RestDoor {
    pub(crate) fn new(http: Http) -> Self {
        Self(http)
    }

    pub(crate) fn get(&self, path: &str) -> Answer<Value> {
        answer(&self.0.get(path), &[200])
    }

    /// Something that is made, with one of these statuses.
    pub(crate) fn post(&self, path: &str, body: &Value, statuses: &[u16]) -> Answer<Value> {
        answer(&self.0.post(path, body), statuses)
    }
}

/// `?page_size=..&page_token=..`
pub(crate) fn paged(Page(page_size, token): Page<'_>) -> String {
    format!("page_size={page_size}&page_token={token}")
}

fn rows<T>(body: &Value, name: &str, row: impl FnMut(&Value) -> T) -> Rows<T> {
    let list = body[name].as_array().unwrap_or_else(|| panic!("no `{name}` in {body}"));
    (list.iter().map(row).collect(), from_json::text(&body["next_page_token"]))
}

/// `latest` for 0, as REST calls the published version.
pub(crate) fn version_name(number: u64) -> String {
    if number == 0 { "latest".to_owned() } else { number.to_string() }
}

impl Door for RestDoor {
    async fn create_map(&self, id: &str, resolution_m: f64) -> Answer<v1::Map> {
        let body = json!({"id": id, "resolution_m": resolution_m});
        Ok(from_json::map(&self.post("/v1/maps", &body, &[201])?))
    }

    async fn map(&self, map: &str) -> Answer<v1::Map> {
        Ok(from_json::map(&self.get(&format!("/v1/maps/{map}"))?))
    }

    async fn maps(&self, page: Page<'_>) -> Answer<Rows<v1::Map>> {
        let body = self.get(&format!("/v1/maps?{}", paged(page)))?;
        Ok(rows(&body, "maps", from_json::map))
    }

    async fn versions(&self, map: &str, page: Page<'_>) -> Answer<Rows<v1::MapVersion>> {
        let body = self.get(&format!("/v1/maps/{map}/versions?{}", paged(page)))?;
        Ok(rows(&body, "versions", from_json::version))
    }

    async fn version(&self, map: &str, number: u64) -> Answer<v1::MapVersion> {
        let version = version_name(number);
        Ok(from_json::version(&self.get(&format!("/v1/maps/{map}/versions/{version}"))?))
    }

    async fn parameters(&self, map: &str) -> Answer<v1::MappingParametersState> {
        Ok(parameters_json::state(&self.get(&format!("/v1/maps/{map}/parameters"))?))
    }

    async fn set_parameters(
        &self,
        map: &str,
        parameters: v1::MappingParameters,
    ) -> Answer<v1::MappingParametersState> {
        let path = format!("/v1/maps/{map}/parameters");
        let reply = self.0.put(&path, &parameters_json::body(&parameters));
        Ok(parameters_json::state(&answer(&reply, &[200])?))
    }

    async fn publish(&self, map: &str, number: u64) -> Answer<v1::Map> {
        let path = format!("/v1/maps/{map}/versions/{number}/publish");
        Ok(from_json::map(&answer(&self.0.post_with(&path, &[], b""), &[200])?))
    }

    async fn import(&self, map: &str, yaml: &str, image: &[u8]) -> Answer<v1::ImportMapResponse> {
        let part = |name: &str, content: &[u8]| {
            let head = format!("--cut\r\ncontent-disposition: form-data; name=\"{name}\"\r\n\r\n");
            [head.as_bytes(), content, b"\r\n"].concat()
        };
        let form = [part("yaml", yaml.as_bytes()), part("image", image), b"--cut--\r\n".to_vec()];
        let kind = [("content-type", "multipart/form-data; boundary=cut")];
        let path = format!("/v1/maps/{}/imports", map.replace(' ', "%20"));
        let body = answer(&self.0.post_with(&path, &kind, &form.concat()), &[201, 200])?;
        Ok(from_json::import(&body))
    }

    async fn grid(
        &self,
        map: &str,
        version: u64,
        bbox: Option<v1::BoundingBox>,
    ) -> Answer<v1::Grid> {
        let version = version_name(version);
        let corners = bbox.map_or_else(String::new, |bbox| {
            let v1::BoundingBox { min_x_m, min_y_m, max_x_m, max_y_m } = bbox;
            format!("&bbox={min_x_m},{min_y_m},{max_x_m},{max_y_m}")
        });
        let path = format!("/v1/maps/{map}/grid?format=json&version={version}{corners}");
        Ok(from_json::grid(&self.get(&path)?))
    }

    async fn graph(
        &self,
        map: &str,
        version: u64,
        pruning: v1::GraphPruning,
        outlines: bool,
    ) -> Answer<v1::Graph> {
        let pruned = match pruning {
            v1::GraphPruning::Unspecified => "none",
            v1::GraphPruning::Pairs => "pairs",
            v1::GraphPruning::Ends => "ends",
        };
        let version = version_name(version);
        let query = format!("version={version}&pruned={pruned}&outlines={outlines}");
        Ok(graph_json::graph(&self.get(&format!("/v1/maps/{map}/graph?{query}"))?))
    }

    async fn region(&self, map: &str, region: u64, version: u64) -> Answer<v1::GetRegionResponse> {
        let version = version_name(version);
        let body = self.get(&format!("/v1/maps/{map}/regions/{region}?version={version}"))?;
        Ok(graph_json::region_state(&body))
    }

    async fn plan(&self, request: v1::PlanPathRequest) -> Answer<v1::PlanPathResponse> {
        let (map, body) = (&request.map, plan_json::path_question(&request));
        let body = self.post(&format!("/v1/maps/{map}/paths"), &body, &[200])?;
        Ok(plan_json::path_reply(&body))
    }

    async fn matrix(&self, request: v1::PlanMatrixRequest) -> Answer<v1::PlanMatrixResponse> {
        let (map, body) = (&request.map, plan_json::matrix_question(&request));
        let body = self.post(&format!("/v1/maps/{map}/matrix"), &body, &[200])?;
        Ok(plan_json::matrix_reply(&body))
    }

    async fn motion(&self, request: v1::NextMotionRequest) -> Answer<v1::NextMotionResponse> {
        let v1::NextMotionRequest { map, position, goal, robot, map_version } = request;
        let (at, goal) = (position.unwrap_or_default(), goal.unwrap_or_default());
        let ends =
            format!("x_m={}&y_m={}&goal_x_m={}&goal_y_m={}", at.x_m, at.y_m, goal.x_m, goal.y_m);
        let query = format!("{ends}{}", plan_json::asked(robot.as_ref(), map_version));
        let body = self.get(&format!("/v1/maps/{map}/next-motion?{query}"))?;
        Ok(plan_json::motion(&body))
    }

    async fn exploration(&self, request: v1::GetExplorationRequest) -> Answer<v1::Exploration> {
        let query = exploration_json::query(&request);
        let body = self.get(&format!("/v1/maps/{}/exploration?{query}", request.map))?;
        Ok(exploration_json::exploration(&body))
    }

    async fn exploration_picture(&self, request: v1::GetExplorationRequest) -> Answer<Vec<u8>> {
        let query = exploration_json::query(&request);
        let path = format!("/v1/maps/{}/exploration?format=png&{query}", request.map);
        answered_bytes(self.0.get(&path))
    }

    async fn nearest(
        &self,
        request: v1::GetNearestFreePointRequest,
    ) -> Answer<v1::GetNearestFreePointResponse> {
        let v1::GetNearestFreePointRequest { map, point, robot, map_version, distance_max_m } =
            request;
        let at = point.unwrap_or_default();
        let place = format!("x_m={}&y_m={}&distance_max_m={distance_max_m}", at.x_m, at.y_m);
        let query = format!("{place}{}", plan_json::asked(robot.as_ref(), map_version));
        let body = self.get(&format!("/v1/maps/{map}/nearest-free?{query}"))?;
        Ok(plan_json::nearest(&body))
    }

    async fn reachable(
        &self,
        request: v1::GetReachableAreaRequest,
    ) -> Answer<v1::GetReachableAreaResponse> {
        let v1::GetReachableAreaRequest { map, start, robot, map_version, length_max_m } = request;
        let at = start.unwrap_or_default();
        let place = format!("x_m={}&y_m={}&length_max_m={length_max_m}", at.x_m, at.y_m);
        let query = format!("{place}{}", plan_json::asked(robot.as_ref(), map_version));
        let body = self.get(&format!("/v1/maps/{map}/reachable?{query}"))?;
        Ok(plan_json::reachable(&body))
    }

    async fn tables(&self, map: &str, profile: &str) -> Answer<Vec<u8>> {
        let reply = self.0.get(&format!("/v1/maps/{map}/plan-tables?profile={profile}"));
        if reply.status == 200 {
            return Ok(reply.body);
        }
        answer(&reply, &[200]).map(|body| panic!("{body} is no file"))
    }

    async fn costs(&self, map: &str) -> Answer<(Vec<v1::Cost>, u64)> {
        let body = self.get(&format!("/v1/maps/{map}/costs"))?;
        let costs = from_json::rows(&body["costs"], plan_json::cost);
        Ok((costs, from_json::unsigned(&body["cost_revision"])))
    }

    async fn create_cost(&self, map: &str, cost: v1::Cost) -> Answer<v1::Cost> {
        let body = plan_json::new_cost(&cost);
        let body = self.post(&format!("/v1/maps/{map}/costs"), &body, &[201])?;
        Ok(plan_json::cost(&body))
    }

    async fn delete_cost(&self, map: &str, cost: &str) -> Answer<u64> {
        let reply = self.0.delete(&format!("/v1/maps/{map}/costs/{cost}"));
        Ok(from_json::unsigned(&answer(&reply, &[200])?["cost_revision"]))
    }

    async fn close_arc(&self, map: &str, arc: u64, author: &str) -> Answer<v1::Cost> {
        let body = json!({"author": author});
        let body = self.post(&format!("/v1/maps/{map}/arcs/{arc}/close"), &body, &[200])?;
        Ok(plan_json::cost(&body))
    }

    async fn open_arc(&self, map: &str, arc: u64) -> Answer<u64> {
        let body = self.post(&format!("/v1/maps/{map}/arcs/{arc}/open"), &json!({}), &[200])?;
        Ok(from_json::unsigned(&body["cost_revision"]))
    }

    async fn toll(&self, map: &str, arc: u64, toll_m: f64) -> Answer<v1::Cost> {
        let body = json!({"toll_m": toll_m});
        let body = self.post(&format!("/v1/maps/{map}/arcs/{arc}/toll"), &body, &[200])?;
        Ok(plan_json::cost(&body))
    }

    async fn profiles(&self, map: &str) -> Answer<Vec<v1::Profile>> {
        let body = self.get(&format!("/v1/maps/{map}/profiles"))?;
        Ok(from_json::rows(&body["profiles"], plan_json::profile))
    }

    async fn set_profile(&self, map: &str, profile: v1::Profile) -> Answer<v1::Profile> {
        let name = &profile.name;
        let path = format!("/v1/maps/{map}/profiles/{name}");
        let body = answer(&self.0.put(&path, &plan_json::preferences(&profile)), &[200])?;
        Ok(plan_json::profile(&body))
    }

    async fn delete_profile(&self, map: &str, name: &str) -> Answer<u64> {
        let reply = self.0.delete(&format!("/v1/maps/{map}/profiles/{name}"));
        Ok(from_json::unsigned(&answer(&reply, &[200])?["cost_revision"]))
    }

    async fn create_robot(&self, id: &str) -> Answer<v1::Robot> {
        Ok(from_json::robot(&self.post("/v1/robots", &json!({"id": id}), &[201])?))
    }

    async fn robot(&self, robot: &str) -> Answer<v1::Robot> {
        Ok(from_json::robot(&self.get(&format!("/v1/robots/{robot}"))?))
    }

    async fn robots(&self, page: Page<'_>) -> Answer<Rows<v1::Robot>> {
        let body = self.get(&format!("/v1/robots?{}", paged(page)))?;
        Ok(rows(&body, "robots", from_json::robot))
    }

    async fn open(&self, request: v1::OpenSessionRequest) -> Answer<v1::OpenSessionResponse> {
        let body = self.post("/v1/sessions", &to_json::opening(&request), &[201, 200])?;
        Ok(from_json::opened(&body))
    }

    async fn session(&self, session: &str) -> Answer<v1::Session> {
        Ok(from_json::session(&self.get(&format!("/v1/sessions/{session}"))?))
    }

    async fn sessions(&self, map: &str, page: Page<'_>) -> Answer<Rows<v1::Session>> {
        let body = self.get(&format!("/v1/sessions?map={map}&{}", paged(page)))?;
        Ok(rows(&body, "sessions", from_json::session))
    }

    async fn close(&self, session: &str, epoch: u64) -> Answer<v1::Session> {
        let path = format!("/v1/sessions/{session}/close");
        Ok(from_json::session(&self.post(&path, &json!({"epoch": epoch}), &[200])?))
    }

    async fn upload(&self, session: &str, epoch: u64, upload: Upload) -> Answer<v1::Ack> {
        let path = format!("/v1/sessions/{session}/batches");
        let body = match upload {
            Upload::Batch(batch) => json!({"epoch": epoch, "batch": to_json::batch(&batch)}),
            Upload::Skip(v1::Skip { from, through, reason }) => {
                json!({"epoch": epoch,
                    "skip": {"from": from, "through": through, "reason": reason}})
            }
        };
        Ok(from_json::ack(&self.post(&path, &body, &[200])?))
    }

    async fn trajectory(&self, request: v1::GetTrajectoryRequest) -> Answer<(v1::Trajectory, u64)> {
        let v1::GetTrajectoryRequest { session, version, frame, offset, page_size } = request;
        let version = version_name(version);
        let page = format!("offset={offset}&page_size={page_size}");
        let query = format!("version={version}&frame={frame}&{page}");
        let body = self.get(&format!("/v1/sessions/{session}/trajectory?{query}"))?;
        Ok((from_json::trajectory(&body), from_json::unsigned(&body["next_offset"])))
    }

    async fn landmarks(
        &self,
        map: &str,
        version: u64,
        page: Page<'_>,
    ) -> Answer<Rows<v1::Landmark>> {
        let query = format!("version={}&{}", version_name(version), paged(page));
        let body = self.get(&format!("/v1/maps/{map}/landmarks?{query}"))?;
        Ok(rows(&body, "landmarks", job_json::landmark))
    }

    async fn whereabouts(&self, session: &str, step: Option<u32>) -> Answer<v1::Whereabouts> {
        let query = step.map_or_else(String::new, |step| format!("?step={step}"));
        let body = self.get(&format!("/v1/sessions/{session}/whereabouts{query}"))?;
        Ok(merge_json::whereabouts(&body))
    }

    async fn whereabouts_picture(&self, session: &str, step: Option<u32>) -> Answer<Vec<u8>> {
        let step = step.map_or_else(String::new, |step| format!("&step={step}"));
        let path = format!("/v1/sessions/{session}/whereabouts?format=png{step}");
        answered_bytes(self.0.get(&path))
    }

    async fn changes(&self, request: v1::ListChangesRequest) -> Answer<v1::ListChangesResponse> {
        let (map, query) = (&request.map, change_json::query(&request));
        Ok(change_json::changes(&self.get(&format!("/v1/maps/{map}/changes?{query}"))?))
    }

    async fn doors(&self, request: v1::ListDoorsRequest) -> Answer<v1::ListDoorsResponse> {
        let v1::ListDoorsRequest { map, version, page_size, page_token } = &request;
        let (version, page) = (version_name(*version), paged(Page(*page_size, page_token)));
        let path = format!("/v1/maps/{map}/doors?version={version}&{page}");
        Ok(change_json::doors(&self.get(&path)?))
    }

    async fn closures(&self, request: v1::ListClosuresRequest) -> Answer<Rows<v1::Closure>> {
        let v1::ListClosuresRequest { map, session, verdict, page_size, page_token } = request;
        let verdict = match v1::ClosureVerdict::try_from(verdict).expect("one of its values") {
            v1::ClosureVerdict::Unspecified => "",
            v1::ClosureVerdict::Accepted => "&verdict=ACCEPTED",
            v1::ClosureVerdict::Refused => "&verdict=REFUSED",
        };
        let page = paged(Page(page_size, &page_token));
        let query = format!("session={session}{verdict}&{page}");
        let body = self.get(&format!("/v1/maps/{map}/closures?{query}"))?;
        Ok(rows(&body, "closures", closure_json::closure))
    }

    async fn switch_closure(&self, map: &str, closure: &str, is_off: bool) -> Answer<v1::Closure> {
        let path = if is_off {
            format!("/v1/maps/{map}/closures/{closure}/switch-off")
        } else {
            format!("/v1/maps/{map}/closures/{closure}/switch-on")
        };
        Ok(closure_json::closure(&self.post(&path, &json!({"reason": "glass"}), &[200])?))
    }

    async fn session_grid(&self, session: &str, version: u64) -> Answer<v1::Grid> {
        let version = version_name(version);
        let path = format!("/v1/sessions/{session}/grid?format=json&version={version}");
        Ok(from_json::grid(&self.get(&path)?))
    }

    async fn merges(&self, request: v1::ListMergesRequest) -> Answer<Rows<v1::Merge>> {
        let v1::ListMergesRequest { map, session, state, page_size, page_token } = request;
        let state = v1::MergeState::try_from(state).expect("one of its values");
        let (state, page) = (merge_json::state_name(state), paged(Page(page_size, &page_token)));
        let body = self.get(&format!("/v1/merges?map={map}&session={session}{state}&{page}"))?;
        Ok(rows(&body, "merges", merge_json::merge))
    }

    async fn merge(&self, merge: &str) -> Answer<v1::Merge> {
        Ok(merge_json::merge(&self.get(&format!("/v1/merges/{merge}"))?))
    }

    async fn preview(&self, merge: &str, alignment: &str) -> Answer<Vec<u8>> {
        let reply = self.0.get(&format!("/v1/merges/{merge}/preview?alignment={alignment}"));
        answered_bytes(reply)
    }

    async fn accept(&self, merge: &str, alignment: &str) -> Answer<(v1::Merge, String)> {
        let body = json!({"alignment": alignment, "reason": "looked at", "author": "anna"});
        let path = format!("/v1/merges/{merge}/accept");
        Ok(merge_json::decided(&self.post(&path, &body, &[200])?))
    }

    async fn reject(&self, merge: &str) -> Answer<v1::Merge> {
        let body = json!({"reason": "looked at", "author": "anna"});
        let path = format!("/v1/merges/{merge}/reject");
        Ok(merge_json::decided(&self.post(&path, &body, &[200])?).0)
    }

    async fn undo(&self, merge: &str) -> Answer<(v1::Merge, String)> {
        let body = json!({"reason": "looked at", "author": "anna"});
        let path = format!("/v1/merges/{merge}/undo");
        Ok(merge_json::decided(&self.post(&path, &body, &[200])?))
    }

    async fn picture(&self, job: &str, picture: v1::JobPicture) -> Answer<Vec<u8>> {
        let name = match picture {
            v1::JobPicture::Before => "before",
            v1::JobPicture::After => "after",
            v1::JobPicture::Alpha => "alpha",
            v1::JobPicture::Beta => "beta",
            v1::JobPicture::Posterior => "posterior",
            v1::JobPicture::Unspecified => "unspecified",
        };
        answered_bytes(self.0.get(&format!("/v1/jobs/{job}/pictures/{name}?step=1")))
    }

    async fn start_job(&self, request: v1::CreateJobRequest) -> Answer<v1::Job> {
        let body = job_json::new_job(&request);
        Ok(job_json::job(&self.post("/v1/jobs", &body, &[202])?))
    }

    async fn job(&self, job: &str) -> Answer<v1::Job> {
        Ok(job_json::job(&self.get(&format!("/v1/jobs/{job}"))?))
    }

    async fn jobs(&self, map: &str, page: Page<'_>) -> Answer<Rows<v1::Job>> {
        let body = self.get(&format!("/v1/jobs?map={map}&{}", paged(page)))?;
        Ok(rows(&body, "jobs", job_json::job))
    }

    async fn cancel_job(&self, job: &str) -> Answer<v1::Job> {
        let path = format!("/v1/jobs/{job}/cancel");
        Ok(job_json::job(&answer(&self.0.post_with(&path, &[], b""), &[200])?))
    }
}
