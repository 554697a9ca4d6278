//! `meetpoint bench ingest`: how fast batches become durable, and how many.

use std::path::PathBuf;
use std::time::Duration;

use anyhow::Context;
use meetpoint_client::{Client, DeliveryEvent, DeliveryParams, SessionName, deliver, v1};
use tokio::task::JoinSet;
use tokio::time::{Instant, sleep};

use super::child::ChildService;
use super::percentile::{milliseconds, percentile};
use super::robots::{BenchRobot, ReadyTimes, robots};

/// Between two looks at how far mapping is.
const LOOK_INTERVAL: Duration = Duration::from_millis(50);

/// Options of `meetpoint bench ingest`.
#[derive(Debug, clap::Args)]
pub(super) struct IngestArgs {
    /// Robots that send at a pace
    #[arg(long, default_value_t = 32)]
    robots: usize,
    /// Scans a second of each
    #[arg(long, default_value_t = 10.0)]
    rate: f64,
    /// Seconds that they send
    #[arg(long, default_value_t = 60)]
    seconds: u64,
    /// Seconds that 1, 2, 4... robots send as fast as they can
    #[arg(long, default_value_t = 5)]
    burst_seconds: u64,
    /// Folder for the database, on the disk that is to be measured
    #[arg(long, value_name = "FOLDER", default_value = ".")]
    data: PathBuf,
}

/// What robots saw together.
pub(super) struct Measured {
    /// From when a batch was due to its durable ack, ascending.
    pub(super) latencies: Vec<Duration>,
    n_scans: u64,
    acked_in: Duration,
    mapped_in: Duration,
}

/// Measures at a pace, then as fast as robots can.
pub(super) async fn run(args: IngestArgs) -> anyhow::Result<()> {
    anyhow::ensure!(args.rate > 0.0, "the rate must be above 0");
    let service = ChildService::start(&args.data, "ingest")?;
    let client = Client::connect(&service.url)?;
    let period = Duration::from_secs_f64(1.0 / args.rate);
    let paced = measure(&client, "paced", args.robots, args.seconds, period).await?;
    println!(
        "{} robots, {} scans a second of 360 beams each, {} s:",
        args.robots, args.rate, args.seconds
    );
    println!(
        "  {} batches acknowledged, none lost; due to durable ack: p50 {:.1} ms, p99 {:.1} ms, longest {:.1} ms",
        paced.n_scans,
        milliseconds(percentile(&paced.latencies, 0.50)),
        milliseconds(percentile(&paced.latencies, 0.99)),
        milliseconds(percentile(&paced.latencies, 1.0)),
    );
    println!("\n| robots, as fast as they can | scans/s acknowledged | scans/s mapped |");
    println!("|---|---|---|");
    let mut n_robots = 1;
    while n_robots <= args.robots {
        let map = format!("burst-{n_robots}");
        let burst = measure(&client, &map, n_robots, args.burst_seconds, Duration::ZERO).await?;
        println!(
            "| {n_robots} | {:.0} | {:.0} |",
            burst.n_scans as f64 / burst.acked_in.as_secs_f64(),
            burst.n_scans as f64 / burst.mapped_in.as_secs_f64(),
        );
        n_robots *= 2;
    }
    if let Some(mb) = service.peak_memory_mb() {
        println!("\nPeak memory of the service: {mb:.0} MB.");
    }
    Ok(())
}

/// Robots send to a new map at a pace, until so many seconds are over and all is mapped; as fast as
/// they can with a period of zero.
pub(super) async fn measure(
    client: &Client,
    map: &str,
    n_robots: usize,
    seconds: u64,
    period: Duration,
) -> anyhow::Result<Measured> {
    client.create_map(map, 0.0).await?;
    let name = map.to_owned();
    let robots = tokio::task::spawn_blocking(move || robots(n_robots, &name)).await?;
    let mut sessions = Vec::new();
    for robot in &robots {
        sessions.push(client.open_session(robot.open.clone()).await?.0);
    }
    let begin = Instant::now();
    let end = begin + Duration::from_secs(seconds);
    let mut sending = JoinSet::new();
    for (robot, session) in robots.iter().zip(&sessions) {
        sending.spawn(send(
            client.clone(),
            SessionName::from(session),
            robot,
            [begin, end],
            period,
        ));
    }
    let (mut latencies, mut n_scans) = (Vec::new(), 0);
    while let Some(sent) = sending.join_next().await {
        let (n, mut of_one) = sent??;
        n_scans += n;
        latencies.append(&mut of_one);
    }
    let acked_in = begin.elapsed();
    for session in &sessions {
        client.close_session(&session.id, session.epoch).await?;
    }
    wait_until_mapped(client, &sessions).await?;
    latencies.sort_unstable();
    Ok(Measured { latencies, n_scans, acked_in, mapped_in: begin.elapsed() })
}

/// One robot's delivery: batches acknowledged, and how long each took.
fn send(
    client: Client,
    session: SessionName,
    robot: &BenchRobot,
    [begin, end]: [Instant; 2],
    period: Duration,
) -> impl Future<Output = anyhow::Result<(u64, Vec<Duration>)>> + Send + use<> {
    let ready = ReadyTimes::default();
    let mut source = robot.source(begin, end, period, ready.clone());
    async move {
        let (mut latencies, mut acked) = (Vec::new(), 0);
        let told = |event| {
            if let DeliveryEvent::Acked { through } = event {
                let now = Instant::now();
                let newly = (acked + 1..=through).filter_map(|number| ready.of(number));
                latencies.extend(newly.map(|due| now.duration_since(due)));
                acked = through;
            }
        };
        let params = DeliveryParams::ROBOT;
        let delivered = deliver(&client, &session, &mut source, &params, told)
            .await
            .context("a robot could not deliver")?;
        Ok((delivered.acked_through, latencies))
    }
}

async fn wait_until_mapped(client: &Client, sessions: &[v1::Session]) -> anyhow::Result<()> {
    for session in sessions {
        while client.session(&session.id).await?.complete_in_version == 0 {
            sleep(LOOK_INTERVAL).await;
        }
    }
    Ok(())
}
