//! `meetpoint replay`: sends recorded data as a robot would, over the public gRPC API only.
//!
//! A recording is read twice: once to declare its sensors, once to send it. The client's key of a
//! session is made from the recording's content and the options, and the same recording always
//! gives the same batches: a second replay finds the session of the first and goes on where that
//! stopped.

mod batches;
mod carmen;
mod completion;
mod lines;
mod log_source;
mod options;
mod progress;
mod report;
mod section;
mod survey;

use std::{
    collections::{BTreeMap, HashSet},
    path::{Path, PathBuf},
    sync::Arc,
};

use anyhow::{Context, bail};
use meetpoint_client::{
    Client, Delivered, DeliveryEvent, DeliveryParams, SessionName, deliver,
    v1::{OpenSessionRequest, Session, SessionState},
};

use crate::commands::ServerArgs;
use log_source::{LogReading, LogSource, Tally};
pub use options::{Rate, StartOption};
use progress::Progress;
use report::Report;
pub use section::Place;
use section::Section;
use survey::Survey;

/// Options of `meetpoint replay`.
#[derive(Clone, Debug, clap::Args)]
pub struct ReplayArgs {
    /// CARMEN logs, plain or gzipped; each becomes a session
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// The map to draw; it is made if there is none of that name
    #[arg(long, value_name = "MAP")]
    map: String,
    /// The robot's name; made from the file's name where none is given
    #[arg(long, value_name = "NAME")]
    robot: Option<String>,
    /// Where the robot begins: `known` (the map's origin), `unknown`, or a pose `X,Y,THETA` in
    /// metres and radians
    #[arg(long, value_name = "START", default_value = "known", allow_hyphen_values = true)]
    start: StartOption,
    /// How fast to send: `max`, or a multiple of real time such as `1x` or `10x`
    #[arg(long, value_name = "RATE", default_value = "max")]
    rate: Rate,
    /// Begin here: seconds (`90`, `0.5s`) or a share of the log (`0.25`, `25%`)
    #[arg(long, value_name = "PLACE")]
    from: Option<Place>,
    /// Stop before this place
    #[arg(long, value_name = "PLACE")]
    to: Option<Place>,
    /// Edge of a cell of a new map, in metres; the service's default where none is given
    #[arg(long, value_name = "METRES", default_value_t = 0.0, hide_default_value = true)]
    resolution: f64,
    #[command(flatten)]
    server: ServerArgs,
}

/// Replays every file, one after the other, and waits until all of each is mapped and in a
/// version.
///
/// # Errors
///
/// If anything of that was not done; what is needed to go on is in the message.
pub async fn run(args: ReplayArgs) -> anyhow::Result<()> {
    let client = args.server.client()?;
    for file in &args.files {
        let recording = Recording::open(&args, file).await?;
        let survey = &recording.survey;
        let report = recording.replay(&client).await?;
        if args.server.json {
            println!("{}", report.to_json(survey));
        } else {
            println!("{report}");
            for line in report::left_out(survey) {
                println!("{line}");
            }
            println!("{}", report.next_step());
        }
    }
    Ok(())
}

/// A recording and where it goes.
struct Recording<'a> {
    args: &'a ReplayArgs,
    file: &'a Path,
    robot: String,
    survey: Arc<Survey>,
    section: Section,
    tally: Tally,
    progress: Progress,
}

impl<'a> Recording<'a> {
    /// Reads the whole file once.
    async fn open(args: &'a ReplayArgs, file: &'a Path) -> anyhow::Result<Self> {
        let path = file.to_owned();
        let read = move || lines::open(&path).map(survey::survey);
        let survey = tokio::task::spawn_blocking(read)
            .await?
            .with_context(|| format!("cannot read {}", file.display()))?;
        let Some(stamps_ns) = survey.stamps_ns() else {
            let left_out = report::left_out(&survey).join("\n");
            let n_lines = survey.n_lines;
            bail!("{}: no laser scan in {n_lines} lines\n{left_out}", file.display());
        };
        let section = Section::new(args.from, args.to, stamps_ns);
        let sent = || survey.scan_stamps_ns.iter().filter(|&&stamp_ns| section.contains(stamp_ns));
        let driving_s = match (sent().min(), sent().max()) {
            (Some(first), Some(last)) => last.saturating_sub(*first) as f64 * 1e-9,
            _ => bail!("{}: no scan from --from to --to", file.display()),
        };
        let quiet = args.server.json;
        let tally = Tally::default();
        let progress = Progress::new(sent().count() as u64, driving_s, tally.clone(), quiet);
        let robot = args.robot.clone().unwrap_or_else(|| options::robot_name(file));
        Ok(Self { args, file, robot, survey: Arc::new(survey), section, tally, progress })
    }

    /// Sends what is not sent yet and waits for the map; Ctrl-C stops it.
    async fn replay(&self, client: &Client) -> anyhow::Result<Report> {
        let done = tokio::select! {
            done = self.replay_uninterrupted(client) => done,
            Ok(()) = tokio::signal::ctrl_c() => Err(anyhow::anyhow!(
                "stopped by Ctrl-C with {} scans acknowledged; the same command goes on from there",
                self.progress.n_acked()
            )),
        };
        self.progress.finish();
        done.with_context(|| format!("{} is not replayed to its end", self.file.display()))
    }

    async fn replay_uninterrupted(&self, client: &Client) -> anyhow::Result<Report> {
        self.ensure_map(client).await?;
        let session = self.open_session(client).await?;
        match session.state() {
            SessionState::Fenced => bail!(
                "robot `{}` has begun a newer session; a robot cannot go back: replay with another \
                 --robot",
                self.robot
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
            robot: self.robot.clone(),
            client_key: self.client_key(),
            start: Some(self.args.start.to_wire()),
            sensors: self.survey.lasers.iter().map(|laser| laser.sensor.clone()).collect(),
            ..OpenSessionRequest::default()
        };
        let (session, _) = client.open_session(request).await.context("cannot open a session")?;
        Ok(session)
    }

    /// Names this run for ever: same content, part, place and way of cutting, same session.
    fn client_key(&self) -> String {
        let Self { args, survey, section, .. } = self;
        let mut hasher = blake3::Hasher::new();
        hasher.update(survey.content_hash.as_bytes());
        hasher.update(
            format!("{}|{:?}|{section:?}|{}", args.map, args.start, batches::CUT_VERSION)
                .as_bytes(),
        );
        format!("replay-{}", &hasher.finalize().to_hex()[..32])
    }

    async fn send(&self, client: &Client, session: &Session) -> anyhow::Result<Sent> {
        let reading = LogReading {
            path: self.file.to_owned(),
            survey: Arc::clone(&self.survey),
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
        let n_before = self.tally.scans_through(session.acked_through);
        let n_scans = self.tally.scans_through(acked_through) - n_before;
        Ok(Sent { n_scans, n_reconnects, rejected })
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
        let (session, version) = completion::close_and_wait(client, session, look).await?;
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
        Ok(Report {
            file: self.file.display().to_string(),
            map: session.map,
            robot: session.robot,
            session: session.id,
            n_scans_sent: sent.n_scans,
            n_scans: session.scans,
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
    n_scans: u64,
    n_reconnects: u64,
    rejected: BTreeMap<String, u64>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Command {
        #[command(flatten)]
        replay: ReplayArgs,
    }

    /// The client's key of a session for a log of `n_scans` scans and more options.
    async fn key(n_scans: u32, name: &str, options: &[&str]) -> String {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join(name);
        let lines = (0..n_scans).map(|i| format!("FLASER 1 2 0 0 0 {i} 0 0 {i}.5 h 0"));
        std::fs::write(&file, lines.collect::<Vec<_>>().join("\n")).expect("a free disk");
        let words = [&["replay", "FILE", "--map", "lab"], options].concat();
        let args = Command::try_parse_from(words).map_err(|error| error.to_string());
        let args = args.expect("good options").replay;
        let recording = Recording::open(&args, &file).await.expect("a good log");
        recording.client_key()
    }

    #[tokio::test]
    async fn the_same_recording_finds_its_session_again() {
        let one = key(9, "a.log", &[]).await;
        assert_eq!(one, key(9, "b.clf", &[]).await, "whatever the file is called");
        assert_eq!(one, key(9, "a.log", &["--rate", "1x"]).await, "however fast it is sent");
        assert_eq!(one, key(9, "a.log", &["--start", "0,0,0"]).await, "known is the origin");
        assert_ne!(one, key(8, "a.log", &[]).await, "another recording");
        assert_ne!(one, key(9, "a.log", &["--start", "unknown"]).await, "another start");
        assert_ne!(one, key(9, "a.log", &["--to", "4s"]).await, "another part");
        assert!(one.len() <= 128, "the service takes it: {one}");
    }

    #[tokio::test]
    async fn a_file_without_scans_says_what_it_holds() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("notes.txt");
        std::fs::write(&file, "dear diary\nODOM 1\n").expect("a free disk");
        let args = Command::try_parse_from(["replay", "FILE", "--map", "lab"]).map_err(|_| ());
        let args = args.expect("good options").replay;
        let Err(error) = Recording::open(&args, &file).await else { panic!("no scans in it") };
        let text = error.to_string();
        assert!(text.contains("no laser scan in 2 lines"), "{text}");
        assert!(text.contains("line 2: no y"), "{text}");
    }
}
