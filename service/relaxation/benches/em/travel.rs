//! A simulated travel as relaxation takes it, cut into steps of a length.

use std::f64::consts::PI;

use meetpoint_geometry::Pose;
use meetpoint_relaxation::{Detector, Motion, Sighting, Step, Travel};
use meetpoint_sim::{LandmarkTravel, Stage};

/// A step for every sighting and after `step_m` metres without one, and the true poses of steps
/// seen from the first.
pub(crate) fn cut(simulated: &LandmarkTravel, step_m: f64) -> (Travel, Vec<Pose>) {
    let start = simulated.moments[0].truth;
    let (mut steps, mut truth) = (Vec::new(), Vec::new());
    for Stage { legs, end } in simulated.stages(step_m) {
        let sightings = end.sightings.iter().map(|seen| Sighting {
            identity: None,
            landmark_type: seen.landmark_type,
            range_m: seen.range_m,
            bearing_rad: seen.bearing_rad,
        });
        steps.push(Step { motion: Motion::new(legs), sightings: sightings.collect() });
        truth.push(start.step_to(end.truth));
    }
    let detector = Detector { range_max_m: 0.0, half_field_of_view_rad: PI };
    (Travel { detector, steps }, truth)
}

/// Distances of two paths after the best rigid motion of the first: median and largest, in metres.
pub(crate) fn off_m(path: &[Pose], truth: &[Pose]) -> (f64, f64) {
    let n = path.len() as f64;
    let mean = |poses: &[Pose]| {
        let sum = poses.iter().fold((0.0, 0.0), |sum, pose| (sum.0 + pose.x_m, sum.1 + pose.y_m));
        Pose::new(sum.0 / n, sum.1 / n, 0.0)
    };
    let (from, to) = (mean(path).inverse(), mean(truth));
    let (mut cos, mut sin) = (0.0, 0.0);
    for (&pose, &truth) in path.iter().zip(truth) {
        let (a, b) = (from * pose.position(), to.inverse() * truth.position());
        cos += a.x * b.x + a.y * b.y;
        sin += a.x * b.y - a.y * b.x;
    }
    let truth_from_path = to * Pose::new(0.0, 0.0, sin.atan2(cos)) * from;
    let pairs = path.iter().zip(truth);
    let mut off_m: Vec<f64> = pairs
        .map(|(&pose, truth)| (truth_from_path * pose.position() - truth.position()).norm())
        .collect();
    off_m.sort_by(f64::total_cmp);
    (off_m[off_m.len() / 2], off_m[off_m.len() - 1])
}
