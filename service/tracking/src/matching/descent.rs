//! Descent to the pose that agrees best with the field and the odometry.
//!
//! ```text
//! J(pose) = 1/n sum over points p of (1 - f(pose * p))^2 / 2
//!         + gain_m2 |pose - odometry|^2 + gain_rad2 (theta - theta_odometry)^2
//! ```
//!
//! J is that of Thrun 1998, eq. (4), with the squared shortfall of the correlation in place of the
//! correlation itself, which has the same best poses where walls agree and lets Gauss-Newton steps
//! take the place of plain gradient descent (S. Kohlbrecher et al., "A flexible and scalable SLAM
//! system with full 3D motion estimation", SSRR 2011, eqs. (7) to (12)). The budget counts
//! iterations. Time O(iterations * points).

use meetpoint_geometry::{Point2, Pose, angle_between};

use crate::matching::field::Field;
use crate::matching::points::ScanPoint;
use crate::matching::search::Prior;

/// Steps shorter than this in metres and radians change nothing that matters.
const STEP_MIN: f64 = 1e-4;

/// Sums that make a Gauss-Newton step.
#[derive(Clone, Copy, Default)]
struct Normal {
    /// xx, xy, xt, yy, yt, tt
    hessian: [f64; 6],
    gradient: [f64; 3],
    cost: f64,
}

/// The pose to which the descent from `start` leads. `points` are in the robot's frame.
pub(crate) fn descend(
    field: &Field,
    points: &[ScanPoint],
    start: Pose,
    prior: &Prior,
    n_iterations_max: u32,
) -> Pose {
    let mut pose = start;
    let mut normal = normal(field, points, pose, prior);
    let mut damping = 1e-4;
    for _ in 0..n_iterations_max {
        let Some(step) = solve(&normal, damping) else { break };
        let next = Pose::new(pose.x_m + step[0], pose.y_m + step[1], pose.theta_rad + step[2]);
        let there = self::normal(field, points, next, prior);
        if there.cost < normal.cost {
            pose = next;
            normal = there;
            damping *= 0.3;
        } else {
            damping *= 10.0;
        }
        if step.iter().all(|part| part.abs() < STEP_MIN) {
            break;
        }
    }
    pose
}

fn normal(field: &Field, points: &[ScanPoint], pose: Pose, prior: &Prior) -> Normal {
    let mut sums = Normal::default();
    let (sin, cos) = pose.theta_rad.sin_cos();
    let mut total = 0.0;
    for &ScanPoint { at: point, weight } in points {
        total += weight;
        let (rx, ry) = (cos * point.x - sin * point.y, sin * point.x + cos * point.y);
        let (value, gx, gy) = field.interpolate(Point2::new(pose.x_m + rx, pose.y_m + ry));
        let gt = rx * gy - ry * gx;
        let short = 1.0 - value;
        sums.cost += 0.5 * weight * short * short;
        let short = weight * short;
        sums.gradient[0] += short * gx;
        sums.gradient[1] += short * gy;
        sums.gradient[2] += short * gt;
        let products = [gx * gx, gx * gy, gx * gt, gy * gy, gy * gt, gt * gt];
        for (sum, product) in sums.hessian.iter_mut().zip(products) {
            *sum += weight * product;
        }
    }
    let share = if total > 0.0 { 1.0 / total } else { 0.0 };
    sums.cost *= share;
    sums.gradient.iter_mut().for_each(|sum| *sum *= share);
    sums.hessian.iter_mut().for_each(|sum| *sum *= share);
    add_prior(&mut sums, pose, prior);
    sums
}

fn add_prior(sums: &mut Normal, pose: Pose, prior: &Prior) {
    let (dx, dy) = (pose.x_m - prior.center.x_m, pose.y_m - prior.center.y_m);
    let turn = angle_between(prior.center.theta_rad, pose.theta_rad);
    let (by_m2, by_rad2) = (prior.gain_per_m2, prior.gain_per_rad2);
    let loss = by_m2 * (dx * dx + dy * dy) + by_rad2 * turn * turn;
    if loss >= prior.loss_max {
        sums.cost += prior.loss_max;
        return;
    }
    sums.cost += loss;
    sums.gradient[0] -= 2.0 * by_m2 * dx;
    sums.gradient[1] -= 2.0 * by_m2 * dy;
    sums.gradient[2] -= 2.0 * by_rad2 * turn;
    sums.hessian[0] += 2.0 * by_m2;
    sums.hessian[3] += 2.0 * by_m2;
    sums.hessian[5] += 2.0 * by_rad2;
}

/// The damped Gauss-Newton step, or `None` if there is none.
fn solve(normal: &Normal, damping: f64) -> Option<[f64; 3]> {
    let [xx, xy, xt, yy, yt, tt] = normal.hessian;
    let (xx, yy, tt) =
        (xx * (1.0 + damping) + 1e-9, yy * (1.0 + damping) + 1e-9, tt * (1.0 + damping) + 1e-9);
    let (a, b, c) = (yy * tt - yt * yt, xt * yt - xy * tt, xy * yt - xt * yy);
    let determinant = xx * a + xy * b + xt * c;
    if !determinant.is_finite() || determinant <= 0.0 {
        return None;
    }
    let [x, y, t] = normal.gradient;
    let (d, e, f) = (xx * tt - xt * xt, xy * xt - xx * yt, xx * yy - xy * xy);
    let step = [
        (a * x + b * y + c * t) / determinant,
        (b * x + d * y + e * t) / determinant,
        (c * x + e * y + f * t) / determinant,
    ];
    step.iter().all(|part| part.is_finite()).then_some(step)
}
