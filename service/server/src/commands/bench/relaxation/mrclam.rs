//! Real robots: each robot of an MRCLAM folder replayed and relaxed through the whole service, with
//! identities and without, against motion capture.

use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::Context;
use meetpoint_client::{Client, v1};
use meetpoint_geometry::{Point2, Pose};
use tokio::time::sleep;
use v1::create_job_request::Params;

use super::super::child::ChildService;
use super::super::ground_truth::{GroundTruth, TrueWay};
use super::super::matching::matched;
use super::super::replaying::{replayed, session_of};
use super::super::rigid_motion::rigid_motion;

/// Between two looks at whether a job is done.
const LOOK_INTERVAL: Duration = Duration::from_millis(20);

/// How a relaxed session compares with the truth.
struct Errors {
    /// Landmarks told.
    n_found: usize,
    /// Those that are a true one.
    n_matched: usize,
    /// Mean and largest distance of these from the true ones, in metres.
    landmark_off_m: [f64; 2],
    /// Root mean square of the distances of poses from the true ones, in metres.
    path_off_m: f64,
}

/// Prints a row for every robot and way of seeing.
pub(super) async fn print(folder: &Path, data: &Path) -> anyhow::Result<()> {
    let truth = GroundTruth::read(folder)?;
    let service = ChildService::start(data, "mrclam")?;
    let client = Client::connect(&service.url)?;
    println!(
        "| robot | sightings | landmarks found, of {} | landmarks off: mean, most | path off | confidence | s |",
        truth.landmarks.len()
    );
    println!("|---|---|---|---|---|---|---|");
    for (number, way) in &truth.robots {
        let map = format!("robot-{number}");
        let session = replay(folder, *number, &map, &service.url)?;
        for (name, forget_identities) in [("identities", false), ("anonymous", true)] {
            let begun = Instant::now();
            let told = relax(&client, &map, forget_identities).await?;
            let seconds = begun.elapsed().as_secs_f64();
            let landmarks = client.landmarks(&map, 0).await?;
            let trajectory = client.trajectory(&session, 0, "robot").await?;
            let Errors { n_found, n_matched, landmark_off_m: [mean_m, most_m], path_off_m } =
                errors(landmarks, &trajectory, (&truth, way));
            println!(
                "| {number}, {name} | {} | {n_matched} ({n_found} told) | {mean_m:.3} m, {most_m:.3} m | {path_off_m:.3} m | {:.3} | {seconds:.1} |",
                told.sightings, told.confidence,
            );
        }
    }
    if let Some(mb) = service.peak_memory_mb() {
        println!("\nPeak memory of the service: {mb:.0} MB.");
    }
    Ok(())
}

/// Replays one robot.
fn replay(folder: &Path, number: u32, map: &str, url: &str) -> anyhow::Result<String> {
    let options = ["--source-robot", &number.to_string()];
    Ok(session_of(&replayed(folder, map, &options, url)?)?.to_owned())
}

/// Runs a relax job to its end.
async fn relax(
    client: &Client,
    map: &str,
    forget_identities: bool,
) -> anyhow::Result<v1::RelaxedSession> {
    let params = v1::RelaxParams { forget_identities, ..v1::RelaxParams::default() };
    let request = v1::CreateJobRequest {
        map: map.to_owned(),
        kind: v1::JobKind::Relax.into(),
        priority: 0,
        params: Some(Params::Relax(params)),
    };
    let mut job = client.create_job(request).await?;
    while !job.done {
        sleep(LOOK_INTERVAL).await;
        job = client.job(&job.id).await?;
    }
    if let Some(error) = &job.error {
        anyhow::bail!("the job of {map} failed: {}", error.message);
    }
    let Some(v1::job::Result::RelaxResult(result)) = job.result else {
        anyhow::bail!("the job of {map} has no result");
    };
    result.sessions.into_iter().next().with_context(|| format!("no session of {map} was relaxed"))
}

/// Compares what was found with the truth, after the rigid motion that takes the landmarks nearest to
/// the true ones.
fn errors(
    mut landmarks: Vec<v1::Landmark>,
    trajectory: &v1::Trajectory,
    (truth, way): (&GroundTruth, &TrueWay),
) -> Errors {
    landmarks.sort_by_key(|landmark| std::cmp::Reverse(landmark.sightings));
    let pairs = pairs(&landmarks, truth);
    let truth_from_map = rigid_motion(&pairs);
    let off_m = |(from, to): &(Point2<f64>, Point2<f64>)| (truth_from_map * *from - to).norm();
    let off: Vec<f64> = pairs.iter().map(off_m).collect();
    Errors {
        n_found: landmarks.len(),
        n_matched: pairs.len(),
        landmark_off_m: [
            off.iter().sum::<f64>() / off.len() as f64,
            off.iter().copied().fold(f64::NAN, f64::max),
        ],
        path_off_m: path_off_m(truth_from_map, trajectory, way),
    }
}

/// Landmarks found with the true ones: by their names, or by their places if they have none.
fn pairs(landmarks: &[v1::Landmark], truth: &GroundTruth) -> Vec<(Point2<f64>, Point2<f64>)> {
    let place =
        |landmark: &v1::Landmark| landmark.position.map(|point| Point2::new(point.x_m, point.y_m));
    if landmarks.iter().any(|landmark| landmark.identity.is_some()) {
        let named = landmarks.iter().filter_map(|landmark| {
            let subject: u32 = landmark.identity.as_ref()?.parse().ok()?;
            Some((place(landmark)?, *truth.landmarks.get(&subject)?))
        });
        return named.collect();
    }
    let found: Vec<Point2<f64>> = landmarks.iter().filter_map(place).collect();
    let known: Vec<Point2<f64>> = truth.landmarks.values().copied().collect();
    matched(&found, &known).into_iter().map(|(a, b)| (found[a], known[b])).collect()
}

fn path_off_m(truth_from_map: Pose, trajectory: &v1::Trajectory, way: &TrueWay) -> f64 {
    let squares = trajectory.poses.iter().filter_map(|pose| {
        let v1::Pose { x_m, y_m, .. } = pose.pose?;
        let truth = way.at(pose.stamp_ns)?;
        Some((truth_from_map * Point2::new(x_m, y_m) - truth).norm_squared())
    });
    let squares: Vec<f64> = squares.collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}
