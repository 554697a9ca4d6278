//! Robust pose graph in the plane.
//!
//! ```text
//! F(poses) = sum over edges (i, j, z, L) of rho(e' L e),   e = (pose_i^-1 pose_j) - z
//! ```
//!
//! with e taken number by number (the turn wrapped), and rho(s) = s c / (c + s) for edges that may be
//! wrong (Geman and `McClure`), rho(s) = s for others. By Levenberg and Marquardt on the sparse normal
//! equations, each edge weighted by rho'(s): K. Mac Tavish, T. Barfoot, "At all costs: a comparison of
//! robust cost functions for camera correspondence outliers", CRV 2015; G. Grisetti, R. Kuemmerle,
//! C. Stachniss, W. Burgard, "A tutorial on graph-based SLAM", IEEE Intelligent Transportation Systems
//! Magazine 2 (2010), section IV. What the equations hold stays. Time of an iteration: that of the sparse
//! factorisation.

use meetpoint_geometry::{Pose, wrap_angle};
use nalgebra::{Matrix3, Vector3};

use crate::graph::normal_equations::NormalEquations;

/// What [`Edge::chi2_turn`] falls by from one solution to the next, where edges that are far from what
/// the poses say are to be tightened step by step: of residuals, half. Graduated non-convexity: H. Yang,
/// P. Antonante, V. Tzoumas, L. Carlone, "Graduated non-convexity for robust spatial perception: from
/// non-minimal solvers to global outlier rejection", IEEE Robotics and Automation Letters 5 (2020),
/// section III.B, with the kernel of Geman and `McClure`.
pub(crate) const TIGHTENING: f64 = 4.0;

/// A constraint between two poses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Edge {
    /// Which pose it is seen from.
    pub(crate) from: usize,
    /// Which pose is seen. Invariant: not `from`.
    pub(crate) to: usize,
    /// Where it is seen.
    pub(crate) from_to: Pose,
    /// Information about the three numbers of `from_to`.
    pub(crate) information: Matrix3<f64>,
    /// The square c at which rho is half of its bound; infinite for an edge that cannot be wrong.
    pub(crate) chi2_turn: f64,
}

/// Tunables of [`optimised`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseGraphParams {
    /// Budget, in factorisations.
    pub n_iterations_max: u32,
    /// Done when F falls by less than this share.
    pub fall_min: f64,
}

/// What an optimisation found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Optimised {
    /// F before and after.
    pub(crate) cost_before: f64,
    pub(crate) cost_after: f64,
    /// The largest change of any of the poses' numbers in the last step, in metres or radians.
    pub(crate) step_last: f64,
}

/// Difference between an edge and two poses, and its derivatives by both.
struct Linear {
    error: Vector3<f64>,
    by_from: Matrix3<f64>,
    by_to: Matrix3<f64>,
}

impl Edge {
    /// e: the pose of `to` seen from `from`, less what the edge says.
    pub(crate) fn error(&self, from: Pose, to: Pose) -> Vector3<f64> {
        let seen = from.step_to(to);
        Vector3::new(
            seen.x_m - self.from_to.x_m,
            seen.y_m - self.from_to.y_m,
            wrap_angle(seen.theta_rad - self.from_to.theta_rad),
        )
    }

    /// Square of the error in units of its deviation.
    pub(crate) fn chi2(&self, from: Pose, to: Pose) -> f64 {
        let error = self.error(from, to);
        error.dot(&(self.information * error))
    }

    /// rho of a square.
    fn cost(&self, chi2: f64) -> f64 {
        if self.chi2_turn.is_finite() {
            chi2 * self.chi2_turn / (self.chi2_turn + chi2)
        } else {
            chi2
        }
    }

    /// Derivative of rho, in (0, 1].
    pub(crate) fn weight(&self, chi2: f64) -> f64 {
        if self.chi2_turn.is_finite() {
            (self.chi2_turn / (self.chi2_turn + chi2)).powi(2)
        } else {
            1.0
        }
    }

    fn linear(&self, from: Pose, to: Pose) -> Linear {
        let (sin, cos) = from.theta_rad.sin_cos();
        let (dx, dy) = (to.x_m - from.x_m, to.y_m - from.y_m);
        let by_from = Matrix3::new(
            -cos,
            -sin,
            -sin * dx + cos * dy,
            sin,
            -cos,
            -cos * dx - sin * dy,
            0.0,
            0.0,
            -1.0,
        );
        let by_to = Matrix3::new(cos, sin, 0.0, -sin, cos, 0.0, 0.0, 0.0, 1.0);
        Linear { error: self.error(from, to), by_from, by_to }
    }
}

/// F of the poses.
pub(crate) fn cost(poses: &[Pose], edges: &[Edge]) -> f64 {
    edges.iter().map(|edge| edge.cost(edge.chi2(poses[edge.from], poses[edge.to]))).sum()
}

/// Moves the poses to a minimum of F near where they are. `equations` are those of the edges
/// ([`NormalEquations::new`]); edges may have changed in anything but which poses they join.
pub(crate) fn optimise(
    poses: &mut Vec<Pose>,
    edges: &[Edge],
    equations: &mut NormalEquations,
    params: &PoseGraphParams,
) -> Optimised {
    let mut cost_now = cost(poses, edges);
    let mut optimised = Optimised { cost_before: cost_now, cost_after: cost_now, step_last: 0.0 };
    let mut damping = DAMPING_START;
    linearise(poses, edges, equations);
    for _ in 0..params.n_iterations_max {
        let Some(step) = equations.solution(damping) else {
            damping *= DAMPING_GROWTH;
            continue;
        };
        let there = stepped(poses, (equations.blocks(), &step));
        let cost_there = cost(&there, edges);
        // Not a number is no gain either.
        if cost_there.is_nan() || cost_now <= cost_there {
            damping *= DAMPING_GROWTH;
            if DAMPING_MAX < damping || step_size(&step) < STEP_MIN {
                break;
            }
            continue;
        }
        let fall = cost_now - cost_there;
        *poses = there;
        optimised.step_last = step_size(&step);
        cost_now = cost_there;
        damping = (damping * DAMPING_DECAY).max(DAMPING_MIN);
        if fall <= params.fall_min * cost_there {
            break;
        }
        linearise(poses, edges, equations);
    }
    optimised.cost_after = cost_now;
    optimised
}

/// Damping as a share of the diagonal: at the start, and how it changes with success and failure.
const DAMPING_START: f64 = 1e-6;
const DAMPING_MIN: f64 = 1e-9;
const DAMPING_MAX: f64 = 1e3;
const DAMPING_DECAY: f64 = 0.1;
const DAMPING_GROWTH: f64 = 30.0;

/// Steps shorter than this in metres and radians are none.
const STEP_MIN: f64 = 1e-6;

fn linearise(poses: &[Pose], edges: &[Edge], equations: &mut NormalEquations) {
    equations.clear();
    for (index, edge) in edges.iter().enumerate() {
        let Linear { error, by_from, by_to } = edge.linear(poses[edge.from], poses[edge.to]);
        let weight = edge.weight(error.dot(&(edge.information * error)));
        equations.add(index, &(edge.information * weight), &error, (&by_from, &by_to));
    }
}

/// The poses after a step of the free ones, whose blocks say where in it their three numbers stand.
fn stepped(poses: &[Pose], (blocks, step): (&[Option<usize>], &[f64])) -> Vec<Pose> {
    let moved = |(pose, block): (&Pose, &Option<usize>)| {
        let Some(block) = block else { return *pose };
        let step = &step[3 * block..3 * block + 3];
        Pose::new(pose.x_m + step[0], pose.y_m + step[1], pose.theta_rad + step[2])
    };
    poses.iter().zip(blocks).map(moved).collect()
}

fn step_size(step: &[f64]) -> f64 {
    step.iter().fold(0.0, |most, part| part.abs().max(most))
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};
    use proptest::prelude::*;

    use super::*;

    const PARAMS: PoseGraphParams = PoseGraphParams { n_iterations_max: 50, fall_min: 1e-12 };

    fn pose() -> impl Strategy<Value = Pose> {
        (-3.0_f64..3.0, -3.0_f64..3.0, -3.0_f64..3.0).prop_map(|(x, y, t)| Pose::new(x, y, t))
    }

    /// Poses, and edges between some of them that say nearly what the poses do.
    fn graph() -> impl Strategy<Value = (Vec<Pose>, Vec<Edge>)> {
        let error = (-0.1_f64..0.1, -0.1_f64..0.1, -0.1_f64..0.1);
        let edge = (0_usize..5, 0_usize..5, error, prop::option::of(1.0_f64..20.0));
        (prop::collection::vec(pose(), 5), prop::collection::vec(edge, 1..8)).prop_map(
            |(poses, pairs)| {
                let chain = (1..poses.len()).map(|to| (to - 1, to, (0.01, -0.02, 0.03), None));
                let pairs = chain.chain(pairs).filter(|(from, to, ..)| from != to);
                let edge = |(from, to, (x, y, t), turn): (usize, usize, _, Option<f64>)| {
                    let seen = poses[from].step_to(poses[to]);
                    Edge {
                        from,
                        to,
                        from_to: Pose::new(seen.x_m + x, seen.y_m + y, seen.theta_rad + t),
                        information: Matrix3::new(50.0, 5.0, 2.0, 5.0, 80.0, 1.0, 2.0, 1.0, 90.0),
                        chi2_turn: turn.unwrap_or(f64::INFINITY),
                    }
                };
                let edges = pairs.map(edge).collect();
                (poses, edges)
            },
        )
    }

    /// The definition: dense normal equations with derivatives by differences.
    fn reference(poses: &[Pose], edges: &[Edge], blocks: &[Option<usize>]) -> DVector<f64> {
        let n = 3 * blocks.iter().flatten().count();
        let (mut hessian, mut gradient) = (DMatrix::zeros(n, n), DVector::zeros(n));
        for edge in edges {
            let error = |at: &[Pose]| edge.error(at[edge.from], at[edge.to]);
            let here = error(poses);
            let mut by = DMatrix::zeros(3, n);
            for column in 0..n {
                let mut step = vec![0.0; n];
                step[column] = 1e-6;
                let ahead = error(&stepped(poses, (blocks, &step)));
                step[column] = -1e-6;
                let slope = (ahead - error(&stepped(poses, (blocks, &step)))) / 2e-6;
                by.column_mut(column).copy_from(&slope);
            }
            let weight = edge.weight(here.dot(&(edge.information * here)));
            hessian += by.transpose() * (edge.information * weight) * &by;
            gradient += by.transpose() * (edge.information * weight) * here;
        }
        hessian.lu().solve(&-gradient).expect("the chain joins all poses")
    }

    fn steps_as_defined(
        poses: &[Pose],
        edges: &[Edge],
        mut equations: NormalEquations,
    ) -> Result<(), TestCaseError> {
        linearise(poses, edges, &mut equations);
        let step = equations.solution(0.0).expect("positive definite");
        let expected = reference(poses, edges, equations.blocks());
        prop_assert_eq!(step.len(), expected.len());
        for (found, expected) in step.iter().zip(expected.iter()) {
            prop_assert!((found - expected).abs() < 1e-5, "{found} is not {expected}");
        }
        Ok(())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]

        #[test]
        fn steps_as_the_dense_definition((poses, edges) in graph(), also_held in 1_usize..5) {
            let held: Vec<bool> = (0..poses.len()).map(|i| i == 0 || i == also_held).collect();
            for equations in [
                NormalEquations::new(poses.len(), &edges),
                NormalEquations::holding(&held, &edges),
            ] {
                steps_as_defined(&poses, &edges, equations)?;
            }
        }

        #[test]
        fn never_makes_it_worse((poses, edges) in graph()) {
            let mut found = poses.clone();
            let mut equations = NormalEquations::new(poses.len(), &edges);
            let optimised = optimise(&mut found, &edges, &mut equations, &PARAMS);
            prop_assert!(optimised.cost_after <= optimised.cost_before, "{optimised:?}");
            prop_assert_eq!(found[0], poses[0], "the first pose stays");
            prop_assert!((cost(&found, &edges) - optimised.cost_after).abs() < 1e-9, "as told");
        }
    }

    #[test]
    fn one_false_closure_among_true_ones_is_not_believed() {
        let truth: Vec<Pose> = (0..12)
            .map(|i| {
                let (sin, cos) = (f64::from(i) * 0.5).sin_cos();
                Pose::new(5.0 * cos, 5.0 * sin, f64::from(i) * 0.5)
            })
            .collect();
        let edge = |from: usize, to: usize, chi2_turn| Edge {
            from,
            to,
            from_to: truth[from].step_to(truth[to]),
            information: Matrix3::identity() * 100.0,
            chi2_turn,
        };
        let mut edges: Vec<Edge> = (1..12).map(|to| edge(to - 1, to, f64::INFINITY)).collect();
        edges.extend([(0, 11), (1, 10), (2, 9)].map(|(from, to)| edge(from, to, 16.0)));
        let false_one = edge(3, 8, 16.0);
        edges.push(Edge { from_to: false_one.from_to * Pose::new(3.0, 0.0, 0.5), ..false_one });
        let mut poses: Vec<Pose> =
            truth.iter().map(|pose| *pose * Pose::new(0.1, -0.05, 0.02)).collect();
        poses[0] = truth[0];
        let mut equations = NormalEquations::new(poses.len(), &edges);
        optimise(&mut poses, &edges, &mut equations, &PARAMS);
        for (found, truth) in poses.iter().zip(&truth) {
            let error_m = truth.step_to(*found).distance_m();
            assert!(error_m < 0.03, "{error_m} m off");
        }
    }
}
