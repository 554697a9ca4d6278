//! The last step of the demo: a robot explores a building that nobody has mapped, by asking the
//! service where to go.

use std::path::Path;
use std::time::Duration;

use anyhow::Context;
use meetpoint_client::{Client, RobotParams, RobotSession, Run, v1};
use meetpoint_geometry::{Point2, Pose};
use meetpoint_occupancy::terminal;
use meetpoint_sim::{ChaCha8Rng, Drive, Robot, Tick, rooms};
use rand::SeedableRng;
use tokio::time::sleep;

use super::delivery::LOOK_INTERVAL;
use super::drives::{START_NS, observations, sensor};
use crate::commands::map;

/// The map that it draws.
const MAP: &str = "rooms";
/// The robot.
const ROBOT: &str = "explorer";
/// Ways are asked for so much farther from walls than the robot is wide, in metres: it cuts corners.
const SPARE_M: f64 = 0.1;
/// Ticks between two questions: a second of driving.
const N_TICKS_A_ROUND: usize = 20;
/// It believes that nothing is left when it was told so for so many rounds, in which it turned around.
const N_ROUNDS_DONE: u32 = 6;
/// A robot that is not done by then never will be, in seconds of its clock.
const DURATION_MAX_S: f64 = 900.0;
/// Between two looks at whether a round is mapped.
const ROUND_LOOK_INTERVAL: Duration = Duration::from_millis(5);
/// Columns of the drawing: 9 m.
const N_COLUMNS: usize = 40;

/// Has a robot explore a small building until nothing is left.
pub(super) async fn explored(client: &Client, data: &Path, seed: u64) -> anyhow::Result<()> {
    println!(
        "\nAnother robot, in a building of 9 by 7 m that nobody has mapped. Nobody tells it where"
    );
    println!("to drive: once a second it asks the service for the nearest place never seen.\n");
    client.create_map(MAP, 0.0).await.context("cannot make the map")?;
    let building = rooms().building;
    let place = building.place('A').context("the building lacks its start")?;
    let start = Pose::new(place.x, place.y, 0.0);
    let rng = ChaCha8Rng::seed_from_u64(seed);
    let drive = Drive::standing(&building, Robot::INDOOR, start, START_NS, rng);
    let mut drive = drive.context("the robot does not fit at its start")?;
    let robot = started(client, data).await?;
    let (mut way_m, mut n_questions, mut n_done) = (0.0, 0_u32, 0_u32);
    let last = loop {
        let ticks: Vec<Tick> = drive.by_ref().take(N_TICKS_A_ROUND).collect();
        way_m += ticks
            .windows(2)
            .map(|pair| pair[0].truth.step_to(pair[1].truth).distance_m())
            .sum::<f64>();
        let told = asked(client, &robot, &ticks).await?;
        n_questions += 1;
        anyhow::ensure!(drive.elapsed_s() < DURATION_MAX_S, "{ROBOT} found no end of it");
        let given = told.robots.first().context("the robot has no place in its map")?;
        match given.goal {
            Some(_) => follow(&mut drive, given),
            None if n_done == 0 => drive.look_around(),
            None => {}
        }
        n_done = if given.goal.is_none() { n_done + 1 } else { 0 };
        if n_done == N_ROUNDS_DONE {
            break told;
        }
    };
    tell(&last, drive.elapsed_s(), way_m, n_questions);
    let session = robot.finish().await.context("the explorer's run was refused")?;
    while client.session(&session.id).await?.complete_in_version == 0 {
        sleep(LOOK_INTERVAL).await;
    }
    let grid = client.grid(MAP, 0).await.context("cannot get the grid")?;
    println!("\n{}", terminal(&map::raster(grid)?, N_COLUMNS));
    Ok(())
}

/// A robot as robots are: what it sends is on its disk first.
async fn started(client: &Client, data: &Path) -> anyhow::Result<RobotSession> {
    let run = Run {
        map: MAP.to_owned(),
        robot: ROBOT.to_owned(),
        start: None,
        sensors: vec![sensor(&Robot::INDOOR.laser)],
        delivery: v1::Delivery::Complete,
    };
    let folder = data.join(ROBOT);
    let robot = RobotSession::start(client.clone(), &folder, run, RobotParams::ROBOT, |_| ()).await;
    robot.context("the explorer cannot begin its run")
}

/// Sends what was seen, and asks until the answer holds for it.
async fn asked(
    client: &Client,
    robot: &RobotSession,
    ticks: &[Tick],
) -> anyhow::Result<v1::Exploration> {
    if !ticks.is_empty() {
        robot.send(ticks.iter().flat_map(observations).collect()).await?;
    }
    let scans = ticks.iter().filter(|tick| tick.scan.is_some());
    let newest_ns = scans.map(|tick| tick.stamp_ns).max().unwrap_or(i64::MIN);
    let kind = v1::robot_choice::Kind::RobotRadiusM(Robot::INDOOR.radius_m + SPARE_M);
    let request = v1::GetExplorationRequest {
        map: MAP.to_owned(),
        robot: Some(v1::RobotChoice { kind: Some(kind) }),
        ..v1::GetExplorationRequest::default()
    };
    loop {
        anyhow::ensure!(!robot.is_refused(), "the service refuses the explorer's run");
        match client.exploration(request.clone()).await {
            Ok(v1::GetExplorationResponse { exploration: Some(told), .. })
                if told.robots.iter().any(|given| newest_ns <= given.stamp_ns) =>
            {
                return Ok(told);
            }
            Ok(_) => {}
            // Before the first scan is mapped.
            Err(error) if error.code() == Some("NOTHING_OBSERVED") => {}
            Err(error) => return Err(error.into()),
        }
        sleep(ROUND_LOOK_INTERVAL).await;
    }
}

/// Has the robot go the way that it was given, by where it takes itself to be.
fn follow(drive: &mut Drive, given: &v1::RobotExploration) {
    let v1::Pose { x_m, y_m, theta_rad } = given.pose.unwrap_or_default();
    let truth_from_map = drive.truth() * Pose::new(x_m, y_m, theta_rad).inverse();
    let way = given.points.iter().map(|at| truth_from_map * Point2::new(at.x_m, at.y_m));
    drive.follow(&way.collect::<Vec<_>>());
}

fn tell(last: &v1::Exploration, duration_s: f64, way_m: f64, n_questions: u32) {
    let v1::Exploration { observed_m2, frontier_m, .. } = last;
    println!(
        "  it drove {way_m:.0} m in {duration_s:.0} s of its time, asked {n_questions} times, and has"
    );
    if last.explored {
        println!("  seen {observed_m2:.0} m²; nothing that it can reach is left");
    } else {
        println!("  seen {observed_m2:.0} m²; {frontier_m:.1} m of frontiers are left");
    }
}
