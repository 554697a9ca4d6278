//! A place of the newcomer moved to where its walls fit best, between cells.
//!
//! ```text
//! E(T) = sum over walls p of the newcomer, q the wall of the site nearest to T p, of
//!        rho(n_q . (T p - q))
//! ```
//!
//! with the function rho of Geman and `McClure`, minimised by Gauss-Newton steps while the gate closes:
//! Y. Chen, G. Medioni, "Object modelling by registration of multiple range images", Image and Vision
//! Computing 10 (1992). Time O(steps * walls).

use meetpoint_geometry::{Point2, Pose, Vector2};
use nalgebra::{Matrix3, Vector3};

use crate::nearest_walls::REACH_M;
use crate::part::Part;

/// Walls farther apart than these are not the same, in metres: gates that follow one another, as many
/// steps each.
const GATES_M: [f64; 3] = [REACH_M, 0.5, 0.4];
/// Steps at each gate.
const N_STEPS: u32 = 6;
/// A step shorter than this in metres and radians changes nothing that matters.
const STEP_MIN: f64 = 1e-4;
/// Walls whose directions differ by more are not the same: cosine.
const COSINE_MIN: f64 = 0.8;
/// Deviation of a wall's place, in metres, if each said something of its own...
const WALL_STD_M: f64 = 0.05;
/// ...and metres of wall that do not: an error of the map goes on along a wall.
const WITNESS_M: f64 = 1.0;
/// Information that stands for none: a metre, and a radian.
const DAMPING: f64 = 1.0;
/// Share of the information across walls that is not believed of the direction along them: their
/// directions err by 0.03 radians.
const SEEMING_SHARE: f64 = 0.03 * 0.03;
/// No place is surer than this, in metres...
const STD_MIN_M: f64 = 0.03;
/// ...and radians: what the bending of maps leaves.
const STD_MIN_RAD: f64 = 0.2 * std::f64::consts::PI / 180.0;

/// A refined place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Refined {
    pub(crate) site_from_newcomer: Pose,
    /// Information about a small step after the place: x, y in the site's frame, and a turn about the
    /// point that `middle` is placed at.
    information: Matrix3<f64>,
    /// In the newcomer's frame.
    middle: Point2<f64>,
}

/// Moves a place by the walls of the newcomer, `n_walls_max` of them at most. `middle`, in the
/// newcomer's frame, is what a turn turns about.
pub(crate) fn refined(
    (site, newcomer): (&Part, &Part),
    start: Pose,
    middle: Point2<f64>,
    n_walls_max: usize,
) -> Refined {
    let stride = newcomer.walls.len().div_ceil(n_walls_max.max(1)).max(1);
    let mut pose = start;
    let mut information = Matrix3::zeros();
    for gate_m in GATES_M {
        for _ in 0..N_STEPS {
            let (hessian, gradient) = form((site, newcomer), (pose, middle), gate_m, stride);
            information = hessian;
            let damped = hessian + Matrix3::identity() * DAMPING;
            let Some(factor) = damped.cholesky() else { break };
            let step = -factor.solve(&gradient);
            pose = turned_about(pose, middle, step);
            if step.amax() < STEP_MIN {
                break;
            }
        }
    }
    Refined { site_from_newcomer: pose, information, middle }
}

/// A place after a step of its middle and a turn about that.
pub(crate) fn turned_about(pose: Pose, middle: Point2<f64>, step: Vector3<f64>) -> Pose {
    let there = pose * middle;
    let theta_rad = pose.theta_rad + step.z;
    let back = Pose::new(0.0, 0.0, theta_rad) * middle;
    Pose::new(there.x + step.x - back.x, there.y + step.y - back.y, theta_rad)
}

fn form(
    (site, newcomer): (&Part, &Part),
    (pose, middle): (Pose, Point2<f64>),
    gate_m: f64,
    stride: usize,
) -> (Matrix3<f64>, Vector3<f64>) {
    let (mut hessian, mut gradient) = (Matrix3::zeros(), Vector3::zeros());
    let (sin, cos) = pose.theta_rad.sin_cos();
    let turned = |v: Vector2<f64>| Vector2::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y);
    let center = pose * middle;
    let turn2 = 0.25 * gate_m * gate_m;
    for wall in newcomer.walls.iter().step_by(stride) {
        let at = pose.position() + turned(wall.at.coords);
        let Some(near) = site.nearest.near(&site.ground, &site.walls, at) else { continue };
        let away = at - near.at;
        if gate_m * gate_m < away.norm_squared() {
            continue;
        }
        let own = wall.normal.map(turned);
        let Some(normal) = near.normal.or(own) else { continue };
        if let (Some(a), Some(b)) = (own, near.normal) {
            let cosine = a.dot(&b);
            let is_two_sided = wall.is_one_sided && near.is_one_sided;
            if (if is_two_sided { cosine } else { cosine.abs() }) < COSINE_MIN {
                continue;
            }
        }
        let error = normal.dot(&away);
        let flat = turn2 / (turn2 + error * error);
        let arm = at - center;
        let slope = Vector3::new(normal.x, normal.y, arm.x * normal.y - arm.y * normal.x);
        hessian += slope * slope.transpose() * (flat * flat);
        gradient += slope * (error * flat * flat);
    }
    let witness = (stride as f64 * newcomer.ground.edge_m() / WITNESS_M).min(1.0);
    let information = witness / (WALL_STD_M * WALL_STD_M);
    (hessian * information, gradient * information)
}

impl Refined {
    /// Covariance of x, y and the turn at the middle, in the site's frame.
    pub(crate) fn covariance_at_middle(&self) -> Matrix3<f64> {
        let seeming = SEEMING_SHARE * (self.information[(0, 0)] + self.information[(1, 1)]);
        let doubted = Matrix3::from_diagonal(&Vector3::new(seeming, seeming, 0.0));
        let mut eigen = (self.information - doubted).symmetric_eigen();
        eigen.eigenvalues.apply(|value| *value = value.max(0.0) + DAMPING);
        let floor = Vector3::new(STD_MIN_M, STD_MIN_M, STD_MIN_RAD).map(|std| std * std);
        let covariance = eigen.recompose().try_inverse().unwrap_or_else(Matrix3::identity);
        covariance + Matrix3::from_diagonal(&floor)
    }

    /// Covariance of `site_from_newcomer`'s three numbers, row by row.
    pub(crate) fn covariance(&self) -> [[f64; 3]; 3] {
        let arm = self.site_from_newcomer.position() - self.site_from_newcomer * self.middle;
        let by = Matrix3::new(1.0, 0.0, -arm.y, 0.0, 1.0, arm.x, 0.0, 0.0, 1.0);
        let covariance = by * self.covariance_at_middle() * by.transpose();
        std::array::from_fn(|row| std::array::from_fn(|column| covariance[(row, column)]))
    }

    /// Largest standard deviation of the middle's position, in metres, and the unit vector along which
    /// it lies.
    pub(crate) fn weakest(&self) -> (f64, Vector2<f64>) {
        let covariance = self.covariance_at_middle();
        let (xx, xy) = (covariance[(0, 0)], covariance[(0, 1)]);
        let yy = covariance[(1, 1)];
        let most = 0.5 * (xx + yy) + (0.25 * (xx - yy) * (xx - yy) + xy * xy).sqrt();
        let along_rad = 0.5 * (2.0 * xy).atan2(xx - yy);
        (most.max(0.0).sqrt(), Vector2::new(along_rad.cos(), along_rad.sin()))
    }
}
