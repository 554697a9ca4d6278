//! Two scans that saw the same walls: what they say of how the robot's poses relate.
//!
//! ```text
//! E(r) = sum over facets p of scan b, q the facet of scan a nearest to r p, of
//!        1 / std^2 rho(n_q . (r p - q)),        r = pose of b seen from a
//! ```
//!
//! with the function rho of Geman and `McClure`, so that what only one of them saw says little; its
//! quadratic form about a given r, which is what a pose graph takes. Y. Chen, G. Medioni, "Object
//! modelling by registration of multiple range images", Image and Vision Computing 10 (1992);
//! F. Lu, E. Milios, "Globally consistent range scan alignment for environment mapping", Autonomous
//! Robots 4 (1997). Time O(facets).

use meetpoint_geometry::{Point2, Pose, Vector2};
use nalgebra::{ArrayStorage, Matrix3, Vector3};

use crate::scans::surface::{Facet, Surface};

/// Tunables of matching two scans.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PairParams {
    /// Facets farther apart than this are not the same, in metres.
    pub(crate) gate_m: f64,
    /// Where rho turns from square to flat, in metres.
    pub(crate) turn_m: f64,
    /// Standard deviation of a facet's place, in metres.
    pub(crate) facet_std_m: f64,
}

/// The quadratic form of a pair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PairForm {
    /// Second derivative: the information about x, y in metres and theta in radians.
    pub(crate) hessian: Matrix3<f64>,
    /// First derivative.
    pub(crate) gradient: Vector3<f64>,
    /// Facets that met another.
    pub(crate) n_met: u32,
    /// Facets that were asked.
    pub(crate) n_asked: u32,
}

/// The form of `b` against `a` about `a_from_b`, by every `stride`-th of the facets `b`.
pub(crate) fn pair_form(
    a: &Surface,
    b: &[Facet],
    a_from_b: Pose,
    params: &PairParams,
    stride: usize,
) -> PairForm {
    let mut form = PairForm::NONE;
    #[expect(clippy::cast_possible_truncation, reason = "facets are kept in single precision")]
    let single = |number: f64| number as f32;
    let (sin, cos) = a_from_b.theta_rad.sin_cos();
    let (sin, cos, x, y) = (single(sin), single(cos), single(a_from_b.x_m), single(a_from_b.y_m));
    let turned = |v: Vector2<f32>| Vector2::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y);
    let (turn2, gate_m) = (single(params.turn_m * params.turn_m), single(params.gate_m));
    // xx, xy, xt, yy, yt, tt and x, y, t
    let mut sums = [0.0_f64; 9];
    for facet in b.iter().step_by(stride.max(1)) {
        form.n_asked += 1;
        let arm = turned(facet.at.coords);
        let place = Point2::new(x + arm.x, y + arm.y);
        let Some(met) = a.nearest(place, turned(facet.normal), gate_m) else { continue };
        form.n_met += 1;
        let (nx, ny) = (met.normal.x, met.normal.y);
        let error = nx * (place.x - met.at.x) + ny * (place.y - met.at.y);
        let flat = turn2 / (turn2 + error * error);
        let weight = flat * flat;
        let turn = arm.x * ny - arm.y * nx;
        let products = [nx * nx, nx * ny, nx * turn, ny * ny, ny * turn, turn * turn];
        let slopes = [nx * error, ny * error, turn * error];
        for (sum, part) in sums.iter_mut().zip(products.iter().chain(&slopes)) {
            *sum += f64::from(weight * part);
        }
    }
    let [xx, xy, xt, yy, yt, tt, gx, gy, gt] = sums;
    let information = params.facet_std_m.powi(-2);
    form.hessian = Matrix3::new(xx, xy, xt, xy, yy, yt, xt, yt, tt) * information;
    form.gradient = Vector3::new(gx, gy, gt) * information;
    form
}

impl PairForm {
    /// Of no facets.
    pub(crate) const NONE: Self = Self {
        hessian: Matrix3::from_array_storage(ArrayStorage([[0.0; 3]; 3])),
        gradient: Vector3::new(0.0, 0.0, 0.0),
        n_met: 0,
        n_asked: 0,
    };

    /// Share of the facets that met another.
    pub(crate) fn met_share(&self) -> f64 {
        f64::from(self.n_met) / f64::from(self.n_asked.max(1))
    }

    /// The step to the form's minimum, with a little damping so that directions about which the form
    /// says nothing stay as they are.
    pub(crate) fn step(&self) -> Vector3<f64> {
        let damped = self.hessian + Matrix3::from_diagonal(&DAMPING);
        damped.cholesky().map_or_else(Vector3::zeros, |factor| -factor.solve(&self.gradient))
    }
}

/// Information that stands for none: a metre, and a radian.
const DAMPING: Vector3<f64> = Vector3::new(1.0, 1.0, 1.0);

/// The pose of `b` seen from `a` that fits best near `start`, and the form there.
pub(crate) fn fitted(
    a: &Surface,
    b: &Surface,
    start: Pose,
    params: &PairParams,
    (stride, n_iterations): (usize, u32),
) -> (Pose, PairForm) {
    let mut pose = start;
    let mut form = pair_form(a, b.facets(), pose, params, stride);
    for _ in 0..n_iterations {
        let step = form.step();
        pose = moved(pose, step);
        form = pair_form(a, b.facets(), pose, params, stride);
        if step.amax() < STEP_MIN {
            break;
        }
    }
    (pose, form)
}

/// Steps shorter than this in metres and radians change nothing that matters.
const STEP_MIN: f64 = 1e-4;

/// A pose after a step of its three numbers.
pub(crate) fn moved(pose: Pose, step: Vector3<f64>) -> Pose {
    Pose::new(pose.x_m + step.x, pose.y_m + step.y, pose.theta_rad + step.z)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use meetpoint_occupancy::LaserGeometry;
    use proptest::prelude::*;

    use super::*;
    use crate::scans::laser_travel::TravelLaser;

    const LASER: TravelLaser = TravelLaser {
        robot_from_sensor: Pose::IDENTITY,
        geometry: LaserGeometry {
            angle_min_rad: -PI,
            angle_increment_rad: PI / 180.0,
            n_beams: 360,
            range_min_m: 0.0,
            range_max_m: 20.0,
        },
    };
    const PARAMS: PairParams = PairParams { gate_m: 0.3, turn_m: 0.2, facet_std_m: 0.05 };

    /// What is seen from a pose between the walls at ±`x_m` and ±`y_m`.
    fn seen(pose: Pose, (x_m, y_m): (f64, f64)) -> Surface {
        #[expect(clippy::cast_possible_truncation, reason = "ranges are sent as f32")]
        let range = |beam: u32| {
            let (sin, cos) = (pose.theta_rad + LASER.geometry.bearing_rad(beam)).sin_cos();
            let to_x_m = (x_m - pose.x_m * cos.signum()) / cos.abs();
            let to_y_m = (y_m - pose.y_m * sin.signum()) / sin.abs();
            to_x_m.min(to_y_m) as f32
        };
        Surface::new(&LASER, &(0..360).map(range).collect::<Vec<f32>>(), 20.0)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn finds_how_the_poses_relate(
            (x, y, turn) in (-0.3_f64..0.3, -0.3_f64..0.3, -0.3_f64..0.3),
            (dx, dy, dt) in (-0.1_f64..0.1, -0.1_f64..0.1, -0.03_f64..0.03),
        ) {
            let truth = Pose::new(x, y, turn);
            let (a, b) = (seen(Pose::IDENTITY, (3.0, 2.0)), seen(truth, (3.0, 2.0)));
            let start = Pose::new(x + dx, y + dy, turn + dt);
            let (found, form) = fitted(&a, &b, start, &PARAMS, (1, 20));
            let error = truth.step_to(found);
            prop_assert!(error.distance_m() < 0.01, "{error:?}");
            prop_assert!(error.theta_rad.abs() < 0.005, "{error:?}");
            prop_assert!(0.9 < form.met_share(), "{form:?}");
        }
    }

    #[test]
    fn a_corridor_says_nothing_of_where_along_it_one_is() {
        let a = seen(Pose::IDENTITY, (1e3, 1.0));
        let b = seen(Pose::new(0.2, 0.1, 0.0), (1e3, 1.0));
        let form = pair_form(&a, b.facets(), Pose::new(0.2, 0.05, 0.0), &PARAMS, 1);
        assert!(form.hessian[(0, 0)] < 1e-4 * form.hessian[(1, 1)], "{}", form.hessian);
        let step = form.step();
        assert!(step.x.abs() < 0.005 && (step.y - 0.05).abs() < 0.01, "{step}");
    }
}
