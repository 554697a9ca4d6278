//! Messages as the JSON that REST takes.

use meetpoint_client::v1;
use serde_json::{Value, json};
use v1::observation::Kind;

pub(crate) fn opening(request: &v1::OpenSessionRequest) -> Value {
    let v1::OpenSessionRequest { map, robot, client_key, epoch, start, sensors, delivery } =
        request;
    let mut body = json!({
        "map": map,
        "robot": robot,
        "client_key": client_key,
        "epoch": epoch,
        "sensors": sensors.iter().map(sensor).collect::<Vec<_>>(),
    });
    match start.and_then(|start| start.kind) {
        Some(v1::start::Kind::Known(known)) => body["start"] = json!({"known": pose(&known)}),
        Some(v1::start::Kind::Unknown(_)) => body["start"] = json!({"unknown": {}}),
        None => {}
    }
    if *delivery == i32::from(v1::Delivery::BoundedLag) {
        body["delivery"] = json!("BOUNDED_LAG");
    }
    body
}

fn sensor(sensor: &v1::Sensor) -> Value {
    let v1::Sensor { id, robot_from_sensor, kind } = sensor;
    let mut body = json!({"id": id});
    if let Some(mounted) = robot_from_sensor {
        body["robot_from_sensor"] = pose(mounted);
    }
    match kind {
        Some(v1::sensor::Kind::Laser(laser)) => {
            body["laser"] = json!({
                "angle_min_rad": laser.angle_min_rad,
                "angle_increment_rad": laser.angle_increment_rad,
                "n_beams": laser.n_beams,
                "range_min_m": laser.range_min_m,
                "range_max_m": laser.range_max_m,
            });
        }
        Some(v1::sensor::Kind::SonarRing(ring)) => {
            body["sonar_ring"] = json!({
                "sensor_from_transducer":
                    ring.sensor_from_transducer.iter().map(pose).collect::<Vec<_>>(),
                "cone_angle_rad": ring.cone_angle_rad,
                "range_min_m": ring.range_min_m,
                "range_max_m": ring.range_max_m,
            });
        }
        Some(v1::sensor::Kind::LandmarkDetector(detector)) => {
            body["landmark_detector"] = json!({
                "range_max_m": detector.range_max_m,
                "half_field_of_view_rad": detector.half_field_of_view_rad,
            });
        }
        None => {}
    }
    body
}

pub(crate) fn pose(pose: &v1::Pose) -> Value {
    json!({"x_m": pose.x_m, "y_m": pose.y_m, "theta_rad": pose.theta_rad})
}

pub(crate) fn batch(batch: &v1::Batch) -> Value {
    let v1::Batch { number, observations } = batch;
    let observations: Vec<_> = observations.iter().map(observation).collect();
    json!({"number": number, "observations": observations})
}

fn observation(observation: &v1::Observation) -> Value {
    let v1::Observation { stamp_ns, monotonic_ns, sensor_id, kind } = observation;
    // Stamps in digits: JavaScript's numbers end at 2^53.
    let mut body = json!({"stamp_ns": stamp_ns.to_string(), "sensor_id": sensor_id});
    if let Some(ns) = monotonic_ns {
        body["monotonic_ns"] = json!(ns.to_string());
    }
    let (name, value) = match kind {
        None => return body,
        Some(Kind::OdometryPose(v1::OdometryPose { odometry_from_robot })) => {
            let at = odometry_from_robot.unwrap_or_default();
            ("odometry_pose", json!({"odometry_from_robot": pose(&at)}))
        }
        Some(Kind::OdometryVelocity(velocity)) => (
            "odometry_velocity",
            json!({
                "forward_m_per_s": velocity.forward_m_per_s,
                "left_m_per_s": velocity.left_m_per_s,
                "turn_rad_per_s": velocity.turn_rad_per_s,
            }),
        ),
        Some(Kind::LaserScan(scan)) => (
            "laser_scan",
            json!({"ranges_m": ranges(&scan.ranges_m), "intensities": scan.intensities}),
        ),
        Some(Kind::SonarScan(scan)) => ("sonar_scan", json!({"ranges_m": ranges(&scan.ranges_m)})),
        Some(Kind::LandmarkSighting(sighting)) => (
            "landmark_sighting",
            json!({
                "identity": sighting.identity,
                "landmark_type": sighting.landmark_type,
                "bearing_rad": sighting.bearing_rad,
                "range_m": sighting.range_m,
            }),
        ),
        Some(Kind::Mark(v1::Mark { label })) => ("mark", json!({"label": label})),
        Some(Kind::PlaceVisit(visit)) => (
            "place_visit",
            json!({
                "number": visit.number,
                "turn": visit.turn,
                "star": visit.star,
                "view": visit.view,
                "view_is_unique": visit.view_is_unique,
                "length_m": visit.length_m,
                "turned_rad": visit.turned_rad,
                "moved": visit.moved.as_ref().map(|moved| json!({
                    "x_m": moved.x_m, "y_m": moved.y_m, "theta_rad": moved.theta_rad,
                })),
            }),
        ),
    };
    body[name] = value;
    body
}

/// Numbers, null for NaN, words for the infinities.
fn ranges(ranges_m: &[f32]) -> Vec<Value> {
    let reading = |&range_m: &f32| match range_m {
        f32::INFINITY => json!("inf"),
        f32::NEG_INFINITY => json!("-inf"),
        range_m => json!(range_m),
    };
    ranges_m.iter().map(reading).collect()
}
