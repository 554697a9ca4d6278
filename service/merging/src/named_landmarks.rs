//! What landmarks with names say of one map's lying on another.
//!
//! A name that both maps have is a witness. That it lies where the other map has it, give or take the
//! deviations of both, stands against its lying anywhere in what the site has seen, and against its being
//! another landmark of that name, or one misread:
//!
//! ```text
//! l = ln((1 - WRONG) N(distance; variance) area + WRONG)
//! ```
//!
//! the logarithm of the odds between "the same place" and "two places that have nothing to do with one
//! another", as of walls. What only one map has says nothing: the other may not have looked.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use meetpoint_geometry::{Point2, Pose};

use crate::part::Part;

/// A landmark with a name, as a map has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NamedLandmark {
    /// Its name, by a number that is the same in all maps.
    pub name: u32,
    /// Where it is, in metres in the frame of the map.
    pub at: Point2<f64>,
    /// Variance of each coordinate, in square metres.
    pub variance_m2: f64,
}

/// What all names together say of a place.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct NamedTestimony {
    /// Logarithm of the odds; 0 if the maps have no name in common.
    pub(crate) log_odds: f64,
    /// Names that both maps have.
    pub(crate) n_common: usize,
    /// Those of them that lie together.
    pub(crate) n_agreeing: usize,
}

/// A name that both maps have: where each has it, and the sum of the variances.
struct Common {
    in_site: Point2<f64>,
    in_newcomer: Point2<f64>,
    variance_m2: f64,
}

/// Share of names that are wrong: of another landmark called the same, or misread, or moved.
const WRONG: f64 = 0.02;
/// Standard deviation that two maps have of one another over a floor, in metres: both bend.
pub(crate) const BEND_STD_M: f64 = 0.3;
/// A name lies where the other map has it if the square of the distance in units of the variance is at
/// most this: three deviations.
const AGREES_CHI2_MAX: f64 = 9.0;
/// Area that a place is one of, at least, in square metres: of a site that has seen less, a hall.
const AREA_MIN_M2: f64 = 100.0;
/// Two names say which way a map is turned if they lie so far apart, in metres...
const APART_MIN_M: f64 = 2.0;
/// ...and both maps have them as far apart, but for this, in metres.
const STRETCH_MAX_M: f64 = 1.0;
/// Places that pairs of names say, at most.
const N_PLACES_MAX: usize = 50;

impl NamedTestimony {
    pub(crate) fn new((site, newcomer): (&Part, &Part), site_from_newcomer: Pose) -> Self {
        let area_m2 = site.known_m2().max(AREA_MIN_M2);
        let mut testimony = Self::default();
        for Common { in_site, in_newcomer, variance_m2 } in common(site, newcomer) {
            let chi2 = (site_from_newcomer * in_newcomer - in_site).norm_squared() / variance_m2;
            let density = (-0.5 * chi2).exp() / (TAU * variance_m2);
            testimony.log_odds += ((1.0 - WRONG) * density * area_m2 + WRONG).ln();
            testimony.n_common += 1;
            testimony.n_agreeing += usize::from(chi2 <= AGREES_CHI2_MAX);
        }
        testimony
    }
}

/// Where the newcomer lies by two names each.
pub(crate) fn places_by_names(site: &Part, newcomer: &Part) -> Vec<Pose> {
    let all: Vec<Common> = common(site, newcomer).collect();
    let pairs = all.iter().enumerate().flat_map(|(index, a)| {
        let later = all[index + 1..].iter();
        later.filter_map(move |b| place_of(a, b))
    });
    pairs.take(N_PLACES_MAX).collect()
}

fn place_of(a: &Common, b: &Common) -> Option<Pose> {
    let (in_site, in_newcomer) = (b.in_site - a.in_site, b.in_newcomer - a.in_newcomer);
    let stretch_m = (in_site.norm() - in_newcomer.norm()).abs();
    if in_newcomer.norm() < APART_MIN_M || STRETCH_MAX_M < stretch_m {
        return None;
    }
    let turn_rad = in_site.y.atan2(in_site.x) - in_newcomer.y.atan2(in_newcomer.x);
    let turned = Pose::new(0.0, 0.0, turn_rad);
    let middle = |a: Point2<f64>, b: Point2<f64>| a + (b - a) / 2.0;
    let shift = middle(a.in_site, b.in_site) - turned * middle(a.in_newcomer, b.in_newcomer);
    Some(Pose::new(shift.x, shift.y, turn_rad))
}

/// The names that both have, in their order. Of several landmarks with one name in a map, none counts.
fn common(site: &Part, newcomer: &Part) -> impl Iterator<Item = Common> {
    let in_newcomer = by_name(&newcomer.landmarks);
    by_name(&site.landmarks).into_iter().filter_map(move |(name, a)| {
        let (a, b) = (a?, (*in_newcomer.get(&name)?)?);
        let variance_m2 = a.variance_m2 + b.variance_m2 + BEND_STD_M * BEND_STD_M;
        let is_known = variance_m2.is_finite() && [a.at, b.at].iter().all(is_finite);
        is_known.then_some(Common { in_site: a.at, in_newcomer: b.at, variance_m2 })
    })
}

fn is_finite(at: &Point2<f64>) -> bool {
    at.iter().all(|coordinate| coordinate.is_finite())
}

/// Each name's landmark; `None` of a name that several have.
fn by_name(landmarks: &[NamedLandmark]) -> BTreeMap<u32, Option<NamedLandmark>> {
    let mut by_name = BTreeMap::new();
    for landmark in landmarks {
        by_name.entry(landmark.name).and_modify(|one| *one = None).or_insert(Some(*landmark));
    }
    by_name
}

#[cfg(test)]
mod tests {
    use meetpoint_geometry::GridFrame;
    use meetpoint_occupancy::Grid;
    use proptest::prelude::*;

    use super::*;
    use crate::alignment_params::AlignmentParams;

    fn part(at: &[Point2<f64>]) -> Part {
        let nothing = Grid::new(GridFrame::new(0.05).expect("a length"));
        let named = (0..).zip(at).map(|(name, &at)| NamedLandmark { name, at, variance_m2: 0.01 });
        Part::of_grid(&nothing, &AlignmentParams::INDOOR).with_landmarks(named.collect())
    }

    proptest! {
        /// Wherever the newcomer lies, two names say where; there more speaks for it than elsewhere, and
        /// what is farther off than a bent map explains is spoken against.
        #[test]
        fn two_names_say_where(
            (x_m, y_m, theta_rad) in (-50.0..50.0_f64, -50.0..50.0_f64, -3.0..3.0_f64),
            (away_m, towards_rad) in (2.5..30.0_f64, -3.0..3.0_f64),
            shift_m in 1.0..20.0_f64,
        ) {
            let pose = Pose::new(x_m, y_m, theta_rad);
            let own = [Point2::new(1.0, 2.0), Pose::new(1.0, 2.0, towards_rad) * Point2::new(away_m, 0.0)];
            let (site, newcomer) = (part(&own.map(|at| pose * at)), part(&own));
            let places = places_by_names(&site, &newcomer);
            prop_assert_eq!(places.len(), 1);
            let off = places[0].step_to(pose);
            prop_assert!(off.distance_m() < 1e-9 && off.theta_rad.abs() < 1e-9, "{off:?}");
            let there = NamedTestimony::new((&site, &newcomer), pose);
            let shifted = pose * Pose::new(shift_m, 0.0, 0.0);
            let elsewhere = NamedTestimony::new((&site, &newcomer), shifted);
            prop_assert_eq!((there.n_common, there.n_agreeing), (2, 2));
            prop_assert_eq!((elsewhere.n_common, elsewhere.n_agreeing), (2, 0));
            prop_assert!(0.0 < there.log_odds, "{there:?}");
            prop_assert!(elsewhere.log_odds < there.log_odds, "{there:?} {elsewhere:?}");
            let is_explained = shift_m < 5.0 * BEND_STD_M;
            prop_assert!(is_explained || elsewhere.log_odds < 0.0, "{elsewhere:?}");
        }
    }

    #[test]
    fn without_a_name_in_common_nothing_is_said() {
        let (site, newcomer) = (part(&[Point2::new(1.0, 1.0)]), part(&[]));
        let said = NamedTestimony::new((&site, &newcomer), Pose::IDENTITY);
        assert_eq!(said, NamedTestimony::default(), "nothing");
        assert_eq!(places_by_names(&site, &newcomer), [], "nowhere");
    }
}
