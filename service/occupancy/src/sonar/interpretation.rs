//! What one firing of a ring says of the cells around the robot (T98 2.1, Fig. 3).
//!
//! The network is asked for places on rays from the robot, finer than it can tell; what it says holds for
//! all that lies nearer to that place than to the next. Time O(bearings * distances * weights).

use std::f64::consts::TAU;

use meetpoint_geometry::Point2;

use super::inverse_cone::InverseCone;
use super::network::Network;
use super::ring::{SonarRing, SonarScan};

/// How sonar is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SonarModel {
    /// Cells nearer than this are not drawn, in metres: the robot stands there.
    pub distance_min_m: f64,
    /// Cells farther than this are not drawn, in metres: cones are wider than doors there.
    pub distance_max_m: f64,
    /// Evidence weaker than this, as log-odds, is none: firings from nearly the same place repeat one another's
    /// small errors, which would add up behind walls. What is left is sure to four in five: with less, walls
    /// blur and correlation pulls robots off; with more, free space stays unseen.
    pub evidence_min: f32,
    /// No firing adds or takes more than this.
    pub evidence_max: f32,
}

impl SonarModel {
    /// For rings of 16 or 24 in buildings: as far as a cone is a metre wide.
    pub const INDOOR: Self =
        Self { distance_min_m: 0.3, distance_max_m: 3.5, evidence_min: 1.5, evidence_max: 2.0 };

    /// For weights that were trained on ways, whose weak answers count.
    pub const BY_WAYS: Self = Self { evidence_min: 0.3, evidence_max: 3.0, ..Self::INDOOR };

    /// What of the evidence of one firing reaches the map.
    pub fn heeded(&self, evidence: f32) -> f32 {
        let is_said = self.evidence_min <= evidence.abs();
        if is_said { bounded(evidence, self.evidence_max) } else { 0.0 }
    }
}

/// Evidence by bearing and distance from the robot.
#[derive(Clone, Debug, PartialEq)]
pub struct Interpretation {
    model: SonarModel,
    /// Bearing by bearing from 0 on, distance by distance.
    evidence: Vec<f32>,
    n_distances: usize,
}

/// Rays all around: every 2.5 degrees, a sixth of what 24 transducers are apart.
const N_BEARINGS: usize = 144;
/// Places on a ray are so far apart, in metres: half of what right readings spread over.
const STEP_M: f64 = 0.05;

impl Interpretation {
    /// What a network says of a scan.
    pub fn new(scan: &SonarScan, network: &Network, model: &SonarModel) -> Self {
        let low_m = model.distance_min_m;
        Self::of_rays(model, |(sin, cos)| {
            let mut view = scan.view(Point2::new(low_m * cos, low_m * sin))?;
            #[expect(clippy::cast_possible_truncation, reason = "some metres")]
            let said = move |distance_m: f64| {
                view.distance_m = distance_m as f32;
                network.evidence(&view)
            };
            Some(said)
        })
    }

    /// What the inverse cone model says of a scan: the baseline.
    pub fn by_cones(
        (ring, scan): (&SonarRing, &SonarScan),
        cone: &InverseCone,
        model: &SonarModel,
    ) -> Self {
        Self::of_rays(model, |(sin, cos)| {
            let at = move |distance_m: f64| Point2::new(distance_m * cos, distance_m * sin);
            Some(move |distance_m: f64| cone.evidence(ring, scan, at(distance_m)))
        })
    }

    /// `ray` gives for sine and cosine of a bearing what is said by distance, in metres; `None` where
    /// nothing is.
    fn of_rays<R: FnMut(f64) -> f32>(
        model: &SonarModel,
        ray: impl Fn((f64, f64)) -> Option<R>,
    ) -> Self {
        let (low_m, high_m) = (model.distance_min_m, model.distance_max_m);
        let n_distances = steps((high_m - low_m).min(LENGTH_MAX_M));
        let mut evidence = vec![0.0; N_BEARINGS * n_distances];
        for (bearing, along) in evidence.chunks_exact_mut(n_distances.max(1)).enumerate() {
            let bearing_rad = TAU * bearing as f64 / N_BEARINGS as f64;
            let Some(mut ray) = ray(bearing_rad.sin_cos()) else { continue };
            for (step, evidence) in along.iter_mut().enumerate() {
                let said = ray(low_m + (step as f64 + 0.5) * STEP_M);
                *evidence = model.heeded(said);
            }
        }
        Self { model: *model, evidence, n_distances }
    }

    /// What is added to the log-odds of a place of the robot's frame; 0 if nothing is said of it.
    pub fn evidence(&self, place: Point2<f64>) -> f32 {
        let distance_m = place.coords.norm();
        let step = steps((distance_m - self.model.distance_min_m).min(LENGTH_MAX_M));
        if distance_m < self.model.distance_min_m || self.n_distances <= step {
            return 0.0;
        }
        let turn = place.y.atan2(place.x).rem_euclid(TAU) / TAU;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "not negative, and at most the number of bearings"
        )]
        let bearing = (turn * N_BEARINGS as f64).round() as usize % N_BEARINGS;
        self.evidence[bearing * self.n_distances + step]
    }

    /// Nothing is said beyond this distance, in metres.
    pub fn reach_m(&self) -> f64 {
        self.model.distance_max_m.min(self.model.distance_min_m + LENGTH_MAX_M)
    }
}

/// Longer rays are cut off, in metres: no sonar is believed that far.
const LENGTH_MAX_M: f64 = 20.0;

/// Whole steps of a length; none of a negative one, or of no number.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "saturating, and bounded by the callers"
)]
fn steps(length_m: f64) -> usize {
    (length_m / STEP_M).max(0.0) as usize
}

fn bounded(evidence: f32, max: f32) -> f32 {
    evidence.max(-max).min(max)
}
