//! Any-time descent to a least value of an objective of poses.
//!
//! Steps go against the gradient, metres and radians each measured in a length of their own; a step that does
//! not lower the objective is halved, one that does is made longer. After any number of iterations what was
//! found so far is an answer, better than the start or equal to it; the budget counts iterations and not
//! time, so that results repeat. S. Thrun, "Learning metric-topological maps for indoor mobile robot
//! navigation", Artificial Intelligence 99 (1998), section 2.3.

use meetpoint_geometry::Pose;

use crate::params::DescentParams;

/// The pose at which a descent from `start` ends. `objective` gives a value and its slope along x, y (per metre)
/// and by theta (per radian).
pub(crate) fn descended(
    start: Pose,
    params: &DescentParams,
    objective: impl Fn(Pose) -> (f64, [f64; 3]),
) -> Pose {
    let DescentParams { step_m, step_rad, step_share_min, n_iterations_max } = *params;
    let (mut pose, (mut cost, mut slope)) = (start, objective(start));
    let mut share = 1.0;
    for _ in 0..n_iterations_max {
        let scaled = [slope[0] * step_m, slope[1] * step_m, slope[2] * step_rad];
        let length = scaled.iter().map(|part| part * part).sum::<f64>().sqrt();
        if length == 0.0 || share < step_share_min {
            break;
        }
        let [dx, dy, turn] = scaled.map(|part| -share * part / length);
        let next = Pose::new(
            pose.x_m + step_m * dx,
            pose.y_m + step_m * dy,
            pose.theta_rad + step_rad * turn,
        );
        let there = objective(next);
        if there.0 < cost {
            (pose, (cost, slope)) = (next, there);
            share = (GROWTH * share).min(1.0);
        } else {
            share /= 2.0;
        }
    }
    pose
}

/// How much longer a step is after one that led downward.
const GROWTH: f64 = 1.3;

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const PARAMS: DescentParams =
        DescentParams { step_m: 0.1, step_rad: 0.05, step_share_min: 1e-4, n_iterations_max: 200 };

    /// A bowl, steeper along y, steepest in the turn.
    fn bowl(pose: Pose) -> (f64, [f64; 3]) {
        let Pose { x_m, y_m, theta_rad } = pose;
        let cost = x_m * x_m + 3.0 * y_m * y_m + 5.0 * theta_rad * theta_rad;
        (cost, [2.0 * x_m, 6.0 * y_m, 10.0 * theta_rad])
    }

    proptest! {
        #[test]
        fn never_ends_higher_and_ends_low_in_a_bowl(
            (x_m, y_m, theta_rad) in (-0.5_f64..0.5, -0.5_f64..0.5, -0.5_f64..0.5),
        ) {
            let start = Pose::new(x_m, y_m, theta_rad);
            let mut before = bowl(start).0;
            for n_iterations_max in [0, 1, 2, 5, 10, 50, 200] {
                let params = DescentParams { n_iterations_max, ..PARAMS };
                let cost = bowl(descended(start, &params, bowl)).0;
                prop_assert!(cost <= before, "after {n_iterations_max}: {cost}, before {before}");
                before = cost;
            }
            prop_assert!(before < 1e-4, "{before}");
        }
    }
}
