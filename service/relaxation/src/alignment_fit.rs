//! One placement of a newcomer's landmarks: matched, fitted, and judged (see [`crate::alignment`]).

use std::f64::consts::TAU;

use meetpoint_geometry::{Pose, angle_between};
use nalgebra::{Matrix2, Matrix2x3, Matrix3, Rotation2, Vector2, Vector3};

use crate::alignment::AlignmentParams;
use crate::constellation::{Constellation, Star};
use crate::landmark::LandmarkKind;

/// Rounds of matching and fitting.
const N_ROUNDS_MAX: u32 = 10;
/// A placement that moves by less stands still, in metres and radians.
const STEP_MIN: f64 = 1e-6;
/// In the first round landmarks are matched from this many times as far: a vote is rough.
const FIRST_REACH: f64 = 2.0;
/// Landmarks in a square metre of what was looked at: no building has fewer, or more.
const DENSITY_PER_M2: (f64, f64) = (0.003, 0.5);
/// A landmark that should have been noticed by more than this chance contradicts.
const NOTICED_CHANCE: f64 = 0.5;
/// A map that has looked at nothing takes at least this area, in square metres.
const AREA_MIN_M2: f64 = 10.0;

/// Two maps, with what does not depend on how one lies in the other.
#[derive(Clone, Copy)]
pub(crate) struct Judge<'a> {
    pub(crate) site: &'a Constellation,
    pub(crate) other: &'a Constellation,
    pub(crate) params: AlignmentParams,
    /// Landmarks in a square metre looked at.
    density_per_m2: f64,
    /// Logarithm of the prior density of a placement, in 1/(m² rad).
    log_prior: f64,
    /// Area in which the newcomer may lie, in square metres.
    area_m2: f64,
}

/// Two landmarks that are one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Match {
    pub(crate) site: usize,
    pub(crate) other: usize,
    /// What it adds to the evidence against both being unmatched.
    pub(crate) gain: f64,
}

/// A placement that fits best.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Fitted {
    pub(crate) site_from_other: Pose,
    pub(crate) covariance: Matrix3<f64>,
    pub(crate) log_evidence: f64,
    /// The site's in order.
    pub(crate) matches: Vec<Match>,
    pub(crate) n_contradicted: usize,
    pub(crate) common_m2: f64,
}

impl<'a> Judge<'a> {
    pub(crate) fn new(
        site: &'a Constellation,
        other: &'a Constellation,
        params: AlignmentParams,
    ) -> Self {
        let n = (site.stars.len() + other.stars.len()) as f64;
        let looked_m2 = (site.coverage.area_m2() + other.coverage.area_m2()).max(AREA_MIN_M2);
        let (sparse, dense) = DENSITY_PER_M2;
        let area_m2 = area_m2(site, other);
        Self {
            site,
            other,
            params,
            density_per_m2: (n / looked_m2).clamp(sparse, dense),
            log_prior: -(TAU * area_m2).ln(),
            area_m2,
        }
    }

    /// The usual standard deviation of a difference of two places, in metres.
    pub(crate) fn place_std_m(&self) -> f64 {
        let variance = |stars: &[Star]| {
            let mut traces: Vec<f64> =
                stars.iter().map(|star| star.covariance_m2.trace() / 2.0).collect();
            traces.sort_by(f64::total_cmp);
            traces.get(traces.len() / 2).copied().unwrap_or(0.0).max(0.0)
        };
        let of_both = variance(&self.site.stars) + variance(&self.other.stars);
        (of_both + 2.0 * self.params.place_std_m.powi(2)).sqrt()
    }

    /// The best placement near one; `None` if it holds no two landmarks that are one.
    pub(crate) fn fitted(&self, candidate: Pose) -> Option<Fitted> {
        let mut placed = candidate;
        let mut matches = self.matches(placed, FIRST_REACH);
        for _ in 0..N_ROUNDS_MAX {
            let (precision, gradient) = self.equations(placed, &matches)?;
            let step = precision.try_inverse()? * gradient;
            placed = Pose::new(placed.x_m - step.x, placed.y_m - step.y, placed.theta_rad - step.z);
            let again = self.matches(placed, 1.0);
            let stands = step.amax() < STEP_MIN && again == matches;
            matches = again;
            if stands {
                break;
            }
        }
        let (precision, _) = self.equations(placed, &matches)?;
        let covariance = precision.try_inverse()?;
        let log_volume = 1.5 * TAU.ln() + covariance.determinant().ln() / 2.0;
        let (log_unmatched, n_contradicted) = self.unmatched(placed, &matches);
        let gains: f64 = matches.iter().map(|it| it.gain).sum();
        let log_evidence = gains + log_unmatched + log_volume + self.log_prior;
        matches.sort_by_key(|it| it.site);
        log_evidence.is_finite().then_some(Fitted {
            site_from_other: placed,
            covariance,
            log_evidence,
            matches,
            n_contradicted,
            common_m2: 0.0,
        })
    }

    /// With what it says that both saw nothing else where both looked, which takes longer to find out
    /// than all other evidence.
    pub(crate) fn with_common(&self, mut fitted: Fitted) -> Fitted {
        let (site, other) = (&self.site.coverage, &self.other.coverage);
        fitted.common_m2 = site.common_m2(other, fitted.site_from_other);
        fitted.log_evidence += self.density_per_m2 * fitted.common_m2;
        fitted
    }

    /// Whether two placements are really different, by where they put what either matches.
    pub(crate) fn are_two(&self, a: &Fitted, b: &Fitted) -> bool {
        let turn_rad = angle_between(a.site_from_other.theta_rad, b.site_from_other.theta_rad);
        let n = b.matches.len().max(1) as f64;
        let places = b.matches.iter().map(|it| self.other.stars[it.other].position);
        let off_m = places.map(|at| (a.site_from_other * at - b.site_from_other * at).norm());
        self.params.apart_rad < turn_rad.abs() || self.params.apart_m < off_m.sum::<f64>() / n
    }

    /// Landmarks that are one, the surest first, each in one pair.
    fn matches(&self, placed: Pose, reach: f64) -> Vec<Match> {
        let squares_max = (self.params.deviations_max * reach).powi(2);
        let mut pairs = Vec::new();
        for (other, of_other) in self.other.stars.iter().enumerate() {
            for (site, of_site) in self.site.stars.iter().enumerate() {
                if self.is_far(placed, (of_site, of_other), squares_max) {
                    continue;
                }
                let Some(log_same) = self.log_same(of_site.kind, of_other.kind) else { continue };
                let Some((off, precision)) = self.off(placed, of_site, of_other) else { continue };
                let squares = off.dot(&(precision * off));
                if squares_max < squares {
                    continue;
                }
                let log_density = precision.determinant().ln() / 2.0 - TAU.ln() - squares / 2.0;
                let gain = log_density + log_same + (of_site.exists * of_other.exists).ln();
                // A rough placement may not be judged yet.
                if 0.0 < gain || 1.0 < reach {
                    pairs.push(Match { site, other, gain });
                }
            }
        }
        pairs.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        let mut is_taken =
            [vec![false; self.site.stars.len()], vec![false; self.other.stars.len()]];
        pairs.retain(|it| {
            let is_free = !is_taken[0][it.site] && !is_taken[1][it.other];
            (is_taken[0][it.site], is_taken[1][it.other]) = (true, true);
            is_free
        });
        pairs
    }

    /// Whether two landmarks are farther apart than so many squared deviations along any axis.
    fn is_far(&self, placed: Pose, (of_site, of_other): (&Star, &Star), squares_max: f64) -> bool {
        let off = of_site.position - placed * of_other.position;
        // No axis errs by more than all of them together.
        let spread = of_site.covariance_m2.trace()
            + of_other.covariance_m2.trace()
            + 4.0 * self.params.place_std_m.powi(2);
        squares_max * spread < off.norm_squared()
    }

    /// How far a newcomer's landmark is from one of the site's, and how precisely that is known;
    /// `None` if it is not finite.
    fn off(
        &self,
        placed: Pose,
        of_site: &Star,
        of_other: &Star,
    ) -> Option<(Vector2<f64>, Matrix2<f64>)> {
        let off = of_site.position - placed * of_other.position;
        let turn = Rotation2::new(placed.theta_rad).into_inner();
        let bending = Matrix2::identity() * (2.0 * self.params.place_std_m.powi(2));
        let spread =
            of_site.covariance_m2 + turn * of_other.covariance_m2 * turn.transpose() + bending;
        let precision = spread.try_inverse()?;
        let is_finite = off.iter().chain(precision.iter()).all(|value| value.is_finite());
        is_finite.then_some((off, precision))
    }

    /// Logarithm of the chance that a landmark of the one kind is one that looks like the other kind,
    /// divided by the density of its like; `None` if it cannot be.
    fn log_same(&self, of_site: LandmarkKind, of_other: LandmarkKind) -> Option<f64> {
        match (of_site, of_other) {
            // There is one of that name, anywhere.
            (LandmarkKind::Identity(_), _) | (_, LandmarkKind::Identity(_)) => {
                (of_site == of_other).then(|| self.area_m2.ln())
            }
            _ if of_site == of_other => {
                let share = self.share_of(of_site);
                Some((1.0 - self.params.mistaken_share).ln() - (self.density_per_m2 * share).ln())
            }
            _ => Some(self.params.mistaken_share.ln() - self.density_per_m2.ln()),
        }
    }

    /// Share of all landmarks that are of a type.
    fn share_of(&self, kind: LandmarkKind) -> f64 {
        let all = || self.site.stars.iter().chain(&self.other.stars);
        let n = all().filter(|star| star.kind == kind).count();
        n as f64 / all().count().max(1) as f64
    }

    /// Equations of the step from a placement: precision, and gradient of half of the squares.
    /// `None` for fewer than two matches.
    fn equations(&self, placed: Pose, matches: &[Match]) -> Option<(Matrix3<f64>, Vector3<f64>)> {
        if matches.len() < 2 {
            return None;
        }
        let (mut precision, mut gradient) = (Matrix3::zeros(), Vector3::zeros());
        for it in matches {
            let (of_site, of_other) = (&self.site.stars[it.site], &self.other.stars[it.other]);
            let (off, of_off) = self.off(placed, of_site, of_other)?;
            let arm = (placed * of_other.position).coords - placed.position().coords;
            let by = Matrix2x3::new(-1.0, 0.0, arm.y, 0.0, -1.0, -arm.x);
            precision += by.transpose() * of_off * by;
            gradient += by.transpose() * of_off * off;
        }
        Some((precision, gradient))
    }

    /// What landmarks say that only one of the two has, and how many of them contradict.
    fn unmatched(&self, placed: Pose, matches: &[Match]) -> (f64, usize) {
        let other_from_site = placed.inverse();
        let (mut sum, mut n_contradicted) = (0.0, 0);
        let mut judge = |star: &Star, noticed: f64, is_named_there: bool| {
            let renamed = if is_named_there { self.params.renamed_share.ln() } else { 0.0 };
            sum += (1.0 - star.exists * noticed).ln() + renamed;
            n_contradicted += usize::from(is_named_there || NOTICED_CHANCE < noticed);
        };
        let is_named = |stars: &[Star], kind: LandmarkKind| {
            matches!(kind, LandmarkKind::Identity(_)) && stars.iter().any(|star| star.kind == kind)
        };
        for (index, star) in self.site.stars.iter().enumerate() {
            if matches.iter().all(|it| it.site != index) {
                let noticed = self.other.coverage.noticed(other_from_site * star.position);
                judge(star, noticed, is_named(&self.other.stars, star.kind));
            }
        }
        for (index, star) in self.other.stars.iter().enumerate() {
            if matches.iter().all(|it| it.other != index) {
                judge(star, self.site.coverage.noticed(placed * star.position), false);
            }
        }
        (sum, n_contradicted)
    }
}

/// Area that the newcomer's frame may lie in: what the site covers, and around it as far as the newcomer
/// has gone.
fn area_m2(site: &Constellation, other: &Constellation) -> f64 {
    let size = |map: &Constellation| {
        let places = map.stars.iter().map(|star| star.position);
        let looked = map.coverage.corners().map(|(min, max)| [min, max]);
        let all: Vec<_> = places.chain(looked.into_iter().flatten()).collect();
        let along = |axis: usize| {
            let min = all.iter().map(|at| at[axis]).fold(f64::INFINITY, f64::min);
            let max = all.iter().map(|at| at[axis]).fold(f64::NEG_INFINITY, f64::max);
            if min <= max { max - min } else { 0.0 }
        };
        (along(0), along(1))
    };
    let (width_m, height_m) = size(site);
    let reach_m = size(other).0.hypot(size(other).1);
    ((width_m + 2.0 * reach_m) * (height_m + 2.0 * reach_m)).max(AREA_MIN_M2)
}
