//! How uncertain it is where one pose lies seen from another, along the surest way through a graph.
//!
//! Covariances of relative poses are composed along edges (R. Smith, M. Self, P. Cheeseman,
//! "Estimating uncertain spatial relationships in robotics", 1990). The covariance along any one way
//! bounds that of the whole graph from above; the surest way is found by Dijkstra's algorithm: M. Bosse
//! et al., "Simultaneous localization and map building in large-scale cyclic environments using the
//! Atlas framework", International Journal of Robotics Research 23 (2004), section 3.3. Time
//! O(edges log edges).

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use meetpoint_geometry::Pose;
use nalgebra::Matrix3;

/// Which other node an edge leads to, and the covariance of its pose seen from here.
pub(crate) type Link = (usize, Matrix3<f64>);

/// Metres that a radian counts as when ways are compared: as far as lasers mostly see.
const LEVER_M: f64 = 5.0;

/// A way that ends at a node.
struct Way {
    size_m2: f64,
    node: usize,
    covariance: Matrix3<f64>,
}

impl PartialEq for Way {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Way {}

impl PartialOrd for Way {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Way {
    /// The surest is the greatest, as a heap wants it.
    fn cmp(&self, other: &Self) -> Ordering {
        other.size_m2.total_cmp(&self.size_m2).then(other.node.cmp(&self.node))
    }
}

/// Covariance of every node's pose seen from `start`, along the surest way; `None` where none leads.
pub(crate) fn covariances_from(
    start: usize,
    poses: &[Pose],
    links: &[Vec<Link>],
) -> Vec<Option<Matrix3<f64>>> {
    let mut found = vec![None; poses.len()];
    let mut open = BinaryHeap::new();
    open.push(Way { size_m2: 0.0, node: start, covariance: Matrix3::zeros() });
    while let Some(Way { node, covariance, .. }) = open.pop() {
        if found[node].is_some() {
            continue;
        }
        found[node] = Some(covariance);
        let here = poses[start].step_to(poses[node]);
        for &(next, ref by_link) in &links[node] {
            if found[next].is_none() {
                let step = poses[node].step_to(poses[next]);
                let covariance = composed((here, &covariance), (step, by_link));
                open.push(Way { size_m2: size_m2(&covariance), node: next, covariance });
            }
        }
    }
    found
}

fn size_m2(covariance: &Matrix3<f64>) -> f64 {
    covariance[(0, 0)] + covariance[(1, 1)] + LEVER_M * LEVER_M * covariance[(2, 2)]
}

/// Covariance of `first * then`, whose errors are independent.
pub(crate) fn composed(
    (first, by_first): (Pose, &Matrix3<f64>),
    (then, by_then): (Pose, &Matrix3<f64>),
) -> Matrix3<f64> {
    let (sin, cos) = first.theta_rad.sin_cos();
    let (x, y) = (cos * then.x_m - sin * then.y_m, sin * then.x_m + cos * then.y_m);
    let arm = Matrix3::new(1.0, 0.0, -y, 0.0, 1.0, x, 0.0, 0.0, 1.0);
    let turn = Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
    arm * by_first * arm.transpose() + turn * by_then * turn.transpose()
}

/// Covariance of the way back.
pub(crate) fn inverted(there: Pose, covariance: &Matrix3<f64>) -> Matrix3<f64> {
    let (sin, cos) = there.theta_rad.sin_cos();
    let back = there.inverse();
    let by = Matrix3::new(-cos, -sin, back.y_m, sin, -cos, -back.x_m, 0.0, 0.0, -1.0);
    by * covariance * by.transpose()
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;
    use proptest::prelude::*;

    use super::*;

    const COVARIANCE: Matrix3<f64> =
        Matrix3::new(0.04, 0.01, 0.002, 0.01, 0.09, 0.003, 0.002, 0.003, 0.01);

    fn pose() -> impl Strategy<Value = Pose> {
        (-3.0_f64..3.0, -3.0_f64..3.0, -1.5_f64..1.5).prop_map(|(x, y, t)| Pose::new(x, y, t))
    }

    fn numbers(pose: Pose) -> Vector3<f64> {
        Vector3::new(pose.x_m, pose.y_m, pose.theta_rad)
    }

    /// J C J' with the derivative by differences.
    fn carried(of: impl Fn(Pose) -> Pose, at: Pose, covariance: &Matrix3<f64>) -> Matrix3<f64> {
        let column = |index: usize| {
            let mut step = Vector3::zeros();
            step[index] = 1e-6;
            let there = |s: Vector3<f64>| Pose::new(at.x_m + s.x, at.y_m + s.y, at.theta_rad + s.z);
            (numbers(of(there(step))) - numbers(of(there(-step)))) / 2e-6
        };
        let by = Matrix3::from_columns(&[column(0), column(1), column(2)]);
        by * covariance * by.transpose()
    }

    proptest! {
        #[test]
        fn carries_as_the_derivative_does(first in pose(), then in pose()) {
            let found = composed((first, &COVARIANCE), (then, &(COVARIANCE * 2.0)));
            let expected = carried(|first| first * then, first, &COVARIANCE)
                + carried(|then| first * then, then, &(COVARIANCE * 2.0));
            prop_assert!((found - expected).amax() < 1e-6, "{found} is not {expected}");
            let back = inverted(first, &COVARIANCE);
            let expected = carried(Pose::inverse, first, &COVARIANCE);
            prop_assert!((back - expected).amax() < 1e-6, "{back} is not {expected}");
        }
    }

    #[test]
    fn goes_the_surest_way() {
        let poses: Vec<Pose> = (0..4).map(|i| Pose::new(f64::from(i), 0.0, 0.0)).collect();
        let sure = Matrix3::identity() * 1e-4;
        let mut links = vec![Vec::new(); 4];
        let mut link = |a: usize, b: usize, covariance: Matrix3<f64>| {
            links[a].push((b, covariance));
            links[b].push((a, covariance));
        };
        link(0, 1, sure);
        link(1, 2, sure);
        link(0, 2, Matrix3::identity());
        let found = covariances_from(0, &poses, &links);
        let there = found[2].expect("a way leads there");
        assert!((there[(0, 0)] - 2e-4).abs() < 1e-12, "by way of the second: {there}");
        assert!(found[3].is_none(), "no way leads there");
    }
}
