//! The part of a long travel that is not fitted any more: what its steps say of the next pose, the
//! calibration and the landmarks, as one quadratic form.
//!
//! ```text
//! cost(x) = c + g' (x - x0) + (x - x0)' H (x - x0) / 2
//! ```
//!
//! which is what is left of the equations of its steps once their poses are eliminated, as in G.
//! Sibley, L. Matthies and G. Sukhatme, "Sliding window filter with application to planetary
//! landing", Journal of Field Robotics 27 (2010). Without it a search would take time with the square
//! of the travel's length.

use meetpoint_geometry::{Pose, wrap_angle};
use nalgebra::{DMatrix, DVector};

use crate::arrow::Arrow;
use crate::least_squares::{Association, Chain, Estimate, border_of};

/// The quadratic form, over the pose of its node and the border.
#[derive(Clone, Debug)]
pub(crate) struct Past {
    /// The first node that is still fitted.
    pub(crate) node: usize,
    pose: Pose,
    border: DVector<f64>,
    precision: DMatrix<f64>,
    gradient: DVector<f64>,
    cost: f64,
    /// Logarithms of the determinants of what was eliminated and of the precisions that went in.
    pub(crate) log_determinant: f64,
    pub(crate) log_precision: f64,
    /// Sightings of landmarks that went in.
    pub(crate) n_seen: u32,
}

impl Past {
    /// Distance from where the form was made, over the pose and so much of the border as it knows.
    fn offset(&self, estimate: &Estimate) -> DVector<f64> {
        let pose = estimate.poses[self.node];
        let border = border_of(estimate);
        let mut offset = DVector::zeros(self.gradient.len());
        offset[0] = pose.x_m - self.pose.x_m;
        offset[1] = pose.y_m - self.pose.y_m;
        offset[2] = wrap_angle(pose.theta_rad - self.pose.theta_rad);
        for index in 0..self.border.len() {
            offset[3 + index] = border[index] - self.border[index];
        }
        offset
    }

    /// What the past costs at an estimate.
    pub(crate) fn cost(&self, estimate: &Estimate) -> f64 {
        let offset = self.offset(estimate);
        self.cost + self.gradient.dot(&offset) + offset.dot(&(&self.precision * &offset)) / 2.0
    }

    /// Adds the form, seen from an estimate, to equations whose first pose is the form's.
    pub(crate) fn add_to(&self, arrow: &mut Arrow, estimate: &Estimate) {
        let gradient = &self.gradient + &self.precision * self.offset(estimate);
        arrow.add_first(&self.precision, &gradient);
    }

    /// The past up to `node`, whose own sightings do not count yet. `None` if the equations cannot
    /// be solved.
    pub(crate) fn until(
        chain: &Chain,
        estimate: &Estimate,
        association: Association<'_>,
        (before, node): (Option<&Self>, usize),
    ) -> Option<Self> {
        let nodes = before.map_or(0, |past| past.node)..node + 1;
        let arrow = chain.equations(estimate, association, (before, nodes.clone(), false));
        let cost = chain.cost_of(estimate, association, (before, nodes.clone(), false));
        let (log_precision, n_seen) =
            chain.log_precision(association, (before, nodes.clone(), false));
        let rest = arrow.rest()?;
        Some(Self {
            node,
            pose: estimate.poses[node],
            border: border_of(estimate),
            precision: rest.precision,
            gradient: rest.gradient,
            cost: cost - rest.gain,
            log_determinant: rest.log_determinant + before.map_or(0.0, |past| past.log_determinant),
            log_precision,
            n_seen,
        })
    }
}
