//! A fleet of unknown start, live: how the map of a large building grows together, and how true it is then.

use std::io;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::Context;
use meetpoint_client::{BatchSource, Client, DeliveryParams, Outgoing, SessionName, deliver, v1};
use meetpoint_geometry::{Point2, Pose};
use tokio::sync::watch;
use tokio::task::JoinSet;
use tokio::time::sleep;

use super::super::child::ChildService;
use super::super::poses::poses;
use super::super::rigid_motion::rigid_motion;
use super::fleet_drives::fleet_drives;
use super::settled::{settle, wait};
use crate::demo::SimulatedDrive;

const MAP: &str = "bench";
/// Batches that every robot sends from one look to the next: half a minute of driving.
const N_BATCHES_A_LOOK: u64 = 15;
/// Seconds of driving in a batch of the simulator.
const BATCH_S: f64 = 2.0;
/// Between two looks at whether all is mapped.
const LOOK_INTERVAL: Duration = Duration::from_millis(20);

/// Drives the robots and prints a row for every half minute of theirs, then how far they are off.
pub(super) async fn print(n_robots: u32, seed: u64, data: &Path) -> anyhow::Result<()> {
    let drives = tokio::task::spawn_blocking(move || fleet_drives(n_robots, seed)).await??;
    let (length_m, longest_s) = drives.iter().fold((0.0, 0.0_f64), |(length_m, longest_s), it| {
        (length_m + it.length_m, longest_s.max(it.duration_s))
    });
    println!("\n{n_robots} robots, {length_m:.0} m in all, the longest drive {longest_s:.0} s.\n");
    let service = ChildService::start(data, "fleet")?;
    let client = Client::connect(&service.url)?;
    client.create_map(MAP, 0.0).await?;
    let mut sessions = Vec::new();
    let (allow, allowed) = watch::channel(0);
    let mut sending = JoinSet::new();
    for drive in &drives {
        let (session, _) = client.open_session(drive.open_request(MAP, MAP)).await?;
        let mut source = Paced { batches: Arc::clone(&drive.batches), allowed: allowed.clone() };
        let (name, client) = (SessionName::from(&session), client.clone());
        sending.spawn(async move {
            let delivered = deliver(&client, &name, &mut source, &DeliveryParams::ROBOT, |_| ());
            delivered.await.map(|_| ())
        });
        sessions.push(session.id);
    }
    println!("| after | placed | to take it in and settle | memory |");
    println!("|---|---|---|---|");
    let n_batches = drives.iter().map(|drive| drive.batches.len() as u64).max().unwrap_or(0);
    let (mut through, begun, mut longest) = (0, Instant::now(), Duration::ZERO);
    while through < n_batches {
        through = n_batches.min(through + N_BATCHES_A_LOOK);
        let sent = Instant::now();
        allow.send_replace(through);
        for (drive, session) in drives.iter().zip(&sessions) {
            let own = through.min(drive.batches.len() as u64);
            while client.session(session).await?.mapped_through < own {
                sleep(LOOK_INTERVAL).await;
            }
        }
        wait(&client, MAP).await?;
        let took = sent.elapsed();
        longest = longest.max(took);
        println!(
            "| {:.0} s | {} | {:.1} s | {:.0} MB |",
            through as f64 * BATCH_S,
            n_placed(&client, &sessions).await?,
            took.as_secs_f64(),
            service.peak_memory_mb().unwrap_or(f64::NAN),
        );
    }
    while let Some(sent) = sending.join_next().await {
        sent?.context("a robot could not deliver")?;
    }
    settle(&client, MAP).await?;
    relax(&client).await?;
    let found = found(&client, &drives, &sessions).await?;
    print_errors(&found);
    println!(
        "\nAll of it took {:.1} s, half a minute at most {:.1} s; {:.1} s of processor time, {:.0} MB.",
        begun.elapsed().as_secs_f64(),
        longest.as_secs_f64(),
        service.cpu_s().unwrap_or(f64::NAN),
        service.peak_memory_mb().unwrap_or(f64::NAN),
    );
    Ok(())
}

/// All sessions relaxed together at the end.
async fn relax(client: &Client) -> anyhow::Result<()> {
    let request = v1::CreateJobRequest {
        map: MAP.to_owned(),
        kind: v1::JobKind::Relax.into(),
        ..v1::CreateJobRequest::default()
    };
    client.create_job(request).await?;
    wait(client, MAP).await
}

async fn n_placed(client: &Client, sessions: &[String]) -> anyhow::Result<usize> {
    let mut n_placed = 0;
    for session in sessions {
        n_placed += usize::from(client.session(session).await?.map_from_session.is_some());
    }
    Ok(n_placed)
}

/// Poses found and true ones of every robot that was placed.
type Found = Vec<(usize, Vec<(Pose, Pose)>)>;

async fn found(
    client: &Client,
    drives: &[SimulatedDrive],
    sessions: &[String],
) -> anyhow::Result<Found> {
    let mut found = Vec::new();
    for (index, (drive, session)) in drives.iter().zip(sessions).enumerate() {
        if client.session(session).await?.map_from_session.is_none() {
            continue;
        }
        let poses = poses(client, session).await?;
        let both =
            poses.iter().filter_map(|(&stamp_ns, &pose)| Some((pose, drive.truth(stamp_ns)?)));
        found.push((index, both.collect()));
    }
    Ok(found)
}

/// How far all poses are from the truth, once the whole map is laid over it.
fn print_errors(found: &Found) {
    let pair = |(pose, truth): &(Pose, Pose)| (pose.position(), truth.position());
    let all: Vec<(Point2<f64>, Point2<f64>)> =
        found.iter().flat_map(|(_, poses)| poses.iter().map(pair)).collect();
    let truth_from_map = rigid_motion(&all);
    let off = |poses: &[(Pose, Pose)]| {
        let errors = poses.iter().map(|(pose, truth)| truth.step_to(truth_from_map * *pose));
        let errors: Vec<(f64, f64)> =
            errors.map(|step| (step.distance_m(), step.theta_rad.abs())).collect();
        let n = errors.len().max(1) as f64;
        let mean_m = errors.iter().map(|error| error.0).sum::<f64>() / n;
        let mean_rad = errors.iter().map(|error| error.1).sum::<f64>() / n;
        (mean_m, errors.iter().map(|error| error.0).fold(0.0, f64::max), mean_rad)
    };
    println!("\n| robot | off the truth: mean, most, heading |");
    println!("|---|---|");
    for (index, poses) in found {
        let (mean_m, most_m, mean_rad) = off(poses);
        let degrees = mean_rad.to_degrees();
        println!("| {} | {mean_m:.3} m, {most_m:.3} m, {degrees:.2}° |", index + 1);
    }
}

/// A drive's batches, as far as they are allowed to be sent.
struct Paced {
    batches: Arc<[v1::Batch]>,
    allowed: watch::Receiver<u64>,
}

impl BatchSource for Paced {
    async fn get(&mut self, number: u64) -> io::Result<Outgoing> {
        let index = usize::try_from(number - 1).unwrap_or(usize::MAX);
        let Some(batch) = self.batches.get(index) else { return Ok(Outgoing::End) };
        // Who allows is gone when the bench has failed, which it tells itself.
        let _ = self.allowed.wait_for(|&allowed| number <= allowed).await;
        Ok(Outgoing::Batch(batch.clone()))
    }

    async fn forget_through(&mut self, _number: u64) -> io::Result<()> {
        Ok(())
    }
}
