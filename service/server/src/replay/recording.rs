//! One recording on its way to the service.

use std::collections::{BTreeMap, HashSet};

use anyhow::{Context, bail};
use meetpoint_client::{
    Client, Delivered, DeliveryEvent, DeliveryParams, SessionName, deliver,
    v1::{OpenSessionRequest, Session, SessionState},
};

use super::{
    ReplayArgs,
    account::Reading,
    assignment::Assignment,
    completion,
    content::Content,
    cutter,
    log_source::{LogReading, LogSource, Tally},
    progress::Progress,
    report::{self, Report},
    section::Section,
};

/// A recording and where it goes.
pub(super) struct Recording<'a> {
    args: &'a ReplayArgs,
    assignment: Assignment,
    pub(super) content: Content,
    section: Section,
    /// Readings in the section.
    n_readings: u64,
    tally: Tally,
    progress: Progress,
}

impl<'a> Recording<'a> {
    /// Reads the whole recording once.
    ///
    /// # Errors
    ///
    /// If it cannot be read, or has nothing in it to map.
    pub(super) async fn open(args: &'a ReplayArgs, assignment: Assignment) -> anyhow::Result<Self> {
        let source = assignment.source.clone();
        let shown = source.to_string();
        let anonymous = args.anonymous_landmarks;
        let content = tokio::task::spawn_blocking(move || source.read(anonymous))
            .await?
            .with_context(|| format!("cannot read {shown}"))?;
        let account = content.account();
        let reading = account.reading;
        let Some(span_ns) = account.stamps_span_ns() else {
            let left_out = report::left_out(account).join("\n");
            let (what, n_lines) = (reading.nothing(), account.n_lines);
            bail!("{shown}: no {what} in {n_lines} lines\n{left_out}");
        };
        let section = Section::new(args.from, args.to, span_ns);
        let sent = || account.stamps_ns.iter().filter(|&&stamp_ns| section.contains(stamp_ns));
        let driving_s = match (sent().min(), sent().max()) {
            (Some(first), Some(last)) => last.saturating_sub(*first) as f64 * 1e-9,
            _ => bail!("{shown}: no {} from --from to --to", reading.singular()),
        };
        let quiet = args.server.json;
        let tally = Tally::default();
        let n_readings = sent().count() as u64;
        let progress = Progress::new((reading, n_readings), driving_s, tally.clone(), quiet);
        Ok(Self { args, assignment, content, section, n_readings, tally, progress })
    }

    /// Sends what is not sent yet and waits for the map; Ctrl-C stops it.
    ///
    /// # Errors
    ///
    /// What the service refuses, or that it was away for too long.
    pub(super) async fn replay(&self, client: &Client) -> anyhow::Result<Report> {
        let done = tokio::select! {
            done = self.replay_uninterrupted(client) => done,
            Ok(()) = tokio::signal::ctrl_c() => Err(anyhow::anyhow!(
                "stopped by Ctrl-C with {} {} acknowledged; the same command goes on from there",
                self.progress.n_acked(),
                self.content.account().reading.plural()
            )),
        };
        self.progress.finish();
        done.with_context(|| format!("{} is not replayed to its end", self.assignment.source))
    }

    async fn replay_uninterrupted(&self, client: &Client) -> anyhow::Result<Report> {
        self.ensure_map(client).await?;
        let session = self.open_session(client).await?;
        match session.state() {
            SessionState::Fenced => bail!(
                "robot `{}` has begun a newer session; a robot cannot go back: replay with another \
                 --robot",
                self.assignment.robot
            ),
            SessionState::Closed => self.conclude(client, &session, Sent::default()).await,
            SessionState::Open | SessionState::Unspecified => {
                let sent = self.send(client, &session).await?;
                self.conclude(client, &session, sent).await
            }
        }
    }

    async fn ensure_map(&self, client: &Client) -> anyhow::Result<()> {
        let map = &self.args.map;
        match client.map(map).await {
            Ok(_) => return Ok(()),
            Err(error) if error.code() == Some("MAP_NOT_FOUND") => {}
            Err(error) => {
                let url = &self.args.server.server;
                return Err(error).with_context(|| {
                    format!("cannot ask the service at {url} (is `meetpoint serve` running there?)")
                });
            }
        }
        match client.create_map(map, self.args.resolution).await {
            Ok(_) => Ok(()),
            // Somebody was faster.
            Err(error) if error.code() == Some("MAP_EXISTS") => Ok(()),
            Err(error) => Err(error).with_context(|| format!("cannot make map `{map}`")),
        }
    }

    async fn open_session(&self, client: &Client) -> anyhow::Result<Session> {
        let request = OpenSessionRequest {
            map: self.args.map.clone(),
            robot: self.assignment.robot.clone(),
            client_key: self.client_key(),
            start: Some(self.assignment.start.to_wire()),
            sensors: self.content.sensors(),
            ..OpenSessionRequest::default()
        };
        let (session, _) = client.open_session(request).await.context("cannot open a session")?;
        Ok(session)
    }

    /// Names this run for ever: same content, part, place and way of cutting, same session.
    pub(super) fn client_key(&self) -> String {
        let Self { args, assignment, content, section, .. } = self;
        let mut hasher = blake3::Hasher::new();
        hasher.update(content.account().content_hash.as_bytes());
        hasher.update(
            format!("{}|{:?}|{section:?}|{}", args.map, assignment.start, cutter::CUT_VERSION)
                .as_bytes(),
        );
        format!("replay-{}", &hasher.finalize().to_hex()[..32])
    }

    async fn send(&self, client: &Client, session: &Session) -> anyhow::Result<Sent> {
        let reading = LogReading {
            content: self.content.clone(),
            section: self.section,
            rate: self.args.rate.times_real_time(),
        };
        let mut source = LogSource::start(reading, self.tally.clone());
        self.progress.resume(session);
        let mut rejections = HashSet::new();
        let mut rejected = BTreeMap::new();
        let events = |event| match event {
            DeliveryEvent::Sent { through } => self.progress.sent_through(through),
            DeliveryEvent::Acked { through } => self.progress.acked_through(through),
            DeliveryEvent::Rejected(rejection) => {
                if rejections.insert((rejection.batch_number, rejection.index)) {
                    *rejected.entry(rejection.code).or_insert(0) += 1;
                }
            }
            DeliveryEvent::Reconnecting { delay, error } => {
                let delay_s = delay.as_secs_f64();
                self.progress.say(&format!("{error}; trying again in {delay_s:.1} s"));
            }
            DeliveryEvent::Attached { .. } | DeliveryEvent::Corrected(_) => {}
        };
        let name = SessionName::from(session);
        let params =
            DeliveryParams { give_up_after: Some(completion::PATIENCE), ..DeliveryParams::ROBOT };
        let delivery = deliver(client, &name, &mut source, &params, events);
        let following = completion::follow(client, &session.id, |now| self.progress.look(now));
        let Delivered { acked_through, n_reconnects } = tokio::select! {
            delivered = delivery => delivered.context("the service did not take all batches")?,
            () = following => bail!("the session was followed to its end before it was sent"),
        };
        let n_before = self.tally.readings_through(session.acked_through);
        let n_readings = self.tally.readings_through(acked_through) - n_before;
        Ok(Sent { n_readings, n_reconnects, rejected })
    }

    /// Waits for the version that holds all, and says what was done.
    async fn conclude(
        &self,
        client: &Client,
        session: &Session,
        sent: Sent,
    ) -> anyhow::Result<Report> {
        let was_done = 0 < session.complete_in_version;
        let look = |now: &Session| self.progress.look(now);
        let (session, version) =
            completion::close_and_wait(client, session, self.n_readings, look).await?;
        let took_s = self.progress.took().as_secs_f64();
        let times_real_time = self.progress.times_real_time();
        let map = completion::patiently(|| client.map(&session.map)).await?;
        let lost = if version == 0 {
            Vec::new()
        } else {
            let trajectory =
                completion::patiently(|| client.trajectory(&session.id, version, "")).await?;
            report::lost_spans(&trajectory.poses)
        };
        let reading = self.content.account().reading;
        let n_readings = match reading {
            Reading::Scan => session.scans,
            // The service does not count them; all were sent.
            Reading::Sighting => self.n_readings,
        };
        Ok(Report {
            file: self.assignment.source.to_string(),
            map: session.map,
            robot: session.robot,
            session: session.id,
            reading,
            n_sent: sent.n_readings,
            n_readings,
            n_rejected: session.rejected,
            rejected: sent.rejected,
            n_reconnects: sent.n_reconnects,
            took_s,
            times_real_time,
            lost,
            map_version: version,
            published: map.published_version == version,
            was_done,
        })
    }
}

/// What [`Recording::send`] did.
#[derive(Default)]
struct Sent {
    n_readings: u64,
    n_reconnects: u64,
    rejected: BTreeMap<String, u64>,
}
