//! How long ingest takes while relax jobs run one after the other, and while none does.

use std::io;
use std::path::Path;
use std::time::Duration;

use anyhow::Context;
use meetpoint_client::{BatchSource, Client, DeliveryParams, Outgoing, SessionName, deliver, v1};
use meetpoint_sim::{LandmarkTravel, Moment, first_data_set};
use tokio::time::sleep;
use v1::observation::Kind;

use super::super::child::ChildService;
use super::super::ingest::{Measured, measure};
use super::super::percentile::{milliseconds, percentile};
use crate::convert;

/// Robots that send, as in `bench ingest`.
const N_ROBOTS: usize = 32;
/// From one scan of a robot to the next.
const PERIOD: Duration = Duration::from_millis(100);
/// Seconds of each run.
const N_SECONDS: u64 = 30;
/// Runs of each kind, in turn.
const N_RUNS: usize = 2;
/// Between two looks at whether a job is done.
const LOOK_INTERVAL: Duration = Duration::from_millis(200);
/// The map that is relaxed.
const MAP: &str = "relaxed";
/// The sensor that sights landmarks.
const BUTTON: &str = "button";
/// A button must be declared with some range, in metres: a person's reach.
const BUTTON_RANGE_M: f64 = 0.3;
/// The robot's clock at the start, 2026-01-01, and a control's time, in nanoseconds.
const START_NS: i64 = 1_767_225_600_000_000_000;
const CONTROL_NS: i64 = 100_000_000;
/// Controls a batch.
const N_CONTROLS_A_BATCH: usize = 20;

/// Prints both in turn and their ratio.
pub(super) async fn print(data: &Path, seed: u64) -> anyhow::Result<()> {
    let service = ChildService::start(data, "beside")?;
    let client = Client::connect(&service.url)?;
    send(&client, &first_data_set(seed)).await?;
    println!(
        "| {N_ROBOTS} robots, 10 scans a second each, {N_SECONDS} s | p50, ms | p99, ms | longest, ms | jobs done |"
    );
    println!("|---|---|---|---|---|");
    let (mut alone, mut beside) = (Vec::new(), Vec::new());
    for run in 0..N_RUNS {
        let measured =
            measure(&client, &format!("alone-{run}"), N_ROBOTS, N_SECONDS, PERIOD).await?;
        print_row("alone", &measured, 0);
        alone.extend(measured.latencies);
        let map = format!("beside-{run}");
        let mut n_jobs = 0;
        let measured = tokio::select! {
            measured = measure(&client, &map, N_ROBOTS, N_SECONDS, PERIOD) => measured?,
            failed = relax_on_and_on(&client, &mut n_jobs) => return failed,
        };
        print_row("beside relax jobs", &measured, n_jobs);
        beside.extend(measured.latencies);
    }
    alone.sort_unstable();
    beside.sort_unstable();
    let ratio =
        |share| percentile(&beside, share).as_secs_f64() / percentile(&alone, share).as_secs_f64();
    println!(
        "\nBeside jobs p50 is {:.2} times, p99 {:.2} times as long.",
        ratio(0.50),
        ratio(0.99)
    );
    Ok(())
}

fn print_row(name: &str, measured: &Measured, n_jobs: u32) {
    let told = [0.50, 0.99, 1.0].map(|share| milliseconds(percentile(&measured.latencies, share)));
    println!("| {name} | {:.1} | {:.1} | {:.1} | {n_jobs} |", told[0], told[1], told[2]);
}

/// Starts a job whenever the one before is done. Ends only if one fails.
async fn relax_on_and_on(client: &Client, n_done: &mut u32) -> anyhow::Result<()> {
    loop {
        let request = v1::CreateJobRequest {
            map: MAP.to_owned(),
            kind: v1::JobKind::Relax.into(),
            ..v1::CreateJobRequest::default()
        };
        let mut job = client.create_job(request).await?;
        while !job.done {
            sleep(LOOK_INTERVAL).await;
            job = client.job(&job.id).await?;
        }
        if let Some(error) = &job.error {
            anyhow::bail!("the job failed: {}", error.message);
        }
        *n_done += 1;
    }
}

/// Sends a travel as its robot would.
async fn send(client: &Client, travel: &LandmarkTravel) -> anyhow::Result<()> {
    client.create_map(MAP, 0.0).await?;
    let start = v1::Start { kind: Some(v1::start::Kind::Known(v1::Pose::default())) };
    let detector = v1::LandmarkDetector {
        range_max_m: BUTTON_RANGE_M,
        half_field_of_view_rad: std::f64::consts::PI,
    };
    let button = v1::Sensor {
        id: BUTTON.to_owned(),
        robot_from_sensor: None,
        kind: Some(v1::sensor::Kind::LandmarkDetector(detector)),
    };
    let open = v1::OpenSessionRequest {
        map: MAP.to_owned(),
        robot: "button".to_owned(),
        client_key: MAP.to_owned(),
        epoch: 0,
        start: Some(start),
        sensors: vec![button],
        delivery: v1::Delivery::Complete.into(),
    };
    let (session, _) = client.open_session(open).await?;
    let name = SessionName::from(&session);
    let mut source = Batches(batches(travel));
    deliver(client, &name, &mut source, &DeliveryParams::ROBOT, |_| ())
        .await
        .context("the travel cannot be sent")?;
    client.close_session(&session.id, session.epoch).await?;
    Ok(())
}

/// Batches that are there already.
struct Batches(Vec<v1::Batch>);

impl BatchSource for Batches {
    async fn get(&mut self, number: u64) -> io::Result<Outgoing> {
        let index = usize::try_from(number - 1).unwrap_or(usize::MAX);
        Ok(self.0.get(index).map_or(Outgoing::End, |batch| Outgoing::Batch(batch.clone())))
    }

    async fn forget_through(&mut self, _number: u64) -> io::Result<()> {
        Ok(())
    }
}

fn batches(travel: &LandmarkTravel) -> Vec<v1::Batch> {
    let stamped: Vec<(i64, &Moment)> =
        (0..).map(|index: i64| START_NS + index * CONTROL_NS).zip(&travel.moments).collect();
    let batches = (1..).zip(stamped.chunks(N_CONTROLS_A_BATCH));
    batches
        .map(|(number, moments)| v1::Batch {
            number,
            observations: moments.iter().flat_map(observations).collect(),
        })
        .collect()
}

fn observations(&(stamp_ns, moment): &(i64, &Moment)) -> Vec<v1::Observation> {
    let at = |sensor_id: &str, kind| v1::Observation {
        stamp_ns,
        monotonic_ns: None,
        sensor_id: sensor_id.to_owned(),
        kind: Some(kind),
    };
    let odometry_from_robot = Some(convert::pose::to_wire(moment.odometry));
    let odometry = Kind::OdometryPose(v1::OdometryPose { odometry_from_robot });
    let pressed =
        moment.sightings.first().map(|_| Kind::LandmarkSighting(v1::LandmarkSighting::default()));
    std::iter::once(at("", odometry)).chain(pressed.map(|kind| at(BUTTON, kind))).collect()
}
