//! What is wrong with a batch as a whole, and with single observations.
//!
//! A batch is refused only where its sender has to change it; an observation that cannot be used is
//! rejected by name and the rest of the batch goes on.

use meetpoint_proto::v1;
use meetpoint_storage::RejectionRecord;
use prost::Message;
use v1::observation::Kind;

use super::stamps::Stamps;
use crate::convert::place_visit;
use crate::convert::{pose::COORDINATE_MAX_M, sensor::DeclaredSensor};
use crate::{error::Error, settings::Limits};

/// Metres or radians a second that no indoor robot reaches.
const SPEED_MAX: f64 = 50.0;
/// Characters of a mark, an identity or a landmark type.
const TEXT_LEN_MAX: usize = 200;

/// What the checks found in a batch that is taken.
#[derive(Debug)]
pub(crate) struct Checked {
    /// The batch as it is kept.
    pub(crate) payload: Vec<u8>,
    /// Observations that will not be used, in order.
    pub(crate) rejections: Vec<RejectionRecord>,
    /// Usable laser scans.
    pub(crate) n_scans: u32,
    /// Usable visits to places.
    pub(crate) n_visits: u32,
    /// Smallest and largest stamp of what is usable.
    pub(crate) stamps_ns: Option<(i64, i64)>,
}

/// A batch as bytes, if it is not too large.
///
/// # Errors
/// [`Error::InvalidField`] for number 0 or too many observations, [`Error::MessageTooLarge`].
fn encoded(batch: &v1::Batch, limits: &Limits) -> Result<Vec<u8>, Error> {
    if batch.number == 0 {
        return Err(Error::field("batch.number", "0; batches are numbered from 1"));
    }
    let n_observations = batch.observations.len();
    if n_observations > limits.observations_max as usize {
        return Err(Error::field(
            "batch.observations",
            format!("{n_observations} observations, at most {} are taken", limits.observations_max),
        ));
    }
    let payload = batch.encode_to_vec();
    if payload.len() > limits.batch_bytes_max as usize {
        return Err(Error::MessageTooLarge {
            n_bytes: payload.len(),
            limit_bytes: limits.batch_bytes_max as usize,
        });
    }
    Ok(payload)
}

/// Checks every observation of a batch.
///
/// # Errors
/// Those of [`encoded`].
pub(crate) fn check(
    batch: &v1::Batch,
    sensors: &[DeclaredSensor],
    stamps: &mut Stamps,
    limits: &Limits,
) -> Result<Checked, Error> {
    let payload = encoded(batch, limits)?;
    let mut checked =
        Checked { payload, rejections: Vec::new(), n_scans: 0, n_visits: 0, stamps_ns: None };
    for (index, observation) in (0_u32..).zip(&batch.observations) {
        let place = (batch.number, index);
        match check_observation(place, observation, sensors, stamps, limits) {
            Ok(()) => note(&mut checked, observation),
            Err((code, detail)) => {
                let code = code.to_owned();
                checked.rejections.push(RejectionRecord { index, code, detail });
            }
        }
    }
    for observation in &batch.observations {
        if stamp_fits(batch.number, observation.stamp_ns, stamps, limits).is_ok() {
            stamps.advance(batch.number, observation.stamp_ns);
        }
    }
    Ok(checked)
}

fn note(checked: &mut Checked, observation: &v1::Observation) {
    let stamp_ns = observation.stamp_ns;
    checked.n_scans += u32::from(matches!(observation.kind, Some(Kind::LaserScan(_))));
    checked.n_visits += u32::from(matches!(observation.kind, Some(Kind::PlaceVisit(_))));
    checked.stamps_ns = Some(match checked.stamps_ns {
        None => (stamp_ns, stamp_ns),
        Some((first, last)) => (first.min(stamp_ns), last.max(stamp_ns)),
    });
}

type Rejected = (&'static str, String);

/// `place` is the batch's number and the index of the observation in it.
fn check_observation(
    (batch, index): (u64, u32),
    observation: &v1::Observation,
    sensors: &[DeclaredSensor],
    stamps: &mut Stamps,
    limits: &Limits,
) -> Result<(), Rejected> {
    let v1::Observation { stamp_ns, monotonic_ns: _, sensor_id, kind } = observation;
    let Some(kind) = kind else {
        return Err(("EMPTY_OBSERVATION", "it holds nothing, or a kind unknown here".into()));
    };
    stamp_fits(batch, *stamp_ns, stamps, limits)?;
    let sensor = match kind {
        Kind::OdometryPose(odometry) => return check_odometry_pose(odometry),
        Kind::OdometryVelocity(odometry) => return check_velocity(odometry),
        Kind::Mark(v1::Mark { label }) => return check_text("label", label),
        Kind::PlaceVisit(visit) => return place_visit::visit(visit).map(|_| ()),
        Kind::LaserScan(_) | Kind::SonarScan(_) | Kind::LandmarkSighting(_) => {
            declared(sensor_id, sensors)?
        }
    };
    check_reading(kind, &sensors[sensor])?;
    if stamps.take(sensor, *stamp_ns, batch, index) {
        Ok(())
    } else {
        Err(("DUPLICATE_STAMP", format!("stamp {stamp_ns} ns was used by `{sensor_id}` before")))
    }
}

fn stamp_fits(batch: u64, stamp_ns: i64, stamps: &Stamps, limits: &Limits) -> Result<(), Rejected> {
    let Some(newest_ns) = stamps.newest_before(batch) else {
        return if stamp_ns < 0 {
            Err(("STAMP_OUT_OF_RANGE", format!("stamp {stamp_ns} ns is negative")))
        } else {
            Ok(())
        };
    };
    let ahead_s = (i128::from(stamp_ns) - i128::from(newest_ns)) as f64 * 1e-9;
    if -limits.stamp_back_max_s <= ahead_s && ahead_s <= limits.stamp_ahead_max_s {
        return Ok(());
    }
    Err((
        "STAMP_OUT_OF_RANGE",
        format!(
            "{ahead_s:.3} s from the session's newest stamp, must be -{} to {} s",
            limits.stamp_back_max_s, limits.stamp_ahead_max_s
        ),
    ))
}

fn declared(sensor_id: &str, sensors: &[DeclaredSensor]) -> Result<usize, Rejected> {
    sensors.iter().position(|sensor| sensor.id == sensor_id).ok_or_else(|| {
        let shown: String = sensor_id.chars().take(TEXT_LEN_MAX).collect();
        ("UNKNOWN_SENSOR", format!("the session declared no sensor `{shown}`"))
    })
}

fn check_odometry_pose(odometry: &v1::OdometryPose) -> Result<(), Rejected> {
    let Some(v1::Pose { x_m, y_m, theta_rad }) = odometry.odometry_from_robot else {
        return Err(("EMPTY_OBSERVATION", "odometry_from_robot is missing".into()));
    };
    finite(&[x_m, y_m, theta_rad])?;
    let farthest_m = x_m.abs().max(y_m.abs());
    if farthest_m > COORDINATE_MAX_M {
        return Err(("OUT_OF_RANGE", format!("{farthest_m} m, at most {COORDINATE_MAX_M} m")));
    }
    Ok(())
}

fn check_velocity(odometry: &v1::OdometryVelocity) -> Result<(), Rejected> {
    let v1::OdometryVelocity { forward_m_per_s, left_m_per_s, turn_rad_per_s } = *odometry;
    let speeds = [forward_m_per_s, left_m_per_s, turn_rad_per_s];
    finite(&speeds)?;
    match speeds.into_iter().find(|speed| speed.abs() > SPEED_MAX) {
        Some(speed) => Err(("OUT_OF_RANGE", format!("{speed} a second, at most {SPEED_MAX}"))),
        None => Ok(()),
    }
}

fn check_reading(kind: &Kind, sensor: &DeclaredSensor) -> Result<(), Rejected> {
    use meetpoint_tracking::SensorKind;
    match (kind, &sensor.sensor.kind) {
        (Kind::LaserScan(scan), SensorKind::Laser(_)) => {
            let n_intensities = scan.intensities.len();
            if n_intensities != 0 && n_intensities != sensor.n_readings {
                return Err(wrong_count(n_intensities, sensor.n_readings));
            }
            check_ranges(&scan.ranges_m, sensor)
        }
        (Kind::SonarScan(scan), SensorKind::SonarRing(_)) => check_ranges(&scan.ranges_m, sensor),
        (Kind::LandmarkSighting(sighting), SensorKind::LandmarkDetector) => {
            check_sighting(sighting, sensor)
        }
        _ => Err(("WRONG_SENSOR_KIND", format!("`{}` is a sensor of another kind", sensor.id))),
    }
}

fn wrong_count(n: usize, n_declared: usize) -> Rejected {
    ("WRONG_BEAM_COUNT", format!("{n} readings, {n_declared} are declared"))
}

fn check_ranges(ranges_m: &[f32], sensor: &DeclaredSensor) -> Result<(), Rejected> {
    if ranges_m.len() != sensor.n_readings {
        return Err(wrong_count(ranges_m.len(), sensor.n_readings));
    }
    let usable = |range_m: f32| range_m > 0.0 && f64::from(range_m) >= sensor.range_min_m;
    if ranges_m.iter().any(|&range_m| usable(range_m)) {
        return Ok(());
    }
    Err(("NO_USABLE_READING", "every reading is NaN, negative, 0 or below the minimum".into()))
}

fn check_sighting(
    sighting: &v1::LandmarkSighting,
    sensor: &DeclaredSensor,
) -> Result<(), Rejected> {
    let v1::LandmarkSighting { identity, landmark_type, bearing_rad, range_m } = sighting;
    check_text("landmark_type", landmark_type)?;
    if let Some(identity) = identity {
        check_text("identity", identity)?;
    }
    finite(&[bearing_rad.unwrap_or(0.0), range_m.unwrap_or(0.0)])?;
    let range_m = range_m.unwrap_or(0.0);
    if !(0.0..=sensor.range_max_m).contains(&range_m) {
        let limit_m = sensor.range_max_m;
        return Err(("OUT_OF_RANGE", format!("range {range_m} m, must be 0 to {limit_m} m")));
    }
    Ok(())
}

fn check_text(field: &str, text: &str) -> Result<(), Rejected> {
    let n_chars = text.chars().count();
    if n_chars > TEXT_LEN_MAX {
        return Err(("TOO_LONG", format!("{field}: {n_chars} characters, at most {TEXT_LEN_MAX}")));
    }
    Ok(())
}

fn finite(values: &[f64]) -> Result<(), Rejected> {
    match values.iter().find(|value| !value.is_finite()) {
        Some(value) => Err(("NOT_FINITE", format!("{value} is not a number to measure with"))),
        None => Ok(()),
    }
}
