//! One placement of any number of parts, of alignments two by two.
//!
//! The alignments are taken in the order of their odds, whatever order they are given in: one that joins
//! two groups of parts places them; one that closes a ring is asked whether it says the same as those
//! that did, and where it does not, the weakest of the ring is no longer believed. So the alignments of a
//! maximum spanning tree place the parts, and rings check it: A to B to C to A.

use std::collections::{BTreeMap, VecDeque};

use meetpoint_geometry::Pose;
use nalgebra::{Matrix3, Vector3};

/// An alignment of two parts, for placing all.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairAlignment {
    /// The one part, by its number.
    pub a: usize,
    /// The other.
    pub b: usize,
    /// The other's frame seen from the one's.
    pub a_from_b: Pose,
    /// Covariance of `a_from_b` in the frame of `a`: x, y in metres, theta in radians.
    pub covariance: [[f64; 3]; 3],
    /// Logarithm of its odds against no overlap: which are believed first.
    pub log_odds: f64,
}

/// What became of an alignment of two parts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PairFate {
    /// Parts are placed by it.
    Places,
    /// The others say the same, so far off: metres and radians.
    Confirms {
        /// At the origin of `b`, in metres.
        error_m: f64,
        /// In radians, not negative.
        error_rad: f64,
    },
    /// The others say something else, and it is the weakest of its ring: it is not to be merged by.
    Inconsistent {
        /// At the origin of `b`, in metres.
        error_m: f64,
        /// In radians, not negative.
        error_rad: f64,
    },
}

/// Where parts lie.
#[derive(Clone, Debug, PartialEq)]
pub struct Placement {
    /// For each part its frame seen from the part with the least number of those that it hangs
    /// together with; that number says which.
    pub parts: Vec<(usize, Pose)>,
    /// For each alignment, in the order given, what became of it.
    pub pairs: Vec<PairFate>,
}

/// Square of the difference, in units of its deviations, from which a ring is inconsistent: one of a
/// hundred thousand true ones of three degrees of freedom.
const RING_CHI2_MAX: f64 = 25.0;

/// The placement of `n_parts` parts. Alignments of parts that there are not, of a part with itself, or
/// that are not finite, are inconsistent. Independent of the order of the alignments, but for rounding
/// and two alignments of the same parts with the same odds.
pub fn placed(n_parts: usize, pairs: &[PairAlignment]) -> Placement {
    let usable = |pair: &PairAlignment| {
        pair.a != pair.b && pair.a.max(pair.b) < n_parts && pair.a_from_b.is_finite()
    };
    let mut order: Vec<usize> = (0..pairs.len()).filter(|&index| usable(&pairs[index])).collect();
    let rank = |index: usize| {
        let PairAlignment { a, b, log_odds, .. } = pairs[index];
        (log_odds, (a.min(b), a.max(b)))
    };
    order.sort_by(|&a, &b| {
        let ((odds, parts), (other_odds, other_parts)) = (rank(a), rank(b));
        other_odds.total_cmp(&odds).then(parts.cmp(&other_parts))
    });
    let nowhere = PairFate::Inconsistent { error_m: f64::INFINITY, error_rad: f64::INFINITY };
    let mut fates = vec![nowhere; pairs.len()];
    let mut tree: BTreeMap<usize, Vec<(usize, Link)>> = BTreeMap::new();
    for index in order {
        let pair = &pairs[index];
        let link = Link {
            pose: pair.a_from_b,
            covariance: Matrix3::from_fn(|row, column| pair.covariance[row][column]),
        };
        match way(&tree, pair.a, pair.b) {
            None => {
                tree.entry(pair.a).or_default().push((pair.b, link));
                tree.entry(pair.b).or_default().push((pair.a, link.inverse()));
                fates[index] = PairFate::Places;
            }
            Some(around) => fates[index] = ring(&around, &link),
        }
    }
    let from = |part: usize| {
        let root = (0..=part).find_map(|root| Some((root, way(&tree, root, part)?.pose)));
        root.unwrap_or((part, Pose::IDENTITY))
    };
    Placement { parts: (0..n_parts).map(from).collect(), pairs: fates }
}

/// A transform with its covariance in the frame that it leads to.
#[derive(Clone, Copy, Debug)]
struct Link {
    pose: Pose,
    covariance: Matrix3<f64>,
}

impl Link {
    const NONE: Self = Self {
        pose: Pose::IDENTITY,
        covariance: Matrix3::from_array_storage(nalgebra::ArrayStorage([[0.0; 3]; 3])),
    };

    /// To first order.
    fn then(&self, next: &Self) -> Self {
        let (sin, cos) = self.pose.theta_rad.sin_cos();
        let arm = (self.pose * next.pose).position() - self.pose.position();
        let by_own = Matrix3::new(1.0, 0.0, -arm.y, 0.0, 1.0, arm.x, 0.0, 0.0, 1.0);
        let turn = Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
        Self {
            pose: self.pose * next.pose,
            covariance: by_own * self.covariance * by_own.transpose()
                + turn * next.covariance * turn.transpose(),
        }
    }

    fn inverse(&self) -> Self {
        let pose = self.pose.inverse();
        let (sin, cos) = pose.theta_rad.sin_cos();
        let position = pose.position();
        let turn = Matrix3::new(cos, -sin, position.y, sin, cos, -position.x, 0.0, 0.0, 1.0);
        Self { pose, covariance: turn * self.covariance * turn.transpose() }
    }
}

/// The way from one part to another along a tree, if there is one.
fn way(tree: &BTreeMap<usize, Vec<(usize, Link)>>, from: usize, to: usize) -> Option<Link> {
    let mut reached = BTreeMap::from([(from, Link::NONE)]);
    let mut queue = VecDeque::from([from]);
    while let Some(part) = queue.pop_front() {
        let here = reached[&part];
        if part == to {
            return Some(here);
        }
        for (next, link) in tree.get(&part).into_iter().flatten() {
            if !reached.contains_key(next) {
                reached.insert(*next, here.then(link));
                queue.push_back(*next);
            }
        }
    }
    None
}

/// Whether an alignment says what the way around does.
fn ring(around: &Link, link: &Link) -> PairFate {
    let error = around.pose.step_to(link.pose);
    let (error_m, error_rad) = (error.distance_m(), error.theta_rad.abs());
    let turn_rad = meetpoint_geometry::angle_between(around.pose.theta_rad, link.pose.theta_rad);
    let away = link.pose.position() - around.pose.position();
    let away = Vector3::new(away.x, away.y, turn_rad);
    let information = (around.covariance + link.covariance).try_inverse();
    let chi2 = information.map_or(f64::INFINITY, |information| away.dot(&(information * away)));
    if chi2 <= RING_CHI2_MAX {
        PairFate::Confirms { error_m, error_rad }
    } else {
        PairFate::Inconsistent { error_m, error_rad }
    }
}
