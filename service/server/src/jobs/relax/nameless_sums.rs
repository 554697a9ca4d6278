//! Where the poses of a version put the landmarks that have no names, type by type, and where its robots
//! looked for some.

use std::collections::BTreeMap;

use meetpoint_geometry::{Point2, Pose};
use meetpoint_merging::{Look, NamelessLandmark};

use super::named_sums::NamedSums;

/// Sightings of a type as near as this to the mean of others are of the same landmark, in metres: three
/// times what detectors and live poses are off. Two that stand nearer are told as one.
const APART_MIN_M: f64 = 1.0;
/// Sightings without which there is no landmark: one may be of a person.
const N_SIGHTINGS_MIN: f64 = 2.0;
/// Landmarks of all types of a map, at most: hours of a camera in halls.
const N_LANDMARKS_MAX: usize = 2000;
/// A robot looks again once it has gone so far, in metres...
const LOOK_WAY_M: f64 = 0.5;
/// ...or has turned by so much, in radians.
const LOOK_TURN_RAD: f64 = 0.35;
/// A detector that sees no farther is a person with a button, in metres: that none was pressed says nothing.
const BUTTON_RANGE_MAX_M: f64 = 1.0;

/// Sums over the places of sightings that are of one landmark, and the moments at which some were looked for.
#[derive(Debug, Default)]
pub(in crate::jobs) struct NamelessSums {
    by_type: BTreeMap<u32, Vec<NamedSums>>,
    n: usize,
    looks: Vec<Look>,
}

impl NamelessSums {
    /// Adds a sighting: to the landmark of its type that is near, or as another one.
    pub(super) fn add(&mut self, landmark_type: u32, at: Point2<f64>) {
        let of_type = self.by_type.entry(landmark_type).or_default();
        let distance_m = |sums: &NamedSums| (sums.mean().0 - at).norm();
        let nearest = of_type
            .iter_mut()
            .min_by(|a, b| distance_m(a).total_cmp(&distance_m(b)))
            .filter(|sums| distance_m(sums) < APART_MIN_M);
        if let Some(sums) = nearest {
            sums.add(at);
        } else if self.n < N_LANDMARKS_MAX {
            let mut sums = NamedSums::default();
            sums.add(at);
            of_type.push(sums);
            self.n += 1;
        }
    }

    /// Takes in where the robot is now; `begins` a session's way.
    pub(super) fn look(&mut self, at: Pose, range_max_m: f64, half_rad: f64, begins: bool) {
        let before = self.looks.last().filter(|_| !begins).map(|look| look.at.step_to(at));
        let has_moved = before.is_none_or(|step| {
            LOOK_WAY_M <= step.distance_m() || LOOK_TURN_RAD <= step.theta_rad.abs()
        });
        if has_moved && BUTTON_RANGE_MAX_M < range_max_m {
            self.looks.push(Look { at, range_max_m, half_field_of_view_rad: half_rad });
        }
    }

    /// The landmarks, each coordinate's variance by how far its sightings lie from their mean and by what a
    /// detector is off, in square metres; and the looks.
    pub(in crate::jobs) fn told(self, sighting_m2: f64) -> (Vec<NamelessLandmark>, Vec<Look>) {
        let all = self.by_type.into_iter().flat_map(|(landmark_type, all)| {
            all.into_iter().map(move |sums| (landmark_type, sums))
        });
        let landmarks = all.filter(|(_, sums)| N_SIGHTINGS_MIN <= sums.n()).map(|it| {
            let (landmark_type, (at, variance_m2)) = (it.0, it.1.mean());
            NamelessLandmark { landmark_type, at, variance_m2: variance_m2 + sighting_m2 }
        });
        (landmarks.collect(), self.looks)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sightings_near_each_other_are_of_one_landmark() {
        let mut sums = NamelessSums::default();
        for (landmark_type, x_m) in [(0, 1.0), (0, 1.4), (0, 3.0), (1, 1.1), (0, 3.2), (0, 9.0)] {
            sums.add(landmark_type, Point2::new(x_m, 0.0));
        }
        for x_m in [0.0, 0.1, 0.7, 0.8] {
            sums.look(Pose::new(x_m, 0.0, 0.0), 5.0, 1.0, x_m == 0.0);
        }
        sums.look(Pose::new(0.8, 0.0, 0.5), 0.5, 1.0, false);
        let (landmarks, looks) = sums.told(0.04);
        let told: Vec<(u32, f64)> =
            landmarks.iter().map(|it| (it.landmark_type, it.at.x)).collect();
        assert_eq!(told, [(0, 1.2), (0, 3.1)], "what was seen once is none");
        assert!((landmarks[0].variance_m2 - 0.06).abs() < 1e-9, "{landmarks:?}");
        let looked: Vec<f64> = looks.iter().map(|look| look.at.x_m).collect();
        assert_eq!(looked, [0.0, 0.7], "again after a way, and never by a button");
    }
}
