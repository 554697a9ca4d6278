//! A map of landmarks by itself, as it is laid over another one: places, how wrong these are among
//! each other, and where a landmark would have been noticed.

use meetpoint_geometry::{Point2, Pose};
use nalgebra::{Matrix2, Rotation2};

use crate::coverage::Coverage;
use crate::landmark::LandmarkKind;
use crate::outcome::Outcome;
use crate::travel::Travel;

/// Chance that a landmark that was seen once is one.
const EXISTS_SEEN_ONCE: f64 = 0.9;
/// Chance that one is that was seen again.
const EXISTS_SEEN_AGAIN: f64 = 0.98;

/// A landmark of a constellation.
#[derive(Clone, Debug, PartialEq)]
pub struct Star {
    /// In the map's frame, in metres.
    pub position: Point2<f64>,
    /// How wrong that may be among the other landmarks, in square metres.
    pub covariance_m2: Matrix2<f64>,
    /// What it is. Numbers of types and identities must mean the same in both maps.
    pub kind: LandmarkKind,
    /// Chance that there is one at all, in (0, 1].
    pub exists: f64,
}

/// A map of landmarks.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Constellation {
    /// Its landmarks.
    pub stars: Vec<Star>,
    /// Where others would have been noticed.
    pub coverage: Coverage,
}

impl Constellation {
    /// What one relaxed travel says, in the frame of its first pose.
    pub fn of(travel: &Travel, outcome: &Outcome) -> Self {
        let star = |landmark: &crate::outcome::MappedLandmark| Star {
            position: landmark.position,
            covariance_m2: landmark.shape_covariance_m2,
            kind: landmark.kind,
            exists: exists(landmark.sightings.len()),
        };
        Self {
            stars: outcome.landmarks.iter().map(star).collect(),
            coverage: Coverage::of(travel, &outcome.poses, &outcome.calibration),
        }
    }

    /// The same as seen from another frame.
    pub fn moved(&self, outer_from_inner: Pose) -> Self {
        let turn = Rotation2::new(outer_from_inner.theta_rad).into_inner();
        let star = |star: &Star| Star {
            position: outer_from_inner * star.position,
            covariance_m2: turn * star.covariance_m2 * turn.transpose(),
            ..star.clone()
        };
        let mut coverage = Coverage::default();
        coverage.join(&self.coverage, outer_from_inner);
        Self { stars: self.stars.iter().map(star).collect(), coverage }
    }
}

/// Chance that a landmark exists that was seen so often.
pub(crate) fn exists(n_sightings: usize) -> f64 {
    if n_sightings < 2 { EXISTS_SEEN_ONCE } else { EXISTS_SEEN_AGAIN }
}
