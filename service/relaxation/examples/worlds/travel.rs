//! Simulated travels as the relaxation takes them.

use meetpoint_geometry::Pose;
use meetpoint_relaxation::{Detector, Motion, Sighting, Step, Travel};
use meetpoint_sim::LandmarkTravel;

/// A step after so many metres without a sighting (TBF98 section 5).
const STEP_M: f64 = 20.0;

/// What the robot knows of a simulated travel, and the true landmark of every sighting.
pub(crate) fn travel(simulated: &LandmarkTravel) -> (Travel, Vec<usize>) {
    let mut steps = Vec::new();
    let mut truth = Vec::new();
    let mut legs: Vec<Pose> = Vec::new();
    let mut before: Option<Pose> = None;
    let mut driven_m = 0.0;
    for moment in &simulated.moments {
        if let Some(before) = before {
            let leg = before.step_to(moment.odometry);
            driven_m += leg.distance_m();
            legs.push(leg);
        }
        before = Some(moment.odometry);
        if steps.is_empty() || !moment.sightings.is_empty() || STEP_M < driven_m {
            let sightings = moment.sightings.iter().map(|seen| Sighting {
                identity: None,
                landmark_type: seen.landmark_type,
                range_m: seen.range_m,
                bearing_rad: seen.bearing_rad,
            });
            truth.extend(moment.sightings.iter().map(|seen| seen.landmark));
            let motion = Motion::new(std::mem::take(&mut legs));
            steps.push(Step { motion, sightings: sightings.collect() });
            driven_m = 0.0;
        }
    }
    let detector = Detector { range_max_m: 0.0, half_field_of_view_rad: std::f64::consts::PI };
    (Travel { detector, steps }, truth)
}
