//! Many parts, of alignments two by two.

use meetpoint_geometry::Pose;
use meetpoint_merging::{PairAlignment, PairFate, placed};
use proptest::prelude::*;

fn pair(a: usize, b: usize, a_from_b: Pose, log_odds: f64) -> PairAlignment {
    let variance = [0.05 * 0.05, 0.05 * 0.05, 0.01 * 0.01];
    let covariance = std::array::from_fn(|row| {
        std::array::from_fn(|column| if row == column { variance[row] } else { 0.0 })
    });
    PairAlignment { a, b, a_from_b, covariance, log_odds }
}

fn poses(n: usize) -> impl Strategy<Value = Vec<Pose>> {
    let pose = (-30.0_f64..30.0, -30.0_f64..30.0, -3.0_f64..3.0);
    prop::collection::vec(pose.prop_map(|(x, y, t)| Pose::new(x, y, t)), n)
}

/// Alignments of some parts as they truly lie, between those that are asked for.
fn true_pairs(parts: &[Pose], between: &[(usize, usize)]) -> Vec<PairAlignment> {
    let alignment = |(index, &(a, b)): (usize, &(usize, usize))| {
        pair(a, b, parts[a].step_to(parts[b]), 30.0 + index as f64)
    };
    between.iter().enumerate().map(alignment).collect()
}

fn near(a: Pose, b: Pose) -> bool {
    let step = a.step_to(b);
    step.distance_m() < 1e-6 && step.theta_rad.abs() < 1e-6
}

proptest! {
    /// In whatever order alignments come, and whichever way round, parts lie where they truly do.
    #[test]
    fn order_does_not_matter(
        parts in poses(5),
        order in Just(vec![(0, 1), (1, 2), (2, 0), (3, 1), (4, 3), (4, 0)]).prop_shuffle(),
        turned in prop::collection::vec(any::<bool>(), 6),
    ) {
        let between: Vec<(usize, usize)> = order
            .iter()
            .zip(turned)
            .map(|(&(a, b), turned)| if turned { (b, a) } else { (a, b) })
            .collect();
        let placement = placed(5, &true_pairs(&parts, &between));
        for (part, &(root, pose)) in placement.parts.iter().enumerate() {
            prop_assert_eq!(root, 0, "all hang together");
            prop_assert!(near(pose, parts[0].step_to(parts[part])), "part {} at {:?}", part, pose);
        }
        let is_believed = |fate: &PairFate| !matches!(fate, PairFate::Inconsistent { .. });
        prop_assert!(placement.pairs.iter().all(is_believed), "{:?}", placement.pairs);
    }

    /// A ring that does not close loses its weakest alignment, wherever that stands.
    #[test]
    fn the_weakest_of_a_wrong_ring_is_not_believed(parts in poses(3), wrong in 0_usize..3) {
        let mut pairs = true_pairs(&parts, &[(0, 1), (1, 2), (2, 0)]);
        pairs[wrong].log_odds = 20.0;
        // Parts lie up to 85 m apart, and three headings are each unsure by 0.01 rad: a ring may stay open
        // by 7 m, five deviations.
        pairs[wrong].a_from_b = pairs[wrong].a_from_b * Pose::new(15.0, 0.0, 0.0);
        let placement = placed(3, &pairs);
        for (index, fate) in placement.pairs.iter().enumerate() {
            let is_wrong = matches!(fate, PairFate::Inconsistent { error_m, .. } if 1.0 < *error_m);
            prop_assert_eq!(is_wrong, index == wrong, "{}: {:?}", index, fate);
        }
        prop_assert!(near(placement.parts[2].1, parts[0].step_to(parts[2])), "{:?}", placement);
    }
}

#[test]
fn parts_without_alignments_stay_in_their_frames() {
    let pairs = [pair(1, 3, Pose::new(1.0, 0.0, 0.5), 30.0), pair(2, 2, Pose::IDENTITY, 30.0)];
    let placement = placed(4, &pairs);
    assert_eq!(placement.parts[0], (0, Pose::IDENTITY), "alone");
    assert_eq!(placement.parts[3].0, 1, "with the part of the least number");
    assert!(near(placement.parts[3].1, Pose::new(1.0, 0.0, 0.5)), "{placement:?}");
    assert_eq!(placement.pairs[0], PairFate::Places, "joins two");
    let is_out = matches!(placement.pairs[1], PairFate::Inconsistent { .. });
    assert!(is_out, "a part has no place in itself");
    assert_eq!(placed(0, &pairs).parts, [], "nothing");
}
