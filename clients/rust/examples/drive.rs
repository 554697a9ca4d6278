//! A robot that drives for ten seconds and sends what it sees. Copy it, and put your drivers in
//! the place of `odometry` and `scan`. The map must exist:
//! `curl -d '{"id": "office"}' -H 'content-type: application/json' http://127.0.0.1:7373/v1/maps`
//!
//!     cargo run -p meetpoint-client --example drive -- http://127.0.0.1:7373 office

use std::{env, f64::consts::PI, path::Path, time::Duration};

use meetpoint_client::{Client, Error, RobotParams, RobotSession, Run, v1};
use v1::{observation::Kind, sensor};

#[tokio::main]
async fn main() -> Result<(), Error> {
    let url = env::args().nth(1).unwrap_or_else(|| "http://127.0.0.1:7373".to_owned());
    let map = env::args().nth(2).unwrap_or_else(|| "office".to_owned());
    let laser = v1::LaserGeometry {
        angle_min_rad: -PI,
        angle_increment_rad: PI / 180.0,
        n_beams: 360,
        range_min_m: 0.05,
        range_max_m: 12.0,
    };
    let laser = v1::Sensor {
        id: "laser".to_owned(),
        robot_from_sensor: Some(v1::Pose { x_m: 0.1, y_m: 0.0, theta_rad: 0.0 }),
        kind: Some(sensor::Kind::Laser(laser)),
    };
    let run = Run { map, robot: "rosie".to_owned(), sensors: vec![laser], ..Run::default() };
    let client = Client::connect(&url)?;
    let folder = Path::new("rosie-spool");
    // Works without the service, too: batches wait in the folder until it is there.
    let events = |event| println!("{event:?}");
    let session = RobotSession::start(client, folder, run, RobotParams::ROBOT, events).await?;
    for second in 0..10 {
        let stamp_ns = second * 1_000_000_000;
        // Odometry first, then the scan that was taken there.
        session.send(vec![odometry(stamp_ns, second as f64 * 0.2), scan(stamp_ns)]).await?;
        tokio::time::sleep(Duration::from_secs(1)).await;
    }
    let session = session.finish().await?;
    println!("{} scans delivered in session {}", session.scans, session.id);
    Ok(())
}

fn odometry(stamp_ns: i64, x_m: f64) -> v1::Observation {
    let pose = v1::Pose { x_m, y_m: 0.0, theta_rad: 0.0 };
    let kind = Kind::OdometryPose(v1::OdometryPose { odometry_from_robot: Some(pose) });
    v1::Observation { stamp_ns, kind: Some(kind), ..v1::Observation::default() }
}

fn scan(stamp_ns: i64) -> v1::Observation {
    let kind = Kind::LaserScan(v1::LaserScan { ranges_m: vec![3.0; 360], intensities: vec![] });
    let sensor_id = "laser".to_owned();
    v1::Observation { stamp_ns, sensor_id, kind: Some(kind), ..v1::Observation::default() }
}
