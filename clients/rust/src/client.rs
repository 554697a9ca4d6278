//! Single questions to the service, over one connection that heals itself.

mod changes;
mod closures;
mod exploration;
mod jobs;
mod merges;
mod parameters;
mod places;
mod plans;
mod qualitative;

use std::time::Duration;

use meetpoint_proto::v1::{
    Ack, Batch, CloseSessionRequest, CreateMapRequest, GetGraphRequest, GetGridRequest,
    GetMapRequest, GetMapVersionRequest, GetSessionRequest, GetTrajectoryRequest, Graph,
    GraphPruning, Grid, ImportHead, ImportMapRequest, ImportMapResponse, IngestBatchRequest,
    IngestRequest, IngestResponse, ListSessionsRequest, Map, MapVersion, OpenSessionRequest,
    OpenSessionResponse, Session, Trajectory, graph_service_client::GraphServiceClient,
    grid_service_client::GridServiceClient, import_map_request::Kind as Part, ingest_batch_request,
    map_service_client::MapServiceClient, session_service_client::SessionServiceClient,
};
use tokio_stream::wrappers::ReceiverStream;
use tonic::{
    Request, Streaming,
    transport::{Channel, Endpoint},
};

use crate::error::Error;

/// A connection attempt that takes longer has failed.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(5);
/// A single question that takes longer has failed.
const CALL_TIMEOUT: Duration = Duration::from_secs(30);
/// An import that takes longer has failed: 64 MB at 5 Mbit/s.
const IMPORT_TIMEOUT: Duration = Duration::from_mins(3);
/// Bytes of an image that one message carries: well below the service's limit of a message.
const IMAGE_PIECE_BYTES: usize = 1 << 20;
/// Between pings, which find a dead Wi-Fi link and keep address translations alive. The service
/// permits pings from 20 s on.
const PING_INTERVAL: Duration = Duration::from_secs(25);
/// A ping that is not answered for so long means that the connection is dead.
const PING_TIMEOUT: Duration = Duration::from_secs(10);
/// The largest answer taken: a grid of 16 777 216 cells and its frame.
const ANSWER_BYTES_MAX: usize = 20 << 20;
/// Sessions a page of a list: the most that the service gives.
const SESSIONS_PAGE: u32 = 1000;
/// Poses a page of a trajectory.
const TRAJECTORY_PAGE: u32 = 50_000;

/// The service, as seen from a robot. Clones share one connection.
#[derive(Clone, Debug)]
pub struct Client {
    channel: Channel,
}

impl Client {
    /// A client of the service at `url`, for example `http://127.0.0.1:7373`; without a scheme
    /// `http://` is meant. Connects at the first question, and again whenever the connection was
    /// lost.
    ///
    /// Must be called within a tokio runtime.
    ///
    /// # Errors
    ///
    /// [`Error::Url`] if the address cannot be read.
    pub fn connect(url: &str) -> Result<Self, Error> {
        let full = if url.contains("://") { url.to_owned() } else { format!("http://{url}") };
        let bad = |reason: String| Error::Url { url: url.to_owned(), reason };
        let endpoint = Endpoint::from_shared(full).map_err(|error| bad(error.to_string()))?;
        match endpoint.uri().scheme_str() {
            Some("http") if endpoint.uri().host().is_some() => {}
            _ => return Err(bad("it must look like http://host:port".to_owned())),
        }
        let channel = endpoint
            .connect_timeout(CONNECT_TIMEOUT)
            .tcp_nodelay(true)
            .http2_keep_alive_interval(PING_INTERVAL)
            .keep_alive_timeout(PING_TIMEOUT)
            .keep_alive_while_idle(true)
            .connect_lazy();
        Ok(Self { channel })
    }

    /// Makes an empty map; `resolution_m` is the edge of a cell, 0 for the service's default.
    ///
    /// # Errors
    ///
    /// `MAP_EXISTS` if the id is taken.
    pub async fn create_map(&self, id: &str, resolution_m: f64) -> Result<Map, Error> {
        let map = Map { id: id.to_owned(), resolution_m, ..Map::default() };
        let response = self.maps().create_map(call(CreateMapRequest { map: Some(map) })).await?;
        response.into_inner().map.ok_or(Error::Malformed("map"))
    }

    /// One map.
    ///
    /// # Errors
    ///
    /// `MAP_NOT_FOUND` if there is none of that id.
    pub async fn map(&self, id: &str) -> Result<Map, Error> {
        let response = self.maps().get_map(call(GetMapRequest { map: id.to_owned() })).await?;
        response.into_inner().map.ok_or(Error::Malformed("map"))
    }

    /// One version of a map; 0 for the published one.
    ///
    /// # Errors
    ///
    /// `MAP_NOT_FOUND` or `VERSION_NOT_FOUND`.
    pub async fn map_version(&self, map: &str, number: u64) -> Result<MapVersion, Error> {
        let request = GetMapVersionRequest { map: map.to_owned(), number };
        let response = self.maps().get_map_version(call(request)).await?;
        response.into_inner().version.ok_or(Error::Malformed("version"))
    }

    /// The whole grid of a version of a map; 0 for the published one.
    ///
    /// # Errors
    ///
    /// `MAP_NOT_FOUND`, `VERSION_NOT_FOUND`, or `GRID_TOO_LARGE`.
    pub async fn grid(&self, map: &str, version: u64) -> Result<Grid, Error> {
        let request = GetGridRequest { map: map.to_owned(), version, bounding_box: None };
        let mut grids = GridServiceClient::new(self.channel.clone())
            .max_decoding_message_size(ANSWER_BYTES_MAX);
        let response = grids.get_grid(call(request)).await?;
        response.into_inner().grid.ok_or(Error::Malformed("grid"))
    }

    /// The topological graph of a version of a map (0 for the published one), its regions with
    /// outlines if asked for.
    ///
    /// # Errors
    ///
    /// `MAP_NOT_FOUND`, `VERSION_NOT_FOUND`, `NOTHING_OBSERVED`, `MAP_TOO_LARGE` or `GRAPH_NOT_MADE`.
    pub async fn graph(
        &self,
        map: &str,
        version: u64,
        pruning: GraphPruning,
        outlines: bool,
    ) -> Result<Graph, Error> {
        let (map, pruning) = (map.to_owned(), pruning.into());
        let request = GetGraphRequest { map, version, pruning, outlines, ..Default::default() };
        let mut graphs = GraphServiceClient::new(self.channel.clone())
            .max_decoding_message_size(ANSWER_BYTES_MAX);
        let response = graphs.get_graph(call(request)).await?;
        response.into_inner().graph.ok_or(Error::Malformed("graph"))
    }

    /// Makes a version of a map, and the map if there is none of that id, from the files of a
    /// `map_server` map: the text of its YAML and its PNG or PGM image.
    ///
    /// # Errors
    ///
    /// `MAP_NOT_EMPTY` if robots have observed the map or other files were imported,
    /// `MAP_TOO_LARGE`, `MESSAGE_TOO_LARGE`, or what is wrong with the files.
    pub async fn import_map(
        &self,
        map: &str,
        yaml: &str,
        image: &[u8],
    ) -> Result<ImportMapResponse, Error> {
        let head = ImportHead { map: map.to_owned(), yaml: yaml.to_owned() };
        let pieces = image.chunks(IMAGE_PIECE_BYTES).map(|piece| Part::Image(piece.to_vec()));
        let kinds: Vec<Part> = std::iter::once(Part::Head(head)).chain(pieces).collect();
        let messages = kinds.into_iter().map(|kind| ImportMapRequest { kind: Some(kind) });
        let mut request = Request::new(tokio_stream::iter(messages));
        request.set_timeout(IMPORT_TIMEOUT);
        Ok(self.maps().import_map(request).await?.into_inner())
    }

    /// Opens a session, or finds the one that was opened with the same robot and client key.
    ///
    /// # Errors
    ///
    /// `MAP_NOT_FOUND`, `SESSION_KEY_TAKEN`, `SESSION_FENCED`, or what is wrong with the request.
    pub async fn open_session(
        &self,
        request: OpenSessionRequest,
    ) -> Result<(Session, OpenSessionResponse), Error> {
        let mut response = self.sessions().open_session(call(request)).await?.into_inner();
        let session = response.session.take().ok_or(Error::Malformed("session"))?;
        Ok((session, response))
    }

    /// One session.
    ///
    /// # Errors
    ///
    /// `SESSION_NOT_FOUND` if there is none of that id.
    pub async fn session(&self, id: &str) -> Result<Session, Error> {
        let request = GetSessionRequest { session: id.to_owned() };
        let response = self.sessions().get_session(call(request)).await?;
        response.into_inner().session.ok_or(Error::Malformed("session"))
    }

    /// Sends one batch and waits until it is durable: for a robot that asks for something after each. A stream is
    /// faster for all others: [`crate::deliver`].
    ///
    /// # Errors
    ///
    /// `SESSION_NOT_FOUND`, `SESSION_FENCED`, `SESSION_CLOSED`, `SEQUENCE_GAP` or `BATCH_CONTENT_MISMATCH`.
    pub async fn ingest_batch(&self, session: &Session, batch: Batch) -> Result<Ack, Error> {
        let (id, epoch) = (session.id.clone(), session.epoch);
        let request = IngestBatchRequest {
            session: id,
            epoch,
            kind: Some(ingest_batch_request::Kind::Batch(batch)),
        };
        let response = self.sessions().ingest_batch(call(request)).await?;
        response.into_inner().ack.ok_or(Error::Malformed("ack"))
    }

    /// Says that nothing more will come. Closing a closed session is fine.
    ///
    /// # Errors
    ///
    /// `SESSION_NOT_FOUND`, or `SESSION_FENCED` if the epoch is not the session's own.
    pub async fn close_session(&self, id: &str, epoch: u64) -> Result<Session, Error> {
        let request = CloseSessionRequest { session: id.to_owned(), epoch };
        let response = self.sessions().close_session(call(request)).await?;
        response.into_inner().session.ok_or(Error::Malformed("session"))
    }

    /// The newest session of a map, `None` if it has none.
    ///
    /// # Errors
    ///
    /// `MAP_NOT_FOUND` if there is no map of that id.
    pub async fn latest_session(&self, map: &str) -> Result<Option<Session>, Error> {
        let mut request = ListSessionsRequest {
            map: map.to_owned(),
            page_size: SESSIONS_PAGE,
            ..ListSessionsRequest::default()
        };
        let mut latest = None;
        loop {
            let page = self.sessions().list_sessions(call(request.clone())).await?.into_inner();
            latest = page.sessions.into_iter().next_back().or(latest);
            if page.next_page_token.is_empty() {
                return Ok(latest);
            }
            request.page_token = page.next_page_token;
        }
    }

    /// The whole trajectory of a session in a map version (0 for the published one): the poses of
    /// `frame`, which is `robot` or the id of a sensor.
    ///
    /// # Errors
    ///
    /// `SESSION_NOT_FOUND`, `VERSION_NOT_FOUND`, or `SENSOR_NOT_FOUND`.
    pub async fn trajectory(
        &self,
        session: &str,
        version: u64,
        frame: &str,
    ) -> Result<Trajectory, Error> {
        let mut request = GetTrajectoryRequest {
            session: session.to_owned(),
            version,
            frame: frame.to_owned(),
            offset: 0,
            page_size: TRAJECTORY_PAGE,
        };
        let (mut whole, mut next) = self.trajectory_page(request.clone()).await?;
        // All pages from one version, whatever is published meanwhile.
        request.version = whole.map_version;
        while next != 0 {
            request.offset = next;
            let (page, after) = self.trajectory_page(request.clone()).await?;
            whole.poses.extend(page.poses);
            next = after;
        }
        Ok(whole)
    }

    /// One page of a trajectory, and where the next one begins; 0 at the end.
    async fn trajectory_page(
        &self,
        request: GetTrajectoryRequest,
    ) -> Result<(Trajectory, u64), Error> {
        let response = self.sessions().get_trajectory(call(request)).await?.into_inner();
        Ok((response.trajectory.ok_or(Error::Malformed("trajectory"))?, response.next_offset))
    }

    /// Opens an ingest stream.
    pub(crate) async fn ingest(
        &self,
        requests: ReceiverStream<IngestRequest>,
    ) -> Result<Streaming<IngestResponse>, Error> {
        Ok(self.sessions().ingest(requests).await?.into_inner())
    }

    fn maps(&self) -> MapServiceClient<Channel> {
        MapServiceClient::new(self.channel.clone())
    }

    fn sessions(&self) -> SessionServiceClient<Channel> {
        SessionServiceClient::new(self.channel.clone()).max_decoding_message_size(ANSWER_BYTES_MAX)
    }
}

/// A request with a deadline, which the service sees too.
fn call<T>(message: T) -> Request<T> {
    let mut request = Request::new(message);
    request.set_timeout(CALL_TIMEOUT);
    request
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn addresses_are_checked_at_once() {
        for good in ["http://127.0.0.1:7373", "localhost:7373", "http://[::1]:7373/"] {
            assert!(Client::connect(good).is_ok(), "{good}");
        }
        for bad in ["", "ftp://host", "https://host", "http://", "a b"] {
            let error = Client::connect(bad).expect_err(bad);
            assert!(matches!(error, Error::Url { .. }), "{bad}: {error}");
        }
    }

    #[tokio::test]
    async fn nobody_there_is_retryable() {
        // Port 1 is reserved and refused on loopback.
        let client = Client::connect("http://127.0.0.1:1").expect("a good address");
        let error = client.map("office").await.expect_err("nobody listens");
        assert!(error.is_retryable(), "{error}");
        assert!(matches!(error, Error::Unreachable(_)), "{error}");
    }
}
