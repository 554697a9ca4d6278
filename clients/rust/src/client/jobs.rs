//! Work in the background, and what it found.

use meetpoint_proto::v1::{
    CancelJobRequest, CreateJobRequest, GetJobRequest, Job, Landmark, ListJobsRequest,
    ListLandmarksRequest, job_service_client::JobServiceClient,
    landmark_service_client::LandmarkServiceClient,
};
use tonic::transport::Channel;

use super::{Client, call};
use crate::error::Error;

/// Landmarks a page of a list: the most that the service gives.
const LANDMARKS_PAGE: u32 = 1000;

/// Jobs a page of a list: the most that the service gives.
const JOBS_PAGE: u32 = 1000;

impl Client {
    /// Starts a job and returns at once.
    ///
    /// # Errors
    ///
    /// `MAP_NOT_FOUND`, `SESSION_NOT_FOUND`, `SESSION_NOT_PLACED`, or what is wrong with the request.
    pub async fn create_job(&self, request: CreateJobRequest) -> Result<Job, Error> {
        let response = self.jobs().create_job(call(request)).await?;
        response.into_inner().job.ok_or(Error::Malformed("job"))
    }

    /// One job.
    ///
    /// # Errors
    ///
    /// `JOB_NOT_FOUND` if there is none of that id.
    pub async fn job(&self, id: &str) -> Result<Job, Error> {
        let response = self.jobs().get_job(call(GetJobRequest { job: id.to_owned() })).await?;
        response.into_inner().job.ok_or(Error::Malformed("job"))
    }

    /// All jobs of a map, ended ones too; of all maps if that is empty.
    ///
    /// # Errors
    ///
    /// `MAP_NOT_FOUND` if there is no such map.
    pub async fn map_jobs(&self, map: &str) -> Result<Vec<Job>, Error> {
        let mut request = ListJobsRequest {
            map: map.to_owned(),
            page_size: JOBS_PAGE,
            page_token: String::new(),
        };
        let mut all = Vec::new();
        loop {
            let page = self.jobs().list_jobs(call(request.clone())).await?.into_inner();
            all.extend(page.jobs);
            if page.next_page_token.is_empty() {
                return Ok(all);
            }
            request.page_token = page.next_page_token;
        }
    }

    /// Asks a job to stop. A job that has ended stays as it is.
    ///
    /// # Errors
    ///
    /// `JOB_NOT_FOUND` if there is none of that id.
    pub async fn cancel_job(&self, id: &str) -> Result<Job, Error> {
        let request = CancelJobRequest { job: id.to_owned() };
        let response = self.jobs().cancel_job(call(request)).await?;
        response.into_inner().job.ok_or(Error::Malformed("job"))
    }

    /// All landmarks of a version of a map; 0 for the published one.
    ///
    /// # Errors
    ///
    /// `MAP_NOT_FOUND`, `NOTHING_PUBLISHED` or `VERSION_NOT_FOUND`.
    pub async fn landmarks(&self, map: &str, version: u64) -> Result<Vec<Landmark>, Error> {
        let mut request = ListLandmarksRequest {
            map: map.to_owned(),
            version,
            page_size: LANDMARKS_PAGE,
            page_token: String::new(),
        };
        let mut all = Vec::new();
        loop {
            let mut service = LandmarkServiceClient::new(self.channel.clone());
            let page = service.list_landmarks(call(request.clone())).await?.into_inner();
            all.extend(page.landmarks);
            if page.next_page_token.is_empty() {
                return Ok(all);
            }
            // All pages from one version, whatever is published meanwhile.
            request.version = page.map_version;
            request.page_token = page.next_page_token;
        }
    }

    fn jobs(&self) -> JobServiceClient<Channel> {
        JobServiceClient::new(self.channel.clone())
    }
}
