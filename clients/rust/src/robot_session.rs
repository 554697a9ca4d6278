//! One run of a robot, from its cold start to its end, whether the service is there or not.

mod folder;

use std::{io, path::Path};

use meetpoint_proto::v1::{
    Batch, Delivery, Observation, OpenSessionRequest, Sensor, Session, SessionState, Start,
};
use prost::Message;
use tokio::task::{JoinHandle, spawn_blocking};

use crate::{
    backoff::Backoff,
    client::Client,
    delivery::{DeliveryEvent, DeliveryParams, SessionName, deliver},
    error::{BATCH_BYTES_MAX, Error, OBSERVATIONS_MAX},
    spool::{Spool, SpoolParams, SpoolSource, SpoolWriter, spool_channel},
};
use folder::{KeptRun, RobotFolder};

/// What a robot says of itself when a run begins.
#[derive(Clone, Debug, Default)]
pub struct Run {
    /// The map to work on; it must exist.
    pub map: String,
    /// The robot's name, always the same.
    pub robot: String,
    /// Where the run begins; `None` for the map's origin.
    pub start: Option<Start>,
    /// The sensors whose readings will be sent.
    pub sensors: Vec<Sensor>,
    /// Whether live mapping may leave out scans.
    pub delivery: Delivery,
}

/// Tunables of [`RobotSession`].
#[derive(Clone, Copy, Debug)]
pub struct RobotParams {
    /// Of the spool of each run.
    pub spool: SpoolParams,
    /// Of the deliveries.
    pub delivery: DeliveryParams,
}

impl RobotParams {
    /// For robots.
    pub const ROBOT: Self = Self { spool: SpoolParams::ROBOT, delivery: DeliveryParams::ROBOT };
}

/// What happens in the background of a run.
#[derive(Debug)]
pub enum RobotEvent {
    /// A session stands at the service: of an earlier run that was not delivered, or of this one.
    Opened(Box<Session>),
    /// News of the delivery.
    Delivery(DeliveryEvent),
    /// A run is at the service to its end, and its session closed.
    Closed(Box<Session>),
    /// The service does not take an earlier run: it was set aside in the folder `refused`.
    Refused {
        /// The run.
        epoch: u64,
        /// Why.
        error: Error,
    },
}

/// A run under way. What is sent goes to the disk at once and to the service when it can.
#[derive(Debug)]
pub struct RobotSession {
    writer: SpoolWriter,
    epoch: u64,
    background: Background,
}

/// The delivery, which ends with its session.
#[derive(Debug)]
struct Background(JoinHandle<Result<Session, Error>>);

impl Drop for Background {
    fn drop(&mut self) {
        self.0.abort();
    }
}

impl RobotSession {
    /// Begins a run: raises the robot's epoch, opens a spool in `folder`, and starts to deliver in
    /// the background; first what earlier runs left, each under its own session.
    ///
    /// Returns at once, whether the service is there or not. Dropping it stops the delivery soon
    /// after; what was not delivered will be by the next run.
    ///
    /// # Errors
    ///
    /// [`Error::Folder`] if the folder cannot be used or another process uses it.
    pub async fn start(
        client: Client,
        folder: &Path,
        run: Run,
        params: RobotParams,
        events: impl FnMut(RobotEvent) + Send + 'static,
    ) -> Result<Self, Error> {
        let path = folder.to_owned();
        let prepare = move || Prepared::new(&path, run, params.spool);
        let prepared = in_background(prepare).await?;
        let Prepared { folder, earlier, this, spool } = prepared;
        let epoch = this.request.epoch;
        let (writer, source) = spool_channel(spool);
        let mut deliverer = Deliverer { client, folder, params, events };
        let background = tokio::spawn(async move {
            for run in earlier {
                deliverer.deliver_earlier(run).await?;
            }
            deliverer.deliver_run(&this, source).await
        });
        Ok(Self { writer, epoch, background: Background(background) })
    }

    /// Keeps a batch, to be delivered; gives its number. Waits for the disk, not for the service.
    ///
    /// # Errors
    ///
    /// [`Error::BatchTooLarge`], which the service would say much later; [`Error::Folder`] if the
    /// disk does not take it.
    pub async fn send(&self, observations: Vec<Observation>) -> Result<u64, Error> {
        let n_observations = observations.len();
        // The largest number takes the most bytes.
        let batch = Batch { number: u64::MAX, observations };
        let n_bytes = batch.encoded_len();
        if OBSERVATIONS_MAX < n_observations || BATCH_BYTES_MAX < n_bytes {
            return Err(Error::BatchTooLarge { n_observations, n_bytes });
        }
        let observations = batch.observations;
        self.writer.append(observations).await.map_err(Error::Folder)
    }

    /// The epoch of this run.
    pub fn epoch(&self) -> u64 {
        self.epoch
    }

    /// Batches that a full or damaged spool had to drop.
    ///
    /// # Errors
    ///
    /// [`Error::Folder`] if the spool cannot be asked.
    pub async fn n_dropped(&self) -> Result<u64, Error> {
        self.writer.n_dropped().await.map_err(Error::Folder)
    }

    /// True if the delivery has ended early, because the service refuses this run for good;
    /// [`RobotSession::finish`] tells why. Batches are still kept on disk.
    pub fn is_refused(&self) -> bool {
        self.background.0.is_finished()
    }

    /// Stops the delivery and lets go of the folder. What was not delivered will be by the next
    /// run.
    ///
    /// # Errors
    ///
    /// [`Error::Folder`] if the disk does not say that it has all batches.
    pub async fn stop(self) -> Result<(), Error> {
        let Self { writer, mut background, .. } = self;
        background.0.abort();
        // Cancelled, or done: both is what is wanted.
        drop((&mut background.0).await);
        writer.sync().await.map_err(Error::Folder)
    }

    /// Ends the run: waits until the service has all of it, and closes the session.
    ///
    /// # Errors
    ///
    /// Why the service refuses this run for good. Its batches stay on disk.
    pub async fn finish(self) -> Result<Session, Error> {
        let Self { writer, mut background, .. } = self;
        writer.sync().await.map_err(Error::Folder)?;
        drop(writer);
        (&mut background.0).await.map_err(|error| Error::Folder(io::Error::other(error)))?
    }
}

/// A folder made ready for a run.
struct Prepared {
    folder: RobotFolder,
    earlier: Vec<KeptRun>,
    this: KeptRun,
    spool: Spool,
}

impl Prepared {
    fn new(path: &Path, run: Run, params: SpoolParams) -> io::Result<Self> {
        let folder = RobotFolder::open(path)?;
        let earlier = folder.unfinished_runs()?;
        let epoch = folder.raise_epoch()?;
        let Run { map, robot, start, sensors, delivery } = run;
        let nonce = rand::random::<u64>();
        let this = folder.begin_run(OpenSessionRequest {
            map,
            robot,
            client_key: format!("{epoch}-{nonce:016x}"),
            epoch,
            start,
            sensors,
            delivery: delivery.into(),
        })?;
        let spool = Spool::open(&this.path, params)?;
        Ok(Self { folder, earlier, this, spool })
    }
}

/// Brings runs to the service, one after the other.
struct Deliverer<F> {
    client: Client,
    folder: RobotFolder,
    params: RobotParams,
    events: F,
}

impl<F: FnMut(RobotEvent) + Send> Deliverer<F> {
    /// Brings an earlier run to its end, or sets it aside.
    async fn deliver_earlier(&mut self, run: KeptRun) -> Result<(), Error> {
        let (path, params) = (run.path.clone(), self.params.spool);
        let spool = in_background(move || Spool::open(&path, params)).await?;
        if spool.next_number() == 1 {
            return run.remove().map_err(Error::Folder);
        }
        // Without a writer the session ends with what is there.
        let (_, source) = spool_channel(spool);
        let Err(error) = self.deliver_run(&run, source).await else { return Ok(()) };
        if matches!(error, Error::Folder(_)) {
            return Err(error);
        }
        self.folder.set_aside(&run).map_err(Error::Folder)?;
        (self.events)(RobotEvent::Refused { epoch: run.request.epoch, error });
        Ok(())
    }

    /// Opens the session of a run, delivers all of it, closes the session and removes the run.
    async fn deliver_run(&mut self, run: &KeptRun, source: SpoolSource) -> Result<Session, Error> {
        let mut source = source;
        let opened = self.open(run).await?;
        let closed = opened.state() == SessionState::Closed;
        (self.events)(RobotEvent::Opened(Box::new(opened.clone())));
        let name = SessionName::from(&opened);
        let events = |event| (self.events)(RobotEvent::Delivery(event));
        if !closed {
            deliver(&self.client, &name, &mut source, &self.params.delivery, events).await?;
        }
        let closed = self.close(&name).await?;
        run.remove().map_err(Error::Folder)?;
        (self.events)(RobotEvent::Closed(Box::new(closed.clone())));
        Ok(closed)
    }

    /// Opens the session, however long the service is away.
    async fn open(&mut self, run: &KeptRun) -> Result<Session, Error> {
        let mut backoff = Backoff::new(self.params.delivery.backoff);
        loop {
            match self.client.open_session(run.request.clone()).await {
                Ok((session, _)) => return Ok(session),
                Err(error) => self.wait(&mut backoff, error).await?,
            }
        }
    }

    async fn close(&mut self, name: &SessionName) -> Result<Session, Error> {
        let mut backoff = Backoff::new(self.params.delivery.backoff);
        loop {
            match self.client.close_session(&name.id, name.epoch).await {
                Ok(session) => return Ok(session),
                Err(error) => self.wait(&mut backoff, error).await?,
            }
        }
    }

    /// Waits before the next attempt, or gives the error back if there is no point in one.
    async fn wait(&mut self, backoff: &mut Backoff, error: Error) -> Result<(), Error> {
        if !error.is_retryable() {
            return Err(error);
        }
        let delay = backoff.next_delay(error.retry_after());
        (self.events)(RobotEvent::Delivery(DeliveryEvent::Reconnecting { delay, error }));
        tokio::time::sleep(delay).await;
        Ok(())
    }
}

/// Work that waits for the disk, on a thread that may.
async fn in_background<T: Send + 'static>(
    work: impl FnOnce() -> io::Result<T> + Send + 'static,
) -> Result<T, Error> {
    let done = spawn_blocking(work).await.map_err(io::Error::other);
    done.flatten().map_err(Error::Folder)
}
