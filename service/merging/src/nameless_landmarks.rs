//! What landmarks without names say of one map's lying on another.
//!
//! Doors, corners, poles: those of a type look alike, so that it is summed over which of one map is which of
//! the other, in the spirit of TBF98 section 8:
//!
//! ```text
//! l = ln sum over assignments A of
//!         product over pairs (i, j) of A   SEEN N(distance; variance) / density
//!         product over all others          ALONE where the other map has looked, 1 where it has not
//! ```
//!
//! the logarithm of the odds between "the same place" and "two places that have nothing to do with one
//! another", of a Poisson process of landmarks that each map has found a share SEEN of, among false ones. What
//! the area that both have looked at adds besides is left out: it is never against a place.
//!
//! Pairs farther apart than some deviations count nothing, so that the sum falls apart into small
//! ones, over which it is a product; each of these is done over the subsets of its smaller side. Time
//! O(landmarks² + landmarks 2^side), space O(2^side).

use std::f64::consts::TAU;

use meetpoint_geometry::{Point2, Pose};

use crate::named_landmarks::BEND_STD_M;
use crate::part::Part;

/// A landmark without a name, as a map has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NamelessLandmark {
    /// Its type, by a number that is the same in all maps.
    pub landmark_type: u32,
    /// Where it is, in metres in the frame of the map.
    pub at: Point2<f64>,
    /// Variance of each coordinate, in square metres.
    pub variance_m2: f64,
}

/// What all of them together say of a place.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct NamelessTestimony {
    /// Logarithm of the odds; 0 if nothing is said.
    pub(crate) log_odds: f64,
    /// Landmarks of the newcomer that lie where the site has one of their type.
    pub(crate) n_agreeing: usize,
    /// Landmarks of either map where the other has looked and has none.
    pub(crate) n_alone: usize,
}

/// Share of the landmarks where a detector has looked that are in its map.
const SEEN: f64 = 0.8;
/// Share of the landmarks of a map that are none: people, shadows, one taken for two.
const FALSE: f64 = 0.05;
/// The odds of a landmark that the other map does not have though it has looked: missed there, or false here.
const ALONE: f64 = (1.0 - SEEN) * (1.0 - FALSE) + FALSE;
/// Landmarks farther apart than this many deviations are two: the density there is 1e-8 of its peak.
const DEVIATIONS_MAX: f64 = 6.0;
/// A landmark has one of its type where it lies within this many deviations.
const AGREES_DEVIATIONS_MAX: f64 = 3.0;
/// Landmarks of the smaller side of what hangs together, at most, that are summed over: a quarter of a
/// million of terms. In more, which are metres of landmarks decimetres apart, pairs that are not the
/// nearest of both are left out, so that the sum is told too small.
const N_SIDE_MAX: usize = 10;
/// Area of which the density is told, at least, in square metres: a hall.
const AREA_MIN_M2: f64 = 100.0;

/// Odds of pairs, by newcomer's and site's index, among what counts.
struct Pair {
    newcomer: usize,
    site: usize,
    odds: f64,
    deviations: f64,
}

impl NamelessTestimony {
    pub(crate) fn new((site, newcomer): (&Part, &Part), site_from_newcomer: Pose) -> Self {
        let (of_site, of_newcomer) = (&site.nameless[..], &newcomer.nameless[..]);
        if of_site.is_empty() || of_newcomer.is_empty() {
            // A robot that tells none of a type says nothing by that.
            return Self::default();
        }
        let newcomer_from_site = site_from_newcomer.inverse();
        let alone = [
            alone(of_newcomer, site, site_from_newcomer),
            alone(of_site, newcomer, newcomer_from_site),
        ];
        let pairs = pairs((site, newcomer), site_from_newcomer);
        let is_met = |of_newcomer: bool, index: usize| {
            pairs.iter().any(|pair| {
                let own = if of_newcomer { pair.newcomer } else { pair.site };
                own == index && pair.deviations <= AGREES_DEVIATIONS_MAX
            })
        };
        let n_alone = |side: usize| {
            let looked = alone[side].iter().enumerate().filter(|(_, odds)| **odds < 1.0);
            looked.filter(|(index, _)| !is_met(side == 0, *index)).count()
        };
        Self {
            log_odds: log_sum(&pairs, &alone),
            n_agreeing: (0..of_newcomer.len()).filter(|&index| is_met(true, index)).count(),
            n_alone: n_alone(0) + n_alone(1),
        }
    }
}

/// By landmark: its odds if the other map has none of it.
fn alone(own: &[NamelessLandmark], other: &Part, other_from_own: Pose) -> Vec<f64> {
    let tells = |landmark_type| other.nameless.iter().any(|it| it.landmark_type == landmark_type);
    let odds = own.iter().map(|it| {
        let is_looked_for =
            tells(it.landmark_type) && other.looked.has_seen(other_from_own * it.at);
        if is_looked_for { ALONE } else { 1.0 }
    });
    odds.collect()
}

/// Landmarks of a type near each other.
fn pairs((site, newcomer): (&Part, &Part), site_from_newcomer: Pose) -> Vec<Pair> {
    let area_m2 = (site.known_m2() + newcomer.known_m2()).max(AREA_MIN_M2);
    let all = || site.nameless.iter().chain(&newcomer.nameless);
    let mut pairs = Vec::new();
    for (index, own) in newcomer.nameless.iter().enumerate() {
        let n = all().filter(|it| it.landmark_type == own.landmark_type).count();
        let density_per_m2 = n as f64 / area_m2;
        let at = site_from_newcomer * own.at;
        for (of_site, other) in site.nameless.iter().enumerate() {
            let variance_m2 = own.variance_m2 + other.variance_m2 + BEND_STD_M * BEND_STD_M;
            let deviations = (at - other.at).norm() / variance_m2.sqrt();
            if own.landmark_type == other.landmark_type && deviations <= DEVIATIONS_MAX {
                let density = (-0.5 * deviations * deviations).exp() / (TAU * variance_m2);
                let odds = SEEN * density / density_per_m2;
                pairs.push(Pair { newcomer: index, site: of_site, odds, deviations });
            }
        }
    }
    pairs
}

/// Logarithm of the sum over all assignments, given what landmarks of either side are worth alone.
fn log_sum(pairs: &[Pair], alone: &[Vec<f64>; 2]) -> f64 {
    let of_alone: f64 = alone.iter().flatten().map(|odds| odds.ln()).sum();
    // Relative to all being alone.
    let lead = |pair: &Pair| pair.odds / (alone[0][pair.newcomer] * alone[1][pair.site]);
    let sums = hanging_together(pairs).into_iter().map(|group| {
        let mut edges: Vec<(usize, usize, f64)> =
            group.iter().map(|pair| (pair.newcomer, pair.site, lead(pair))).collect();
        if N_SIDE_MAX < n_different(edges.iter().map(|edge| edge.0))
            && N_SIDE_MAX < n_different(edges.iter().map(|edge| edge.1))
        {
            let nearest = |pair: &&&Pair| {
                let rivals =
                    group.iter().filter(|it| it.newcomer == pair.newcomer || it.site == pair.site);
                rivals.map(|it| it.deviations).fold(f64::INFINITY, f64::min) == pair.deviations
            };
            let kept = group.iter().filter(nearest);
            let singly = kept.map(|pair| (1.0 + lead(pair)).ln());
            return singly.sum();
        }
        if n_different(edges.iter().map(|edge| edge.0))
            < n_different(edges.iter().map(|edge| edge.1))
        {
            for edge in &mut edges {
                *edge = (edge.1, edge.0, edge.2);
            }
        }
        matchings(&edges).ln()
    });
    of_alone + sums.sum::<f64>()
}

/// Pairs by what hangs together by landmarks that they share.
fn hanging_together(pairs: &[Pair]) -> Vec<Vec<&Pair>> {
    let mut groups: Vec<Vec<&Pair>> = Vec::new();
    for pair in pairs {
        let touches = |group: &Vec<&Pair>| {
            group.iter().any(|it| it.newcomer == pair.newcomer || it.site == pair.site)
        };
        let (touching, mut others): (Vec<_>, Vec<_>) = groups.into_iter().partition(touches);
        let mut joined: Vec<&Pair> = touching.into_iter().flatten().collect();
        joined.push(pair);
        others.push(joined);
        groups = others;
    }
    groups
}

/// Sum over all sets of edges without a common end of the products of their weights: row by row, by which
/// columns are taken. Columns are to be few.
fn matchings(edges: &[(usize, usize, f64)]) -> f64 {
    let mut columns: Vec<usize> = edges.iter().map(|edge| edge.1).collect();
    columns.sort_unstable();
    columns.dedup();
    let mut rows: Vec<usize> = edges.iter().map(|edge| edge.0).collect();
    rows.sort_unstable();
    rows.dedup();
    let mut by_taken = vec![0.0; 1 << columns.len()];
    by_taken[0] = 1.0;
    for row in rows {
        let before = by_taken.clone();
        for &(_, column, weight) in edges.iter().filter(|edge| edge.0 == row) {
            let bit = 1 << columns.partition_point(|&it| it < column);
            for (taken, sum) in before.iter().enumerate().filter(|(taken, _)| taken & bit == 0) {
                by_taken[taken | bit] += weight * sum;
            }
        }
    }
    by_taken.iter().sum()
}

fn n_different(indices: impl Iterator<Item = usize>) -> usize {
    let mut indices: Vec<usize> = indices.collect();
    indices.sort_unstable();
    indices.dedup();
    indices.len()
}

#[cfg(test)]
mod tests {
    use meetpoint_geometry::GridFrame;
    use meetpoint_occupancy::Grid;
    use proptest::prelude::*;

    use super::*;
    use crate::alignment_params::AlignmentParams;
    use crate::looked::Look;

    /// A map of nothing but these, looked at from the origin.
    fn part(landmarks: &[NamelessLandmark]) -> Part {
        let nothing = Grid::new(GridFrame::new(0.05).expect("a length"));
        let look = Look { at: Pose::IDENTITY, range_max_m: 8.0, half_field_of_view_rad: 4.0 };
        Part::of_grid(&nothing, &AlignmentParams::INDOOR)
            .with_nameless(landmarks.to_vec(), &[look, look])
    }

    /// The sum over all ways to tell which is which, landmark of the newcomer by landmark.
    fn by_enumeration((site, newcomer): (&Part, &Part), at: Pose) -> f64 {
        let own = alone(&newcomer.nameless, site, at);
        let others = alone(&site.nameless, newcomer, at.inverse());
        let area_m2 = (site.known_m2() + newcomer.known_m2()).max(AREA_MIN_M2);
        let density = |of_type: u32| {
            let all = site.nameless.iter().chain(&newcomer.nameless);
            all.filter(|it| it.landmark_type == of_type).count() as f64 / area_m2
        };
        let mut sum = 0.0;
        let n_ways = (site.nameless.len() + 1).pow(u32::try_from(own.len()).expect("few"));
        for way in 0..n_ways {
            let (mut left, mut odds) = (way, 1.0);
            let mut taken = vec![false; others.len()];
            for (landmark, alone) in newcomer.nameless.iter().zip(&own) {
                let of_site = left % (others.len() + 1);
                left /= others.len() + 1;
                let Some(other) = site.nameless.get(of_site) else {
                    odds *= alone;
                    continue;
                };
                let is_free = !std::mem::replace(&mut taken[of_site], true);
                let variance = landmark.variance_m2 + other.variance_m2 + BEND_STD_M * BEND_STD_M;
                let off = (at * landmark.at - other.at).norm_squared();
                let is_same = is_free && landmark.landmark_type == other.landmark_type;
                let normal = (-0.5 * off / variance).exp() / (TAU * variance);
                let pair = SEEN * normal / density(landmark.landmark_type);
                odds *= if is_same { pair } else { 0.0 };
            }
            let rest = others.iter().zip(&taken).filter(|(_, taken)| !**taken);
            sum += odds * rest.map(|(alone, _)| alone).product::<f64>();
        }
        sum.ln()
    }

    fn landmarks(n: usize) -> impl Strategy<Value = Vec<NamelessLandmark>> {
        let one = (0..2_u32, -6.0..6.0_f64, -6.0..6.0_f64, 0.01..0.2_f64);
        let one = one.prop_map(|(landmark_type, x_m, y_m, variance_m2)| NamelessLandmark {
            landmark_type,
            at: Point2::new(x_m, y_m),
            variance_m2,
        });
        prop::collection::vec(one, 1..n)
    }

    proptest! {
        /// The product over small sums is the sum over all assignments, wherever the newcomer lies; and it
        /// does not matter which of the two is the newcomer.
        #[test]
        fn equals_the_sum_over_all_assignments(
            site in landmarks(6),
            newcomer in landmarks(6),
            (x_m, y_m, theta_rad) in (-4.0..4.0_f64, -4.0..4.0_f64, -3.0..3.0_f64),
        ) {
            let (site, newcomer) = (part(&site), part(&newcomer));
            let at = Pose::new(x_m, y_m, theta_rad);
            let fast = NamelessTestimony::new((&site, &newcomer), at).log_odds;
            let slow = by_enumeration((&site, &newcomer), at);
            prop_assert!((fast - slow).abs() < 1e-3, "{fast} {slow}");
            let turned = NamelessTestimony::new((&newcomer, &site), at.inverse()).log_odds;
            prop_assert!((fast - turned).abs() < 1e-6, "{fast} {turned}");
        }
    }

    #[test]
    fn what_lies_together_speaks_for_it_and_what_is_missing_against() {
        let pole = |x_m: f64, y_m: f64| NamelessLandmark {
            landmark_type: 0,
            at: Point2::new(x_m, y_m),
            variance_m2: 0.05,
        };
        let site = part(&[pole(1.0, 2.0), pole(-3.0, 1.0), pole(2.0, -3.0)]);
        let there = NamelessTestimony::new((&site, &site), Pose::IDENTITY);
        assert_eq!((there.n_agreeing, there.n_alone), (3, 0), "all of them");
        assert!(3.0 < there.log_odds, "{there:?}");
        let elsewhere =
            NamelessTestimony::new((&site, &site), Pose::new(0.0, 0.0, std::f64::consts::PI));
        assert_eq!((elsewhere.n_agreeing, elsewhere.n_alone), (0, 6), "none");
        assert!((elsewhere.log_odds - 6.0 * ALONE.ln()).abs() < 0.1, "{elsewhere:?}");
        let far = NamelessTestimony::new((&site, &site), Pose::new(50.0, 0.0, 0.0));
        assert_eq!(far, NamelessTestimony::default(), "where neither has looked nothing is said");
        let other = NamelessLandmark { landmark_type: 1, ..pole(1.0, 2.0) };
        let others = NamelessTestimony::new((&site, &part(&[other])), Pose::IDENTITY);
        assert_eq!(others, NamelessTestimony::default(), "of other types neither knows");
    }

    #[test]
    fn crowds_are_told_too_small_and_not_for_ever() {
        let crowd: Vec<NamelessLandmark> = (0..40_u32)
            .map(|index| NamelessLandmark {
                landmark_type: 0,
                at: Point2::new(0.3 * f64::from(index % 8), 0.3 * f64::from(index / 8)),
                variance_m2: 0.05,
            })
            .collect();
        let crowd = part(&crowd);
        let said = NamelessTestimony::new((&crowd, &crowd), Pose::IDENTITY);
        let all_alone = 80.0 * ALONE.ln();
        assert!(said.log_odds.is_finite() && all_alone / 2.0 < said.log_odds, "{said:?}");
    }
}
