//! Starting and stopping the service, in order.

use std::fs::{File, TryLockError};
use std::net::SocketAddr;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use anyhow::Context;
use axum::Router;
use axum::extract::Request;
use axum::http::header::CONTENT_TYPE;
use meetpoint_storage::{Store, StoreSettings};
use tokio::net::TcpListener;
use tokio::sync::Semaphore;
use tokio::task::JoinHandle;
use tokio_util::sync::CancellationToken;
use tower::ServiceExt;

use crate::activity::Activity;
use crate::hypotheses::Travels;
use crate::ingest::{JournalWriter, KnownSessions};
use crate::jobs;
use crate::live::Live;
use crate::mapping::{Actors, Sensing};
use crate::merging;
use crate::operations::graphs::TopologyCache;
use crate::operations::grids::GridCache;
use crate::operations::imports;
use crate::planning::{self, Planner};
use crate::service::{Parts, Service};
use crate::session_cache::SessionCache;
use crate::settings::{MappingSettings, Settings};
use crate::sonar_weights::{Purpose, SonarWeights};
use crate::{grpc, listener, rest, telemetry};

/// The database's file within the data folder.
const DATABASE_FILE: &str = "meetpoint.db";
/// Held while a process uses the folder.
const LOCK_FILE: &str = "meetpoint.lock";
/// How often histograms are drained.
const METRICS_UPKEEP: Duration = Duration::from_secs(5);

/// A service that listens.
pub struct Running {
    /// Where it listens, the real port included.
    pub address: SocketAddr,
    service: Service,
    accepting: JoinHandle<()>,
    committing: JoinHandle<()>,
    working: JoinHandle<()>,
    upkeep: JoinHandle<()>,
    /// Locked for as long as it is open.
    _lock: File,
}

/// Opens the database, continues what was interrupted, and listens.
///
/// # Errors
/// If the folder is in use or cannot be written, the database cannot be opened, or the port is
/// taken; the message says what to do.
pub async fn start(settings: Settings) -> anyhow::Result<Running> {
    telemetry::start_metrics()?;
    let data = &settings.server.data;
    std::fs::create_dir_all(data)
        .with_context(|| format!("cannot make the data folder {}", data.display()))?;
    let lock = lock(data)?;
    let store = open_store(&settings).await?;
    let live = Live::new();
    let sensing = Arc::new(sensing(&settings)?);
    let actors = Actors::new(store.clone(), live.clone(), settings.mapping.clone(), sensing);
    let activity = Activity::new();
    let into = (store.clone(), actors.clone(), activity.clone());
    let (journal, committing) = JournalWriter::start(into, settings.journal.clone());
    let planner = Planner::new(&settings.planning);
    let explorations = SessionCache::new(settings.qualitative.n_kept_max);
    let service = Service(Arc::new(Parts {
        settings,
        store,
        live,
        activity,
        actors,
        journal,
        known_sessions: KnownSessions::default(),
        grids: GridCache::default(),
        topologies: TopologyCache::default(),
        planner,
        travels: Travels::default(),
        explorations,
        importing: Arc::new(Semaphore::new(imports::N_AT_ONCE)),
        stop: CancellationToken::new(),
    }));
    let (host, port) = (service.settings.server.host, service.settings.server.port);
    let listener = TcpListener::bind((host, port))
        .await
        .with_context(|| format!("cannot listen on {host}:{port}; try --port 0 for a free one"))?;
    let address = listener.local_addr()?;
    service.actors.start_unfinished().await.context("cannot read the maps")?;
    let working = tokio::spawn(jobs::work(service.clone()));
    tokio::spawn(jobs::closing::watch(service.clone()));
    tokio::spawn(planning::keep_ready(service.clone()));
    tokio::spawn(merging::keep_asking(service.clone()));
    let activity = service.activity.clone();
    let router = joined(rest::router(&service), grpc::router(&service).await?, activity);
    let (server, stop) = (service.settings.server.clone(), service.stop.clone());
    let accepting =
        tokio::spawn(async move { listener::accept(listener, router, &server, stop).await });
    let upkeep = tokio::spawn(async {
        let mut ticks = tokio::time::interval(METRICS_UPKEEP);
        loop {
            ticks.tick().await;
            telemetry::upkeep();
        }
    });
    Ok(Running { address, service, accepting, committing, working, upkeep, _lock: lock })
}

impl Running {
    /// Stops in order: no new requests, what is acknowledged is durable already, maps are saved,
    /// the database is closed.
    ///
    /// # Errors
    /// If a part of the service had failed.
    pub async fn stop(self) -> anyhow::Result<()> {
        let Self { address: _, service, accepting, committing, working, upkeep, _lock } = self;
        service.stop.cancel();
        accepting.await?;
        working.await?;
        service.actors.stop().await;
        upkeep.abort();
        committing.abort();
        service.store.close().await;
        Ok(())
    }
}

/// By what maps are drawn.
fn sensing(settings: &Settings) -> anyhow::Result<Sensing> {
    let weights = |path: &Path, purpose, setting: &'static str| {
        if path.as_os_str().is_empty() {
            return Ok(SonarWeights::shipped(purpose));
        }
        SonarWeights::read(path, purpose).context(setting)
    };
    let MappingSettings { sonar_weights, sonar_following_weights, .. } = &settings.mapping;
    let drawing = weights(sonar_weights, Purpose::Drawing, "the setting mapping.sonar_weights")?;
    let following = weights(
        sonar_following_weights,
        Purpose::Following,
        "the setting mapping.sonar_following_weights",
    )?;
    tracing::info!(drawing = drawing.name, following = following.name, "sonar weights");
    Ok(Sensing::indoor(drawing, following))
}

fn lock(data: &Path) -> anyhow::Result<File> {
    let path = data.join(LOCK_FILE);
    let file = File::options()
        .create(true)
        .truncate(false)
        .write(true)
        .open(&path)
        .with_context(|| format!("cannot write {}", path.display()))?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => anyhow::bail!(
            "another meetpoint uses {}; stop it, or give this one another folder by --data",
            data.display()
        ),
        Err(TryLockError::Error(error)) => {
            Err(error).with_context(|| format!("cannot lock {}", path.display()))
        }
    }
}

async fn open_store(settings: &Settings) -> anyhow::Result<Store> {
    let path = settings.server.data.join(DATABASE_FILE);
    let shown = path.display().to_string();
    let store = Store::open(&StoreSettings {
        path,
        n_readers: settings.journal.n_readers,
        busy_timeout_ms: settings.journal.busy_timeout_ms,
    })
    .await
    .with_context(|| format!("cannot open the database {shown}"))?;
    // The folder is locked: whoever held a lease in this database is gone.
    store.release_all_leases().await.with_context(|| format!("cannot write to {shown}"))?;
    Ok(store)
}

/// One router for both: gRPC is told by its content type.
fn joined(rest: Router, grpc: Router, activity: Activity) -> Router {
    let choose = move |request: Request| {
        activity.touch_by_request(request.uri().path());
        let is_grpc = request
            .headers()
            .get(CONTENT_TYPE)
            .is_some_and(|kind| kind.as_bytes().starts_with(b"application/grpc"));
        let router = if is_grpc { grpc.clone() } else { rest.clone() };
        router.oneshot(request)
    };
    Router::new().fallback_service(tower::service_fn(choose))
}
