//! Placements that are worth a look: two landmarks of the one map that are as far apart as two of the
//! other say where the other lies, and the placement on which most pairs agree is the most promising.
//! After the pose clustering of G. Stockman, "Object recognition and localization via pose
//! clustering", Computer Vision, Graphics, and Image Processing 40 (1987). Time: pairs of the one
//! times those of the other that are as long.

use std::collections::BTreeMap;

use meetpoint_geometry::{Point2, Pose, wrap_angle};
use nalgebra::Vector2;

use crate::alignment_fit::Judge;
use crate::constellation::Star;

/// Pairs nearer than this tell no direction, in standard deviations of a place.
const APART_MIN_STD: f64 = 5.0;
/// Distances that differ by more than this many standard deviations do not agree.
const N_STD: f64 = 3.0;
/// Pairs of the newcomer that vote, at most; of more the nearest of each landmark.
const N_PAIRS_MAX: usize = 2_000;
/// Votes that are counted, at most: some hundred megabytes are not to be asked for from outside.
const N_VOTES_MAX: usize = 3_000_000;
/// Sides of a bin of votes, in standard deviations of a place, and in radians.
const BIN_STD: f64 = 4.0;
const BIN_RAD: f64 = 0.15;

/// Two landmarks with what lies between them.
struct Pair {
    stars: [usize; 2],
    apart_m: f64,
}

/// Votes for about one placement.
#[derive(Default)]
struct Bin {
    n: u32,
    center: Vector2<f64>,
    turn: Vector2<f64>,
}

/// Placements with most votes first.
pub(crate) fn candidates(judge: &Judge<'_>) -> Vec<Pose> {
    let (site, other) = (&judge.site.stars, &judge.other.stars);
    let std_m = judge.place_std_m();
    let mut of_site = pairs(site, APART_MIN_STD * std_m);
    of_site.sort_by(|a, b| a.apart_m.total_cmp(&b.apart_m));
    let of_other = thinned(pairs(other, APART_MIN_STD * std_m));
    let center = center_of(other);
    let tolerance_m = N_STD * 2.0_f64.sqrt() * std_m;
    let mut bins: BTreeMap<[i64; 3], Bin> = BTreeMap::new();
    let mut n_votes = 0;
    for pair in &of_other {
        let first = of_site.partition_point(|it| it.apart_m < pair.apart_m - tolerance_m);
        let near =
            of_site[first..].iter().take_while(|it| it.apart_m <= pair.apart_m + tolerance_m);
        for of_site in near {
            for ends in [of_site.stars, [of_site.stars[1], of_site.stars[0]]] {
                let is_alike = |end: usize| site[ends[end]].kind == other[pair.stars[end]].kind;
                if !is_alike(0) || !is_alike(1) || N_VOTES_MAX <= n_votes {
                    continue;
                }
                n_votes += 1;
                let to = ends.map(|end| site[end].position);
                let from = pair.stars.map(|end| other[end].position);
                let placed = placement(from, to);
                let bin = bins.entry(bin_of(placed, center, std_m)).or_default();
                let (sin, cos) = placed.theta_rad.sin_cos();
                bin.n += 1;
                bin.center += (placed * center).coords;
                bin.turn += Vector2::new(cos, sin);
            }
        }
    }
    let mut bins: Vec<Bin> = bins.into_values().collect();
    bins.sort_by_key(|bin| std::cmp::Reverse(bin.n));
    bins.truncate(judge.params.n_candidates_max);
    bins.iter().map(|bin| bin.mean(center)).collect()
}

impl Bin {
    fn mean(&self, center: Point2<f64>) -> Pose {
        let turn = Pose::new(0.0, 0.0, self.turn.y.atan2(self.turn.x));
        let at = self.center / f64::from(self.n.max(1)) - (turn * center).coords;
        Pose::new(at.x, at.y, turn.theta_rad)
    }
}

/// The placement that takes two places to two others, as far as it can.
fn placement(from: [Point2<f64>; 2], to: [Point2<f64>; 2]) -> Pose {
    let (a, b) = (from[1] - from[0], to[1] - to[0]);
    let turn = Pose::new(0.0, 0.0, wrap_angle(b.y.atan2(b.x) - a.y.atan2(a.x)));
    let middle = |ends: [Point2<f64>; 2]| nalgebra::center(&ends[0], &ends[1]);
    let shift = middle(to) - turn * middle(from);
    Pose::new(shift.x, shift.y, turn.theta_rad)
}

#[expect(clippy::cast_possible_truncation, reason = "saturates far outside of any map")]
fn bin_of(placed: Pose, center: Point2<f64>, std_m: f64) -> [i64; 3] {
    let at = placed * center;
    let side_m = BIN_STD * std_m;
    [at.x / side_m, at.y / side_m, placed.theta_rad / BIN_RAD].map(|number| number.round() as i64)
}

fn center_of(stars: &[Star]) -> Point2<f64> {
    let sum = stars.iter().fold(Vector2::zeros(), |sum, star| sum + star.position.coords);
    Point2::from(sum / stars.len().max(1) as f64)
}

/// All pairs at least so far apart.
fn pairs(stars: &[Star], apart_min_m: f64) -> Vec<Pair> {
    let mut pairs = Vec::new();
    for (second, star) in stars.iter().enumerate() {
        for (first, other) in stars[..second].iter().enumerate() {
            let apart_m = (star.position - other.position).norm();
            if apart_min_m <= apart_m {
                pairs.push(Pair { stars: [first, second], apart_m });
            }
        }
    }
    pairs
}

/// Of too many the shortest: neighbours have been seen together.
fn thinned(mut pairs: Vec<Pair>) -> Vec<Pair> {
    if N_PAIRS_MAX < pairs.len() {
        pairs.sort_by(|a, b| a.apart_m.total_cmp(&b.apart_m));
        pairs.truncate(N_PAIRS_MAX);
    }
    pairs
}
