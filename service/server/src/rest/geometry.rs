//! Points, poses and boxes in JSON.

use meetpoint_proto::v1;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::error::Error;

/// A position, in the frame that the field holding it names.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({"x_m": 1.25, "y_m": -0.5}))]
pub(crate) struct Point {
    /// Metres.
    x_m: f64,
    /// Metres.
    y_m: f64,
}

impl From<v1::Point> for Point {
    fn from(wire: v1::Point) -> Self {
        let v1::Point { x_m, y_m } = wire;
        Self { x_m, y_m }
    }
}

impl From<Point> for v1::Point {
    fn from(point: Point) -> Self {
        let Point { x_m, y_m } = point;
        Self { x_m, y_m }
    }
}

/// A position and heading: metres and radians, x forward, y left, counter-clockwise (REP 103).
/// Also a transform: `map_from_robot` is the robot's pose in the map's frame.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({"x_m": 1.25, "y_m": -0.5, "theta_rad": 0.5}))]
pub(crate) struct Pose {
    /// Metres.
    x_m: f64,
    /// Metres.
    y_m: f64,
    /// In (-pi, pi] in replies; any number of turns is taken in requests.
    theta_rad: f64,
}

impl From<v1::Pose> for Pose {
    fn from(wire: v1::Pose) -> Self {
        let v1::Pose { x_m, y_m, theta_rad } = wire;
        Self { x_m, y_m, theta_rad }
    }
}

impl From<Pose> for v1::Pose {
    fn from(pose: Pose) -> Self {
        let Pose { x_m, y_m, theta_rad } = pose;
        Self { x_m, y_m, theta_rad }
    }
}

/// An axis-aligned rectangle in the map's frame.
#[derive(Clone, Copy, Debug, Serialize, ToSchema)]
pub(crate) struct BoundingBox {
    /// Metres.
    min_x_m: f64,
    /// Metres.
    min_y_m: f64,
    /// Metres.
    max_x_m: f64,
    /// Metres.
    max_y_m: f64,
}

impl From<v1::BoundingBox> for BoundingBox {
    fn from(wire: v1::BoundingBox) -> Self {
        let v1::BoundingBox { min_x_m, min_y_m, max_x_m, max_y_m } = wire;
        Self { min_x_m, min_y_m, max_x_m, max_y_m }
    }
}

/// Reads `min_x,min_y,max_x,max_y` in metres. Order and limits are checked by the operation.
///
/// # Errors
/// [`Error::InvalidField`] unless there are four numbers.
pub(super) fn bbox(text: &str) -> Result<v1::BoundingBox, Error> {
    let numbers: Option<Vec<f64>> =
        text.split(',').map(|number| number.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[min_x_m, min_y_m, max_x_m, max_y_m]) => {
            Ok(v1::BoundingBox { min_x_m, min_y_m, max_x_m, max_y_m })
        }
        _ => {
            let shown: String = text.chars().take(80).collect();
            Err(Error::field(
                "bbox",
                format!("`{shown}` is not min_x,min_y,max_x,max_y: four numbers in metres"),
            ))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_numbers_make_a_box() {
        let read = bbox("-1.5, 2,3e0,4").expect("four numbers");
        assert_eq!(
            read,
            v1::BoundingBox { min_x_m: -1.5, min_y_m: 2.0, max_x_m: 3.0, max_y_m: 4.0 },
            "in this order"
        );
        for bad in ["", "1,2,3", "1,2,3,4,5", "a,b,c,d", "1;2;3;4"] {
            assert!(bbox(bad).is_err(), "`{bad}` is no box");
        }
    }
}
