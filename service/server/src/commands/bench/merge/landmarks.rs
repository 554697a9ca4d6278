//! Real robots that see landmarks and no walls: five of an MRCLAM folder, none of which is told where it
//! starts, through the whole service, against motion capture.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

use meetpoint_client::{Client, v1};
use meetpoint_geometry::{Point2, Pose};

use super::super::child::ChildService;
use super::super::ground_truth::{GroundTruth, TrueWay};
use super::super::matching::matched;
use super::super::poses::poses;
use super::super::replaying::{replayed, session_of};
use super::super::rigid_motion::rigid_motion;
use super::settled::{is_accepted, merge_of, settle, verdict};

/// The site has no two places alike.
const SETTINGS: [(&str, &str); 2] = [
    ("MEETPOINT_MERGING__LANDMARKS_ACCEPTS_NAMELESS", "true"),
    ("MEETPOINT_MERGING__LOOKS_AGAIN", "false"),
];

/// Prints a row for every robot, with the names of landmarks and without.
pub(super) async fn print(folder: &Path, data: &Path) -> anyhow::Result<()> {
    let truth = GroundTruth::read(folder)?;
    println!("\n| robot | verdict | accepted | seen from the first, off by |");
    println!("|---|---|---|---|");
    for (name, options) in [("identities", &[][..]), ("anonymous", &["--anonymous-landmarks"][..])]
    {
        let service = ChildService::start_with(data, name, &SETTINGS)?;
        let client = Client::connect(&service.url)?;
        let mut sessions = Vec::new();
        for (number, _) in &truth.robots {
            let (robot, number) = (format!("robot-{number}"), number.to_string());
            let mut all = vec!["--source-robot", number.as_str(), "--robot", robot.as_str()];
            all.extend(["--start", "unknown"]);
            all.extend(options);
            let replayed = replayed(folder, name, &all, &service.url)?;
            sessions.push(session_of(&replayed)?.to_owned());
        }
        let begun = Instant::now();
        settle(&client, name).await?;
        let seconds = begun.elapsed().as_secs_f64();
        print_robots(&client, name, &truth, &sessions).await?;
        let landmarks = client.landmarks(name, 0).await?;
        print_landmarks(name, &landmarks, &truth, seconds);
    }
    Ok(())
}

async fn print_robots(
    client: &Client,
    name: &str,
    truth: &GroundTruth,
    sessions: &[String],
) -> anyhow::Result<()> {
    let mut first = None;
    for ((number, way), session) in truth.robots.iter().zip(sessions) {
        let merge = merge_of(client, name, session).await?;
        let truth_from_map = over_truth(&poses(client, session).await?, way);
        let first = *first.get_or_insert(truth_from_map);
        let between = first.inverse() * truth_from_map;
        let accepted = if is_accepted(&merge) { "yes" } else { "no" };
        println!(
            "| {number}, {name} | {} | {accepted} | {:.3} m, {:.2}° |",
            verdict(&merge),
            between.distance_m(),
            between.theta_rad.abs().to_degrees()
        );
    }
    Ok(())
}

/// The motion that takes a robot's whole way nearest to the true one.
fn over_truth(poses: &BTreeMap<i64, Pose>, way: &TrueWay) -> Pose {
    let pairs: Vec<(Point2<f64>, Point2<f64>)> = poses
        .iter()
        .filter_map(|(&stamp_ns, pose)| Some((pose.position(), way.at(stamp_ns)?)))
        .collect();
    rigid_motion(&pairs)
}

fn print_landmarks(name: &str, landmarks: &[v1::Landmark], truth: &GroundTruth, seconds: f64) {
    let place = |it: &v1::Landmark| it.position.map(|point| Point2::new(point.x_m, point.y_m));
    let mut surest: Vec<&v1::Landmark> = landmarks.iter().collect();
    surest.sort_by_key(|landmark| std::cmp::Reverse(landmark.sightings));
    let found: Vec<Point2<f64>> = surest.into_iter().filter_map(place).collect();
    let known: Vec<Point2<f64>> = truth.landmarks.values().copied().collect();
    let pairs: Vec<(Point2<f64>, Point2<f64>)> =
        matched(&found, &known).into_iter().map(|(a, b)| (found[a], known[b])).collect();
    let truth_from_map = rigid_motion(&pairs);
    let off: Vec<f64> =
        pairs.iter().map(|(from, to)| (truth_from_map * *from - to).norm()).collect();
    let mean_m = off.iter().sum::<f64>() / off.len().max(1) as f64;
    let most_m = off.iter().copied().fold(0.0, f64::max);
    println!(
        "| {name}, landmarks | {} told, {} of {} true ones | | {mean_m:.3} m, at most {most_m:.3} m; merged \
         and relaxed in {seconds:.1} s |",
        landmarks.len(),
        off.len(),
        known.len()
    );
}
