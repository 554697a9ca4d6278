//! Beams of a laser, or sonars that stand otherwise, as a ring of so many cones evenly around.
//!
//! A cone's reading is the median of the beams that look along the middle of it, half of its width
//! wide: KB 1988 has what a sonar meets in its middle, and a single beam may meet a table's leg. Where no
//! beam looks along the middle, the one counts that is nearest to it and within the cone.

use std::f64::consts::TAU;

use meetpoint_geometry::{Pose, angle_between};

/// Cones that beams are folded into: NX has as many sonars.
pub const N_CONES: usize = 16;
/// Share of a cone's width within which beams are averaged.
const MIDDLE_SHARE: f64 = 0.5;
/// A sonar looks along the middle of a cone that is no more off it, in radians: a tenth of a degree.
const SAME_RAD: f64 = 0.002;

/// Which readings of a sensor make which cone of a ring.
#[derive(Clone, Debug, PartialEq)]
pub struct Cones {
    /// For each cone the readings that count, by index, with what a reading is shorter than the
    /// distance from the robot's middle, in metres. Invariant: none is empty.
    members: Vec<Vec<(usize, f64)>>,
    is_one_to_one: bool,
}

impl Cones {
    /// Of readings that are measured from these poses along their x axes. `None` if they do not look
    /// all around.
    pub fn new(robot_from_beams: &[Pose]) -> Option<Self> {
        let n = N_CONES;
        let width_rad = TAU / n as f64;
        let members = (0..n).map(|cone| {
            let middle_rad = width_rad * cone as f64;
            let off_rad = |beam: &Pose| angle_between(middle_rad, beam.theta_rad).abs();
            let offset_m = |beam: &Pose| {
                let (sin, cos) = beam.theta_rad.sin_cos();
                beam.x_m * cos + beam.y_m * sin
            };
            let beams = || robot_from_beams.iter().enumerate();
            let near_rad = 0.5 * MIDDLE_SHARE * width_rad + 1e-9;
            let middle: Vec<(usize, f64)> = beams()
                .filter(|(_, beam)| off_rad(beam) <= near_rad)
                .map(|(index, beam)| (index, offset_m(beam)))
                .collect();
            if !middle.is_empty() {
                return Some(middle);
            }
            let nearest = beams().min_by(|a, b| off_rad(a.1).total_cmp(&off_rad(b.1)))?;
            let is_within = off_rad(nearest.1) <= 0.5 * width_rad + 1e-9;
            is_within.then(|| vec![(nearest.0, offset_m(nearest.1))])
        });
        let members: Vec<Vec<(usize, f64)>> = members.collect::<Option<_>>()?;
        let is_one_to_one = robot_from_beams.len() == n
            && members.iter().enumerate().all(|(cone, beams)| {
                beams.len() == 1
                    && off_cone_rad(&robot_from_beams[beams[0].0], cone, width_rad) <= SAME_RAD
            });
        Some(Self { members, is_one_to_one })
    }

    /// Whether every reading is a cone's, and looks along its middle: nothing was folded.
    pub fn is_one_to_one(&self) -> bool {
        self.is_one_to_one
    }

    /// The ring, in metres: ahead first, then counter-clockwise; `+inf` where nothing came back. Readings
    /// follow REP 117 and the limits of their sensor: NaN, those of 0 and below `range_min_m` say nothing, those from
    /// `range_max_m` on that nothing was there.
    pub fn ring(&self, ranges_m: &[f32], range_min_m: f64, range_max_m: f64) -> Vec<f64> {
        let distance_m = |&(index, offset_m): &(usize, f64)| {
            let range_m = f64::from(*ranges_m.get(index)?);
            if range_m.is_nan() || range_m <= 0.0 || range_m < range_min_m {
                return None;
            }
            let is_far = range_max_m <= range_m;
            Some(if is_far { f64::INFINITY } else { (range_m + offset_m).max(0.0) })
        };
        let cone = |members: &Vec<(usize, f64)>| {
            let mut distances_m: Vec<f64> = members.iter().filter_map(distance_m).collect();
            distances_m.sort_by(f64::total_cmp);
            distances_m.get(distances_m.len() / 2).copied().unwrap_or(f64::INFINITY)
        };
        self.members.iter().map(cone).collect()
    }
}

fn off_cone_rad(beam: &Pose, cone: usize, width_rad: f64) -> f64 {
    angle_between(width_rad * cone as f64, beam.theta_rad).abs()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    fn beams(n: usize, from_rad: f64, step_rad: f64) -> Vec<Pose> {
        (0..n).map(|index| Pose::new(0.0, 0.0, from_rad + step_rad * index as f64)).collect()
    }

    #[test]
    fn a_ring_of_sixteen_is_taken_as_it_is() {
        let cones = Cones::new(&beams(16, 0.0, TAU / 16.0)).expect("all around");
        assert!(cones.is_one_to_one(), "nothing to be folded");
        let ranges_m: Vec<f32> = (1..=16_u8).map(f32::from).collect();
        let ring = cones.ring(&ranges_m, 0.1, 12.0);
        assert_eq!(
            ring[..12],
            [1., 2., 3., 4., 5., 6., 7., 8., 9., 10., 11., f64::INFINITY],
            "far"
        );
    }

    #[test]
    fn beams_are_folded() {
        let cones = Cones::new(&beams(360, -PI, TAU / 360.0)).expect("all around");
        assert!(!cones.is_one_to_one(), "many beams a cone");
        let mut ranges_m = vec![3.0_f32; 360];
        // A leg of a table, in one beam ahead, and an error in another.
        (ranges_m[180], ranges_m[181]) = (0.5, f32::NAN);
        let ring = cones.ring(&ranges_m, 0.1, 10.0);
        assert_eq!(ring, vec![3.0; N_CONES], "the median of what is ahead");
    }

    #[test]
    fn distances_are_from_the_middle_of_the_robot() {
        let on_rim = |beam: Pose| beam * Pose::new(0.2, 0.0, 0.0);
        let rim: Vec<Pose> = beams(16, 0.0, TAU / 16.0).into_iter().map(on_rim).collect();
        let ring = Cones::new(&rim).expect("all around").ring(&[1.0; 16], 0.0, 6.0);
        assert!(ring.iter().all(|range_m| (range_m - 1.2).abs() < 1e-6), "{ring:?}");
    }

    #[test]
    fn a_laser_that_looks_ahead_is_no_ring() {
        assert_eq!(Cones::new(&beams(181, -FRAC_PI_2, PI / 180.0)), None, "blind behind");
        assert_eq!(Cones::new(&[]), None, "blind");
    }
}
