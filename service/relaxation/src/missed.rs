//! Landmarks that a robot should have seen and did not: the no-landmark observations of TBF98
//! section 6, on the way for landmarks that are seen from where they are, at every step for those
//! that a camera has in view.

use meetpoint_geometry::{Point2, Pose};
use nalgebra::{DMatrix, Matrix2x3, Rotation2};

use crate::branch::Branch;
use crate::least_squares::{Chain, Estimate};
use crate::search::SearchParams;
use crate::travel::Detector;

/// A robot that comes this near to a landmark has reached it, in metres; only then a person would
/// press the button.
const REACHED_M: f64 = 0.5;
/// Landmarks this near to one that was reported at either end of a way belong to it, in metres.
const SAME_PLACE_M: f64 = 2.0;
/// Of paths between steps, in metres: robots do not drive on lines.
const PATH_STD_M: f64 = 0.4;
/// Share of a detector's range within which it may be relied upon.
const SURE_SHARE: f64 = 0.5;
/// Share of its field of view, likewise.
const SIDE_SHARE: f64 = 0.8;
/// Over this way what hides a landmark hides it on, in metres.
const SAME_VIEW_M: f64 = 0.05;
/// Of places in view, in metres: what stands in the way hides some of them.
const PLACE_STD_M: f64 = 0.2;

/// What a hypothesis says of the ways driven.
pub(crate) struct Missed<'a> {
    branch: &'a Branch,
    chain: &'a Chain,
    covariance: &'a DMatrix<f64>,
    params: &'a SearchParams,
    node: usize,
    detector: &'a Detector,
}

impl<'a> Missed<'a> {
    /// After the way to `node`, with the covariance of the pose there and of the border.
    pub(crate) fn new(
        branch: &'a Branch,
        chain: &'a Chain,
        covariance: &'a DMatrix<f64>,
        params: &'a SearchParams,
        (node, detector): (usize, &'a Detector),
    ) -> Self {
        Self { branch, chain, covariance, params, node, detector }
    }

    /// Who sees far sees landmarks long before it reaches them.
    fn is_far(&self) -> bool {
        2.0 * REACHED_M < self.detector.range_max_m
    }

    /// Logarithm of the probability that known landmarks on the way to this node, or in view at the
    /// node before, were not reported.
    pub(crate) fn known_landmarks(&self) -> f64 {
        if self.node == 0 {
            return 0.0;
        }
        if self.is_far() {
            return self.known_in_view();
        }
        let estimate = &self.branch.fit.estimate;
        let path = self.path(self.node);
        let ends = [path[0], path[path.len() - 1]];
        let mut sum = 0.0;
        for (landmark, &point) in estimate.landmarks.iter().enumerate() {
            if ends.iter().any(|end| (end - point).norm() < SAME_PLACE_M) {
                continue;
            }
            let std_m = self.relative_std_m(landmark, estimate.poses[self.node]);
            sum += self.log_unreported(&path, point, std_m);
        }
        sum
    }

    /// The same for what was in view at the node before: how well that is known is told by the
    /// covariance of the pose after it.
    fn known_in_view(&self) -> f64 {
        let Estimate { poses, landmarks, .. } = &self.branch.fit.estimate;
        let before = self.node - 1;
        let seen = &self.chain.nodes[before].bearings;
        let is_seen = |landmark| {
            seen.iter().any(|seen| self.branch.association[seen.sighting] == Some(landmark))
        };
        let mut sum = 0.0;
        for (landmark, (number, point)) in (0_u32..).zip(landmarks).enumerate() {
            if is_seen(number) || !self.may_see(poses[before], *point) {
                continue;
            }
            let std_m = self.relative_std_m(landmark, poses[self.node]);
            sum += self.log_unseen(poses[before], *point, std_m);
        }
        sum * self.news(before)
    }

    /// The same for a new landmark at `place`, at all nodes before.
    fn new_in_view(&self, place: Point2<f64>) -> f64 {
        let Estimate { poses, landmarks, .. } = &self.branch.fit.estimate;
        let mut stds_m = vec![None; landmarks.len()];
        let mut sum = 0.0;
        for (node, pose) in poses[..self.node].iter().enumerate() {
            let seen = &self.chain.nodes[node].bearings;
            let anchor = seen.iter().find_map(|seen| self.branch.association[seen.sighting]);
            let Some(anchor) = anchor.map(|anchor| anchor as usize) else { continue };
            if self.may_see(*pose, place) {
                let std_m = *stds_m[anchor]
                    .get_or_insert_with(|| self.relative_std_m(anchor, poses[self.node]));
                sum += self.log_unseen(*pose, place, std_m) * self.news(node);
            }
        }
        sum
    }

    /// How much a view tells that the one before did not, 0 to 1.
    fn news(&self, node: usize) -> f64 {
        if node == 0 {
            return 1.0;
        }
        let path = &self.chain.nodes[node].path;
        let length_m: f64 = path.windows(2).map(|ends| (ends[1] - ends[0]).norm()).sum();
        (length_m / SAME_VIEW_M).min(1.0)
    }

    /// Whether a landmark there can be in view at all.
    fn may_see(&self, pose: Pose, point: Point2<f64>) -> bool {
        let reach_m = self.detector.range_max_m * SURE_SHARE + 1.0;
        (point - pose.position()).norm_squared() < reach_m * reach_m
    }

    /// Logarithm of the probability that a landmark is not seen from `pose`.
    fn log_unseen(&self, pose: Pose, point: Point2<f64>, std_m: f64) -> f64 {
        let place = pose.inverse() * point;
        let distance_m = place.coords.norm();
        let std_m = std_m.hypot(PLACE_STD_M);
        let off_rad = place.y.atan2(place.x).abs();
        let half_rad = self.detector.half_field_of_view_rad * SIDE_SHARE;
        let within = below((half_rad - off_rad) * distance_m / std_m)
            * below((self.detector.range_max_m * SURE_SHARE - distance_m) / std_m);
        (1.0 - (1.0 - self.params.missed_share) * within).ln()
    }

    /// Logarithm of the probability that a landmark at `place`, never seen before this node, was not
    /// reported on the earlier ways, or in view at the earlier nodes.
    pub(crate) fn new_landmark(&self, place: Point2<f64>) -> f64 {
        if self.is_far() {
            return self.new_in_view(place);
        }
        let estimate = &self.branch.fit.estimate;
        let mut sum = 0.0;
        for node in 1..self.node {
            let path = self.path(node);
            let ends = [path[0], path[path.len() - 1]];
            if ends.iter().any(|end| (end - place).norm() < SAME_PLACE_M) {
                continue;
            }
            let seen = &self.chain.nodes[node].bearings;
            let anchor = seen.iter().find_map(|seen| self.branch.association[seen.sighting]);
            let Some(anchor) = anchor else { continue };
            let std_m = self.relative_std_m(anchor as usize, estimate.poses[self.node]);
            sum += self.log_unreported(&path, place, std_m);
        }
        sum
    }

    /// The way to `node` as the estimate has it, in the map.
    fn path(&self, node: usize) -> Vec<Point2<f64>> {
        let poses = &self.branch.fit.estimate.poses;
        let path = &self.chain.nodes[node].path;
        let last = path.len() - 1;
        let begun = poses[node - 1];
        let turn = Rotation2::new(begun.theta_rad);
        let off = poses[node].position() - begun * path[last];
        path.iter()
            .enumerate()
            .map(|(index, &point)| {
                let share = index as f64 / last.max(1) as f64;
                begun.position() + turn * point.coords + off * share
            })
            .collect()
    }

    fn log_unreported(&self, path: &[Point2<f64>], point: Point2<f64>, std_m: f64) -> f64 {
        let distance_m =
            path.iter().map(|passed| (passed - point).norm()).fold(f64::INFINITY, f64::min);
        let reached = within(REACHED_M, distance_m, std_m.hypot(PATH_STD_M));
        (1.0 - (1.0 - self.params.missed_share) * reached).ln()
    }

    /// Standard deviation of a landmark's place seen from the pose, along its worse axis.
    fn relative_std_m(&self, landmark: usize, pose: Pose) -> f64 {
        let point = self.branch.fit.estimate.landmarks[landmark];
        let (dx, dy) = (point.x - pose.x_m, point.y - pose.y_m);
        let by_pose = Matrix2x3::new(-1.0, 0.0, dy, 0.0, -1.0, -dx);
        let at = 6 + 2 * landmark;
        let cross = by_pose * self.covariance.fixed_view::<3, 2>(0, at);
        let spread = by_pose * self.covariance.fixed_view::<3, 3>(0, 0) * by_pose.transpose()
            + self.covariance.fixed_view::<2, 2>(at, at)
            + cross
            + cross.transpose();
        spread.symmetric_eigenvalues().max().max(0.0).sqrt()
    }
}

/// Probability that what is `distance` away, give or take a standard deviation, is within `reach`.
fn within(reach: f64, distance: f64, std: f64) -> f64 {
    below((reach - distance) / std) - below((-reach - distance) / std)
}

/// The normal distribution, to within 2 %: as a logistic one.
fn below(deviations: f64) -> f64 {
    1.0 / (1.0 + (-1.702 * deviations).exp())
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::branch::Branch;
    use crate::chain::Chains;
    use crate::error_model::ErrorModel;
    use crate::landmark::LandmarkKind;
    use crate::motion::Motion;
    use crate::travel::{Sighting, Step, Travel};

    const CAMERA: Detector = Detector { range_max_m: 10.0, half_field_of_view_rad: 0.6 };
    const BUTTON: Detector = Detector { range_max_m: 0.0, half_field_of_view_rad: PI };

    /// A robot that goes 4 m straight on by steps of so much, and sees the first landmark, 1 m to the
    /// left of the way's beginning and 1 m ahead, at each; and all that is asked about landmarks at
    /// `places` at its end.
    fn asked<T>(
        (detector, step_m): (Detector, f64),
        places: &[Point2<f64>],
        ask: impl Fn(&Missed<'_>) -> T,
    ) -> T {
        let seen = Sighting { identity: None, landmark_type: 0, range_m: 1.4, bearing_rad: 0.8 };
        let mut steps = vec![Step { motion: Motion::NONE, sightings: vec![seen] }];
        let mut way_m = 0.0;
        while way_m < 4.0 {
            let motion = Motion::new(vec![Pose::new(step_m / 40.0, 0.0, 0.0); 40]);
            steps.push(Step { motion, sightings: vec![seen] });
            way_m += step_m;
        }
        let travel = Travel { detector, steps };
        let chains = Chains::new(&travel, &ErrorModel::CAMERA);
        let mut branch = Branch::root(travel.n_sightings(), &chains, 0);
        branch.association.fill(Some(0));
        branch.fit.estimate.landmarks = places.to_vec();
        branch.kinds = vec![LandmarkKind::Type(0); places.len()];
        let chain = chains.chain(0, true);
        for node in 0..chains.n_nodes() {
            chain.extend(&mut branch.fit.estimate, node);
        }
        let n = 6 + 2 * places.len();
        let covariance = DMatrix::identity(n, n) * 1e-4;
        let node = chains.n_nodes() - 1;
        let params = SearchParams { missed_share: 0.5, ..SearchParams::CAMERA };
        ask(&Missed::new(&branch, chain, &covariance, &params, (node, &detector)))
    }

    fn of_known(missed: &Missed<'_>) -> f64 {
        missed.known_landmarks()
    }

    const SEEN: Point2<f64> = Point2::new(1.0, 1.0);

    #[test]
    fn what_is_in_view_and_not_seen_counts() {
        let known = |place| asked((CAMERA, 1.0), &[SEEN, place], of_known);
        let ahead = known(Point2::new(5.0, 0.0));
        assert!((ahead - 0.5_f64.ln()).abs() < 0.02, "2 m before the step before: {ahead}");
        for (place, why) in [
            (Point2::new(0.0, 0.0), "behind"),
            (Point2::new(3.0, 2.0), "at the side"),
            (Point2::new(12.0, 0.0), "far away"),
        ] {
            assert!(known(place).abs() < 0.02, "{why}: {}", known(place));
        }
        let seen = asked((CAMERA, 1.0), &[SEEN], of_known);
        assert!(seen.abs() < 1e-12, "it was seen: {seen}");
    }

    #[test]
    fn views_from_one_place_count_once() {
        let unseen = |step_m| {
            asked((CAMERA, step_m), &[SEEN], |missed| missed.new_landmark(Point2::new(4.5, 0.0)))
        };
        let (coarse, fine) = (unseen(SAME_VIEW_M), unseen(SAME_VIEW_M / 8.0));
        assert!(coarse < 10.0 * 0.5_f64.ln(), "many views: {coarse}");
        assert!(
            (coarse - fine).abs() < 0.05 * coarse.abs(),
            "eight times as often: {coarse} {fine}"
        );
    }

    #[test]
    fn a_new_landmark_was_in_none_of_the_views_before() {
        let unseen = |place| asked((CAMERA, 1.0), &[SEEN], |missed| missed.new_landmark(place));
        // From 0, 1 and 2 m it is 4.5, 3.5 and 2.5 m ahead, from 3 m 1.5 m.
        let ahead = unseen(Point2::new(4.5, 0.0));
        assert!((ahead - 4.0 * 0.5_f64.ln()).abs() < 0.1, "four views: {ahead}");
        assert!(unseen(Point2::new(-2.0, 0.0)).abs() < 0.02, "never in view");
    }

    #[test]
    fn a_button_is_pressed_where_the_way_leads_over_a_landmark() {
        let known = |place| asked((BUTTON, 20.0), &[SEEN, place], of_known);
        let passed = known(Point2::new(10.0, 0.0));
        assert!(passed < -0.3, "driven over: {passed}");
        assert!(known(Point2::new(10.0, 4.0)).abs() < 0.01, "4 m beside");
        assert!(
            known(Point2::new(19.0, 0.0)).abs() < 1e-12,
            "at the end it belongs to what is there"
        );
    }
}
