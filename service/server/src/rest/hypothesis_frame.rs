//! Where the places of a map lie by odometry, in JSON.

use meetpoint_proto::v1;
use serde::Serialize;
use utoipa::ToSchema;

use super::geometry::Point;

/// The places of a map in one frame, which agrees best with odometry.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct HypothesisFrame {
    /// One a place, in metres: the first at the origin, x where the robot looked there first.
    places: Vec<Point>,
    /// Sum of squares of what is left of the misfit, in standard deviations of odometry.
    chi2: f64,
    /// Measurements beyond unknowns.
    degrees: u32,
    /// The most that a map may have which fits: one true map in a thousand has more.
    chi2_max: f64,
    /// Whether odometry speaks against the map: more than that. Never while it was not settled.
    contradicted: bool,
    /// Whether steps had become too small to change what is said when it was stopped.
    settled: bool,
}

impl From<v1::HypothesisFrame> for HypothesisFrame {
    fn from(wire: v1::HypothesisFrame) -> Self {
        let v1::HypothesisFrame { places, chi2, degrees, chi2_max, contradicted, settled } = wire;
        let places = places.into_iter().map(Point::from).collect();
        Self { places, chi2, degrees, chi2_max, contradicted, settled }
    }
}
