//! Poses on the wire, in records and in the domain.

use meetpoint_geometry::Pose;
use meetpoint_proto::v1;

use crate::error::Error;

/// Metres from the origin beyond which a pose is absurd for a building.
pub(crate) const COORDINATE_MAX_M: f64 = 1.0e5;

/// A finite pose within [`COORDINATE_MAX_M`].
pub(crate) fn pose(field: &str, wire: v1::Pose) -> Result<Pose, Error> {
    let v1::Pose { x_m, y_m, theta_rad } = wire;
    if !(x_m.is_finite() && y_m.is_finite() && theta_rad.is_finite()) {
        return Err(Error::field(field, "not finite"));
    }
    let farthest_m = x_m.abs().max(y_m.abs());
    if farthest_m > COORDINATE_MAX_M {
        return Err(Error::field(
            field,
            format!("{farthest_m} m from the origin, at most {COORDINATE_MAX_M} are taken"),
        ));
    }
    Ok(Pose::new(x_m, y_m, theta_rad))
}

/// A pose for the wire.
pub(crate) fn to_wire(pose: Pose) -> v1::Pose {
    let Pose { x_m, y_m, theta_rad } = pose;
    v1::Pose { x_m, y_m, theta_rad }
}

/// A pose for a record.
pub(crate) fn to_record(pose: Pose) -> [f64; 3] {
    [pose.x_m, pose.y_m, pose.theta_rad]
}

/// A pose from a record, bit for bit.
pub(crate) fn from_record([x_m, y_m, theta_rad]: [f64; 3]) -> Pose {
    Pose { x_m, y_m, theta_rad }
}
