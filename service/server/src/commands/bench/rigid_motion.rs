//! The rotation and shift that take points nearest to others: K. S. Arun, T. S. Huang and S. D.
//! Blostein, "Least-squares fitting of two 3-D point sets", IEEE Transactions on Pattern Analysis
//! and Machine Intelligence 9 (1987), in the plane.

use meetpoint_geometry::{Point2, Pose};

/// The pose that takes points nearest to those that they are paired with: `to = pose * from`. The
/// identity without a pair, a shift for one.
pub(super) fn rigid_motion(pairs: &[(Point2<f64>, Point2<f64>)]) -> Pose {
    let n = pairs.len().max(1) as f64;
    let mut centers = (Point2::origin(), Point2::origin());
    for (from, to) in pairs {
        centers.0 += from.coords / n;
        centers.1 += to.coords / n;
    }
    let (mut dot, mut cross) = (0.0, 0.0);
    for (from, to) in pairs {
        let (from, to) = (from - centers.0, to - centers.1);
        dot += from.dot(&to);
        cross += from.perp(&to);
    }
    let turn = Pose::new(0.0, 0.0, f64::atan2(cross, dot));
    let shift = centers.1 - turn * centers.0;
    Pose::new(shift.x, shift.y, turn.theta_rad)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn a_motion_is_found_again(
            points in prop::collection::vec((-50.0..50.0_f64, -50.0..50.0_f64), 2..20),
            x_m in -50.0..50.0_f64, y_m in -50.0..50.0_f64, theta_rad in -3.0..3.0_f64,
        ) {
            let motion = Pose::new(x_m, y_m, theta_rad);
            let pairs: Vec<_> = points
                .iter()
                .map(|&(x, y)| (Point2::new(x, y), motion * Point2::new(x, y)))
                .collect();
            let found = rigid_motion(&pairs);
            for (from, to) in &pairs {
                prop_assert!((found * *from - to).norm() < 1e-6, "{found:?}");
            }
        }
    }

    #[test]
    fn few_pairs_do_no_harm() {
        assert_eq!(rigid_motion(&[]), Pose::IDENTITY, "nothing to go by");
        let one = rigid_motion(&[(Point2::new(1.0, 2.0), Point2::new(3.0, 5.0))]);
        assert_eq!(one, Pose::new(2.0, 3.0, 0.0), "a shift");
    }
}
