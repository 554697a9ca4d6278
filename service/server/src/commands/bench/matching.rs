//! Which landmark found is which true one, when nothing but places is known.
//!
//! Every two places found may be any two true ones as far apart; of the rigid motions that follow
//! the one counts that takes most places near true ones. Time O(n⁵) for n landmarks, and few of
//! these are as far apart.

use meetpoint_geometry::{Point2, Pose};

use super::rigid_motion::rigid_motion;

/// A place found is of a true landmark if it comes this near, in metres; the nearest two of MRCLAM
/// are half as far apart, and the nearer pair counts.
const NEAR_M: f64 = 0.4;
/// Two places that are nearer tell no direction, in metres.
const APART_MIN_M: f64 = 1.0;
/// Places that motions are made from: the first ones.
const N_MOTIONS_FROM: usize = 15;
/// Fits of all pairs after the first.
const N_REFITS: usize = 3;

/// Pairs of indices, found and true, each in one pair at most. Places that are surest come first
/// in `found`.
pub(super) fn matched(found: &[Point2<f64>], truth: &[Point2<f64>]) -> Vec<(usize, usize)> {
    let mut best: Vec<(usize, usize)> = Vec::new();
    let n_from = found.len().min(N_MOTIONS_FROM);
    for (a, b) in ordered_pairs(n_from) {
        let apart_m = (found[a] - found[b]).norm();
        for (true_a, true_b) in ordered_pairs(truth.len()) {
            let true_apart_m = (truth[true_a] - truth[true_b]).norm();
            if apart_m < APART_MIN_M || NEAR_M < (apart_m - true_apart_m).abs() {
                continue;
            }
            let motion = rigid_motion(&[(found[a], truth[true_a]), (found[b], truth[true_b])]);
            let pairs = refitted(motion, found, truth);
            if best.len() < pairs.len() {
                best = pairs;
            }
        }
    }
    best
}

fn ordered_pairs(n: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..n).flat_map(move |a| (0..n).filter(move |&b| b != a).map(move |b| (a, b)))
}

fn refitted(motion: Pose, found: &[Point2<f64>], truth: &[Point2<f64>]) -> Vec<(usize, usize)> {
    let mut pairs = near(motion, found, truth);
    for _ in 0..N_REFITS {
        let places: Vec<_> = pairs.iter().map(|&(a, b)| (found[a], truth[b])).collect();
        pairs = near(rigid_motion(&places), found, truth);
    }
    pairs
}

/// Nearest pairs first.
fn near(motion: Pose, found: &[Point2<f64>], truth: &[Point2<f64>]) -> Vec<(usize, usize)> {
    let mut near = Vec::new();
    for (index, &place) in found.iter().enumerate() {
        for (true_index, &true_place) in truth.iter().enumerate() {
            let off_m = (motion * place - true_place).norm();
            if off_m < NEAR_M {
                near.push((off_m, index, true_index));
            }
        }
    }
    near.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut pairs: Vec<(usize, usize)> = Vec::new();
    for (_, index, true_index) in near {
        if !pairs.iter().any(|&(a, b)| a == index || b == true_index) {
            pairs.push((index, true_index));
        }
    }
    pairs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turned_shifted_and_with_a_stranger() {
        let truth = [(0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (1.0, 5.0), (7.0, -2.0)];
        let truth = truth.map(|(x, y)| Point2::new(x, y));
        let found_from_truth = Pose::new(3.0, -1.0, 2.2);
        let mut found = [3, 1, 4, 0].map(|index| found_from_truth * truth[index]).to_vec();
        found.push(Point2::new(50.0, 50.0));
        found[1].x += 0.05;
        let mut pairs = matched(&found, &truth);
        pairs.sort_unstable();
        assert_eq!(pairs, [(0, 3), (1, 1), (2, 4), (3, 0)], "the stranger is nobody");
        assert_eq!(matched(&[], &truth), [], "nothing found");
    }
}
