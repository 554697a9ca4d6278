//! Observations, from the journal to the tracker.

use meetpoint_proto::v1;
use meetpoint_tracking as tracking;
use tracking::ObservationKind;

use super::{pose, sensor::DeclaredSensor};

/// What the tracker makes of an observation that was not rejected.
///
/// `None` where it says nothing: rejected ones, which ingest has named to the robot.
pub(crate) fn observation(
    wire: v1::Observation,
    sensors: &[DeclaredSensor],
) -> Option<tracking::Observation> {
    let v1::Observation { stamp_ns, monotonic_ns: _, sensor_id, kind } = wire;
    let sensor = || sensors.iter().position(|declared| declared.id == sensor_id);
    let kind = match kind? {
        v1::observation::Kind::OdometryPose(v1::OdometryPose { odometry_from_robot }) => {
            ObservationKind::OdometryPose(pose::pose("", odometry_from_robot?).ok()?)
        }
        v1::observation::Kind::OdometryVelocity(v1::OdometryVelocity {
            forward_m_per_s,
            left_m_per_s,
            turn_rad_per_s,
        }) => ObservationKind::OdometryVelocity { forward_m_per_s, left_m_per_s, turn_rad_per_s },
        v1::observation::Kind::LaserScan(v1::LaserScan { ranges_m, intensities: _ }) => {
            ObservationKind::LaserScan { sensor: sensor()?, ranges_m }
        }
        v1::observation::Kind::SonarScan(v1::SonarScan { ranges_m }) => {
            ObservationKind::SonarScan { sensor: sensor()?, ranges_m }
        }
        v1::observation::Kind::LandmarkSighting(v1::LandmarkSighting {
            identity: _,
            landmark_type: _,
            bearing_rad: _,
            range_m: _,
        }) => ObservationKind::LandmarkSighting { sensor: sensor()? },
        // What a visit says is no business of tracking; where it was is, as of a mark.
        v1::observation::Kind::Mark(v1::Mark { label: _ })
        | v1::observation::Kind::PlaceVisit(_) => ObservationKind::Mark,
    };
    Some(tracking::Observation { stamp_ns, kind })
}
