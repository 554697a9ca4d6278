//! Poses, landmarks and the odometry's steady errors that fit best, once it is settled which
//! landmark every sighting saw.
//!
//! ```text
//! min  sum over ways       |R(t)' (p(t+1) - p(t)), theta(t+1) - theta(t)  -  d(t, c)|²_Q(t)
//!    + sum over sightings  |R(t)' (l(j) - p(t))  -  z|²_S
//!    + |c|²_C
//! ```
//!
//! over poses (p, theta), landmarks l and calibration c, by Gauss and Newton's steps, damped as
//! Levenberg's where one leads uphill. Every step costs O(steps landmarks²).
//!
//! What the data speak for the associations is the integral over all unknowns, by Laplace's method:
//! the density at the best fit times the volume of what fits about as well.

use std::f64::consts::TAU;
use std::ops::Range;
use std::sync::Arc;

use meetpoint_geometry::{Point2, Pose, wrap_angle};
use nalgebra::{DVector, Matrix2, Matrix2x3, Matrix3, Vector2, Vector3};

use crate::arrow::{Arrow, Solution};
use crate::calibration::Calibration;
use crate::chain::difference;
use crate::error_model::{ErrorModel, Way};
use crate::past::Past;

/// Precision that holds the first pose where it is.
pub(crate) const FIRST_POSE_PRECISION: f64 = 1e8;
/// Precision of landmarks before they are seen, in 1/m²: nothing, but enough to be invertible.
const LANDMARK_PRECISION: f64 = 1e-9;
/// Precision of a map to begin with, in 1/m²: by 0.2 m a landmark may be off, twice what a map from
/// a camera is.
const MAP_PRECISION: f64 = 25.0;

/// A landmark's place seen from a step, and how well.
#[derive(Clone, Debug)]
pub(crate) struct Bearing {
    /// Index of the sighting in all of the travel.
    pub(crate) sighting: usize,
    /// Seen from the robot, in metres.
    pub(crate) offset_m: Point2<f64>,
    pub(crate) precision: Matrix2<f64>,
    /// Logarithm of the precision's determinant.
    pub(crate) log_precision: f64,
}

/// A step with sightings, and the way that led to it.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    pub(crate) way: Way,
    pub(crate) way_precision: Matrix3<f64>,
    pub(crate) log_way_precision: f64,
    /// Points of the way seen from its beginning, in metres; its two ends among them.
    pub(crate) path: Vec<Point2<f64>>,
    pub(crate) bearings: Vec<Bearing>,
}

/// The travel, linearised about a calibration.
#[derive(Clone, Debug)]
pub(crate) struct Chain {
    /// What the ways are linearised about.
    pub(crate) calibration: Calibration,
    /// What the odometry is expected to need, and how surely.
    pub(crate) prior: Calibration,
    pub(crate) calibration_precision: Vector3<f64>,
    /// Sightings further off than this many standard deviations count linearly, not squared
    /// (P. J. Huber, "Robust estimation of a location parameter", 1964).
    pub(crate) deviations_max: f64,
    /// Where an estimate begins.
    pub(crate) start: Pose,
    /// How precisely that is known, in 1/m² and 1/rad².
    pub(crate) start_precision: f64,
    /// Where the first landmarks are taken to be, before they are seen; the others may be anywhere.
    pub(crate) map: Arc<Vec<Point2<f64>>>,
    /// The way to the first does not count.
    pub(crate) nodes: Arc<Vec<Node>>,
}

/// Poses, landmarks and calibration.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Estimate {
    pub(crate) poses: Vec<Pose>,
    pub(crate) landmarks: Vec<Point2<f64>>,
    pub(crate) calibration: Calibration,
}

/// Which landmark each sighting saw; `None` for a false one, and for those beyond the chain's part
/// that is looked at.
pub(crate) type Association<'a> = &'a [Option<u32>];

/// A fit with what it says of its associations.
#[derive(Clone, Debug)]
pub(crate) struct Fit {
    pub(crate) estimate: Estimate,
    /// Logarithm of the density of all measurements, integrated over all unknowns, with a uniform
    /// density of 1/m² for every landmark.
    pub(crate) log_evidence: f64,
    /// Half of the weighted sum of squares.
    pub(crate) cost: f64,
}

/// A stretch of nodes: what came before as a quadratic form, the nodes, and whether the last one's
/// sightings count.
pub(crate) type Stretch<'a> = (Option<&'a Past>, Range<usize>, bool);

impl Chain {
    /// Fits the nodes from the past's to the last that `estimate` has, from there on, with at most so
    /// many steps, until one is smaller than so much, in metres and radians. `None` if the equations
    /// cannot be solved.
    pub(crate) fn fit(
        &self,
        mut estimate: Estimate,
        association: Association<'_>,
        past: Option<&Past>,
        (n_steps_max, step_min): (u32, f64),
    ) -> Option<Fit> {
        let nodes = stretch(past, &estimate.poses);
        let mut cost = self.cost_of(&estimate, association, nodes.clone());
        let mut damping = 0.0;
        let mut n_steps = 0;
        loop {
            let mut arrow = self.equations(&estimate, association, nodes.clone());
            arrow.damp(damping);
            let solution = arrow.solve()?;
            let moved = moved(&estimate, &solution, nodes.1.start);
            let moved_cost = self.cost_of(&moved, association, nodes.clone());
            n_steps += 1;
            let is_small = solution.largest() < step_min;
            let is_downhill = moved_cost <= cost || is_small;
            if is_downhill {
                (estimate, cost) = (moved, moved_cost);
                damping /= 10.0;
            } else {
                damping = (damping * 10.0).max(1.0);
            }
            let n_max = if is_downhill { n_steps_max } else { n_steps_max.max(N_UPHILL_MAX) };
            if is_small || n_max <= n_steps {
                // The volume is that of the undamped equations.
                let log_determinant = if damping == 0.0 && is_downhill {
                    solution.log_determinant
                } else {
                    self.equations(&estimate, association, nodes.clone()).solve()?.log_determinant
                };
                let n_landmarks = estimate.landmarks.len();
                let log_evidence =
                    self.log_evidence(n_landmarks, association, nodes, cost, log_determinant);
                return Some(Fit { estimate, log_evidence, cost });
            }
        }
    }

    /// The equations of one step from `estimate`, over all nodes that it has.
    pub(crate) fn linearised(
        &self,
        estimate: &Estimate,
        association: Association<'_>,
        past: Option<&Past>,
    ) -> Arrow {
        self.equations(estimate, association, stretch(past, &estimate.poses))
    }

    /// The equations of one step from `estimate`.
    pub(crate) fn equations(
        &self,
        estimate: &Estimate,
        association: Association<'_>,
        (past, nodes, with_last): Stretch<'_>,
    ) -> Arrow {
        let n_border = 3 + 2 * estimate.landmarks.len();
        let mut arrow = Arrow::new(nodes.len(), n_border);
        match past {
            Some(past) => past.add_to(&mut arrow, estimate),
            None => {
                let precision = Matrix3::identity() * self.start_precision;
                arrow.add_prior(0, precision, vector(estimate.poses[0]) - vector(self.start));
                let off = difference(&estimate.calibration, &self.prior);
                for (index, (&precision, &off)) in
                    self.calibration_precision.iter().zip(&off).enumerate()
                {
                    arrow.add_border_prior(index, precision, off);
                }
                for (index, off) in self.off_map(estimate).enumerate() {
                    arrow.add_border_prior(3 + 2 * index, MAP_PRECISION, off.x);
                    arrow.add_border_prior(4 + 2 * index, MAP_PRECISION, off.y);
                }
            }
        }
        for index in 3..n_border {
            arrow.add_border_prior(index, LANDMARK_PRECISION, 0.0);
        }
        for (index, node_index) in nodes.clone().enumerate() {
            let (node, pose) = (&self.nodes[node_index], estimate.poses[node_index]);
            if 0 < index {
                let before = estimate.poses[node_index - 1];
                let (residual, by_before, by_after) =
                    self.way_residual(node, estimate, before, pose);
                let derivatives = [&by_before, &by_after, &(-node.way.by_calibration)];
                arrow.add_way(index - 1, derivatives, &node.way_precision, &residual);
            }
            for (bearing, landmark) in
                counted(node, association, with_last || node_index + 1 < nodes.end)
            {
                let point = estimate.landmarks[landmark];
                let (residual, by_pose, by_point) = sighting_residual(pose, point, bearing);
                let precision = bearing.precision * self.weight(bearing, &residual);
                let by = (&by_pose, &by_point);
                arrow.add_sighting(index, 3 + 2 * landmark, by, &precision, &residual);
            }
        }
        arrow
    }

    /// Half of the weighted sum of squares.
    pub(crate) fn cost_of(
        &self,
        estimate: &Estimate,
        association: Association<'_>,
        (past, nodes, with_last): Stretch<'_>,
    ) -> f64 {
        let off = difference(&estimate.calibration, &self.prior);
        let of_calibration = off.component_mul(&self.calibration_precision).dot(&off);
        let of_map = |off: Vector2<f64>| MAP_PRECISION * off.norm_squared();
        let of_priors = || of_calibration + self.off_map(estimate).map(of_map).sum::<f64>();
        let mut sum = past.map_or_else(of_priors, |past| 2.0 * past.cost(estimate));
        for (index, node_index) in nodes.clone().enumerate() {
            let (node, pose) = (&self.nodes[node_index], estimate.poses[node_index]);
            if 0 < index {
                let before = estimate.poses[node_index - 1];
                let (residual, ..) = self.way_residual(node, estimate, before, pose);
                sum += (node.way_precision * residual).dot(&residual);
            }
            for (bearing, landmark) in
                counted(node, association, with_last || node_index + 1 < nodes.end)
            {
                let point = estimate.landmarks[landmark];
                let (residual, ..) = sighting_residual(pose, point, bearing);
                let squares = (bearing.precision * residual).dot(&residual);
                // Squares up to the bound, then the line that goes on from there.
                let weight = self.weight(bearing, &residual);
                sum += squares * weight * (2.0 - weight);
            }
        }
        sum / 2.0
    }

    /// Sum of the logarithms of all precisions' determinants, and how many sightings are of a
    /// landmark.
    pub(crate) fn log_precision(
        &self,
        association: Association<'_>,
        (past, nodes, with_last): Stretch<'_>,
    ) -> (f64, u32) {
        let at_first =
            self.calibration_precision.map(f64::ln).sum() + 3.0 * self.start_precision.ln();
        let mut sum = past.map_or(at_first, |past| past.log_precision);
        let mut n_seen = past.map_or(0, |past| past.n_seen);
        for (index, node_index) in nodes.clone().enumerate() {
            let node = &self.nodes[node_index];
            if 0 < index {
                sum += node.log_way_precision;
            }
            for (bearing, _) in counted(node, association, with_last || node_index + 1 < nodes.end)
            {
                sum += bearing.log_precision;
                n_seen += 1;
            }
        }
        (sum, n_seen)
    }

    fn log_evidence(
        &self,
        n_landmarks: usize,
        association: Association<'_>,
        nodes: Stretch<'_>,
        cost: f64,
        log_determinant: f64,
    ) -> f64 {
        let eliminated = nodes.0.map_or(0.0, |past| past.log_determinant);
        let (log_precision, n_seen) = self.log_precision(association, nodes);
        // Every sighting has two numbers with a density, every landmark two to integrate over.
        let volume = (n_landmarks as f64 - f64::from(n_seen)) * TAU.ln();
        (log_precision - eliminated - log_determinant) / 2.0 - cost + volume
    }

    /// How far the first landmarks are from where they are taken to be.
    fn off_map<'a>(&'a self, estimate: &'a Estimate) -> impl Iterator<Item = Vector2<f64>> + 'a {
        estimate.landmarks.iter().zip(self.map.iter()).map(|(at, known)| at - known)
    }

    /// How much a sighting counts, in (0, 1].
    fn weight(&self, bearing: &Bearing, residual: &Vector2<f64>) -> f64 {
        let deviations = (bearing.precision * residual).dot(residual).sqrt();
        if deviations <= self.deviations_max { 1.0 } else { self.deviations_max / deviations }
    }

    /// What odometry says of the way to `node` with the calibration estimated.
    pub(crate) fn displacement(&self, node: &Node, calibration: &Calibration) -> Vector3<f64> {
        let change = difference(calibration, &self.calibration);
        vector(node.way.displacement) + node.way.by_calibration * change
    }

    /// Residual of a way with its derivatives by both poses.
    fn way_residual(
        &self,
        node: &Node,
        estimate: &Estimate,
        before: Pose,
        after: Pose,
    ) -> (Vector3<f64>, Matrix3<f64>, Matrix3<f64>) {
        let (sin, cos) = before.theta_rad.sin_cos();
        let (dx, dy) = (after.x_m - before.x_m, after.y_m - before.y_m);
        let (along, across) = (cos * dx + sin * dy, cos * dy - sin * dx);
        let told = self.displacement(node, &estimate.calibration);
        let turn_rad = wrap_angle(after.theta_rad - before.theta_rad - told.z);
        let residual = Vector3::new(along - told.x, across - told.y, turn_rad);
        let by_after = Matrix3::new(cos, sin, 0.0, -sin, cos, 0.0, 0.0, 0.0, 1.0);
        let by_before = Matrix3::new(-cos, -sin, across, sin, -cos, -along, 0.0, 0.0, -1.0);
        (residual, by_before, by_after)
    }
}

/// Steps uphill in a row, and others, after which a fit is given up where it stands.
const N_UPHILL_MAX: u32 = 12;

impl Bearing {
    /// The sighting with that index.
    pub(crate) fn new(sighting: usize, seen: &crate::travel::Sighting, model: &ErrorModel) -> Self {
        let covariance = model.sighting_covariance(seen);
        let precision = covariance.try_inverse().unwrap_or_else(Matrix2::identity);
        Self {
            sighting,
            offset_m: seen.offset_m(),
            precision,
            log_precision: precision.determinant().ln(),
        }
    }
}

/// Residual of a landmark at `point` seen from `pose`, with its derivatives by both.
pub(crate) fn sighting_residual(
    pose: Pose,
    point: Point2<f64>,
    bearing: &Bearing,
) -> (Vector2<f64>, Matrix2x3<f64>, Matrix2<f64>) {
    let (sin, cos) = pose.theta_rad.sin_cos();
    let (dx, dy) = (point.x - pose.x_m, point.y - pose.y_m);
    let (along, across) = (cos * dx + sin * dy, cos * dy - sin * dx);
    let residual = Vector2::new(along - bearing.offset_m.x, across - bearing.offset_m.y);
    let by_point = Matrix2::new(cos, sin, -sin, cos);
    let by_pose = Matrix2x3::new(-cos, -sin, across, sin, -cos, -along);
    (residual, by_pose, by_point)
}

pub(crate) fn moved(estimate: &Estimate, solution: &Solution, first: usize) -> Estimate {
    let mut poses = estimate.poses.clone();
    for (pose, step) in poses[first..].iter_mut().zip(&solution.poses) {
        *pose = Pose::new(pose.x_m + step.x, pose.y_m + step.y, pose.theta_rad + step.z);
    }
    let landmarks = estimate
        .landmarks
        .iter()
        .enumerate()
        .map(|(index, point)| {
            let at = 3 + 2 * index;
            Point2::new(point.x + solution.border[at], point.y + solution.border[at + 1])
        })
        .collect();
    let calibration = Calibration {
        scale: estimate.calibration.scale + solution.border[0],
        turn_per_m: estimate.calibration.turn_per_m + solution.border[1],
        turn_per_rad: estimate.calibration.turn_per_rad + solution.border[2],
    };
    Estimate { poses, landmarks, calibration }
}

/// Calibration and landmarks as one vector.
pub(crate) fn border_of(estimate: &Estimate) -> DVector<f64> {
    let Calibration { scale, turn_per_m, turn_per_rad } = estimate.calibration;
    let landmarks = estimate.landmarks.iter().flat_map(|point| [point.x, point.y]);
    let n = 3 + 2 * estimate.landmarks.len();
    DVector::from_iterator(n, [scale, turn_per_m, turn_per_rad].into_iter().chain(landmarks))
}

/// All nodes that have poses and are not past.
fn stretch<'a>(past: Option<&'a Past>, poses: &[Pose]) -> Stretch<'a> {
    (past, past.map_or(0, |past| past.node)..poses.len(), true)
}

/// A node's sightings of landmarks, if they count.
fn counted<'a>(
    node: &'a Node,
    association: Association<'a>,
    counts: bool,
) -> impl Iterator<Item = (&'a Bearing, usize)> {
    let of_landmark = move |bearing: &'a Bearing| {
        association[bearing.sighting].map(|landmark| (bearing, landmark as usize))
    };
    node.bearings.iter().filter(move |_| counts).filter_map(of_landmark)
}

fn vector(pose: Pose) -> Vector3<f64> {
    Vector3::new(pose.x_m, pose.y_m, pose.theta_rad)
}
