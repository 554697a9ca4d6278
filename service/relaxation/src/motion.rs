//! What odometry tells of the way from one step to the next.

use meetpoint_geometry::Pose;

use crate::calibration::Calibration;

/// The way from one step to the next as odometry measured it, cut into legs, so that its end can be
/// computed again once the odometry's steady errors are known.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Each seen from the end of the one before.
    legs: Vec<Pose>,
    distance_m: f64,
    turned_rad: f64,
}

impl Motion {
    /// No motion at all.
    pub const NONE: Self = Self { legs: Vec::new(), distance_m: 0.0, turned_rad: 0.0 };

    /// The way along `legs`, each seen from the end of the one before. Turns within a leg that
    /// cancel are not seen: legs of half a metre are short enough indoors.
    pub fn new(legs: Vec<Pose>) -> Self {
        let distance_m = legs.iter().map(|leg| leg.distance_m()).sum();
        let turned_rad = legs.iter().map(|leg| leg.theta_rad.abs()).sum();
        Self { legs, distance_m, turned_rad }
    }

    /// The parts of the way.
    pub fn legs(&self) -> &[Pose] {
        &self.legs
    }

    /// Length of the way as measured, in metres.
    pub fn distance_m(&self) -> f64 {
        self.distance_m
    }

    /// Sum of all turns to either side as measured, in radians.
    pub fn turned_rad(&self) -> f64 {
        self.turned_rad
    }

    /// The pose at the end of the way seen from its beginning.
    pub fn displacement(&self, calibration: &Calibration) -> Pose {
        let mut end = Pose::IDENTITY;
        for &leg in &self.legs {
            end = end * calibration.corrected(leg);
        }
        end
    }
}
