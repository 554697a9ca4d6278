//! One submap laid over another: where it fits, how sure that is, and whether to believe it.
//!
//! Anywhere in the window that the graph leaves open, a submap may fit at several places. Each is a
//! hypothesis with a likelihood,
//!
//! ```text
//! log L = score / score_std - m2 / 2
//! ```
//!
//! where m2 is the square of its distance from what the graph says, in units of its covariance. The
//! likeliest is believed if it is likelier than any other by given odds, if the scans agree with it one
//! by one, and if little of what they saw lies where others saw through.

use meetpoint_geometry::{Point2, Pose};
use nalgebra::{Matrix3, Vector3};

use crate::closures::closure::{Refusal, Verdict};
use crate::closures::evidence::Evidence;
use crate::closures::slide::{OPEN_STD_M, Slide};
use crate::closures::submap::{Submap, SubmapChart, spread_points};
use crate::closures::submap_charts::{around, drawn};
use crate::closures::submap_match::{Placed, SubmapFit, fit};
use crate::graph::pose_graph::Edge;
use crate::matching::peaks::peaks_in_window;
use crate::matching::search::Window;
use crate::relaxation_params::ClosureParams;
use crate::scans::believed_information::believed_information;

/// Where a submap may lie seen from another.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Guess {
    pub(crate) from: usize,
    pub(crate) to: usize,
    pub(crate) from_to: Pose,
    pub(crate) covariance: Matrix3<f64>,
}

/// What laying the one over the other found.
#[derive(Clone, Debug)]
pub(crate) struct Found {
    pub(crate) from_to: Pose,
    pub(crate) covariance: Matrix3<f64>,
    pub(crate) score: f64,
    /// Other places where it nearly fits as well, with their scores.
    pub(crate) alternatives: Vec<(Pose, f64)>,
    /// The line along which it is ambiguous, if it is along one only.
    pub(crate) slide: Option<Slide>,
    pub(crate) verdict: Verdict,
}

/// A place where a submap fits.
#[derive(Clone, Copy, Debug)]
struct Hypothesis {
    log_likelihood: f64,
    pose: Pose,
    score: f64,
}

/// Charts are searched no farther than this from their origin, in cells.
const N_CELLS_HALF_MAX: f64 = 1000.0;
/// A scan with fewer facets on mapped space is not asked whether it agrees.
const N_KNOWN_MIN: usize = 20;
/// The same if less than this share of its facets lies there.
const KNOWN_SHARE_MIN: f64 = 1.0 / 3.0;
/// Share of its facets on mapped space that lie at walls if a scan agrees.
const AT_WALLS_SHARE_MIN: f64 = 2.0 / 3.0;
/// Fewer scans than this confirm nothing.
const N_ASKED_MIN: usize = 3;
/// A match is open along a line if it is less sure than this, in metres.
const WHOLE_STD_M: f64 = 1.0;
/// A cell that three beams crossed is free.
const FREE_LOG_ODDS_MAX: f32 = -1.0;
/// A place where the field reaches this lies at a wall.
const WALL_VALUE_MIN: f64 = 0.1;

/// Deviation along the axis in which a position is least sure, in metres.
pub(crate) fn position_std_m(covariance: &Matrix3<f64>) -> f64 {
    let (xx, xy, yy) = (covariance[(0, 0)], covariance[(0, 1)], covariance[(1, 1)]);
    (0.5 * (xx + yy) + (0.25 * (xx - yy) * (xx - yy) + xy * xy).sqrt()).max(0.0).sqrt()
}

impl Found {
    /// Whether it says where the submap lies along all directions.
    pub(crate) fn is_whole(&self) -> bool {
        position_std_m(&self.covariance) < WHOLE_STD_M
    }

    /// The covariance of what can be believed of it if it waits for nothing but what it leaves open along
    /// a line.
    pub(crate) fn across(&self) -> Option<Matrix3<f64>> {
        match self.verdict {
            Verdict::Refused(Refusal::Ambiguous) => {
                self.slide.map(|slide| slide.open(&self.covariance))
            }
            Verdict::Refused(Refusal::Unsupported) if !self.is_whole() => Some(self.covariance),
            _ => None,
        }
    }
}

impl Guess {
    /// Deviation along the axis in which the position is least sure, in metres.
    pub(crate) fn position_std_m(&self) -> f64 {
        position_std_m(&self.covariance)
    }

    /// All that it leaves open.
    fn window(&self, params: &ClosureParams) -> Window {
        let half_m = params.n_std * self.position_std_m();
        let half_rad = params.n_std * self.covariance[(2, 2)].max(0.0).sqrt();
        Window {
            center: self.from_to,
            half_m: half_m.clamp(params.half_min_m, params.half_max_m),
            half_rad: half_rad.clamp(params.half_min_rad, params.half_max_rad),
            step_rad: params.step_rad,
        }
    }
}

/// Lays the submap `guess.to` over `guess.from`, of which `chart` is drawn unless it was. `None` if it
/// fits nowhere.
pub(crate) fn overlaid(
    guess: &Guess,
    submaps: &[Submap],
    chart: &mut Option<SubmapChart>,
    evidence: Evidence<'_>,
) -> Option<Found> {
    let params = &evidence.params.closures;
    let anchor = submaps[guess.to].anchor;
    let there: Vec<Placed<'_>> =
        submaps[guess.to].keys.clone().map(|key| evidence.placed(key, anchor)).collect();
    let squares = (params.point_edge_m, params.point_range_m);
    let points = spread_points(there.iter().copied(), squares, params.n_points_max);
    if points.len() < params.n_points_min {
        return None;
    }
    let chart = chart.get_or_insert_with(|| drawn(guess.from, submaps, evidence));
    let hypotheses = hypotheses(guess, &points, chart, evidence);
    let best = *hypotheses.first()?;
    let fit = refined(guess, best.pose, &there, submaps, evidence);
    let covariance = covariance(&fit, params)?;
    let rivals = &hypotheses[1..];
    let lead = |rival: &Hypothesis| best.log_likelihood - rival.log_likelihood;
    let n_close = rivals.iter().take_while(|rival| lead(rival) < params.log_odds_min).count();
    let mut slide = None;
    let verdict = if !is_confirmed(chart, &there, &fit, (best.pose, params)) {
        Verdict::Refused(Refusal::FewScansAgree)
    } else if params.contradicted_share_max < contradicted_share(chart, &points, best.pose) {
        Verdict::Refused(Refusal::Contradicted)
    } else if 0 < n_close {
        slide = Slide::through(best.pose, rivals[..n_close].iter().map(|rival| rival.pose));
        Verdict::Refused(Refusal::Ambiguous)
    } else {
        Verdict::Accepted
    };
    let near = |rival: &&Hypothesis| lead(rival) < 2.0 * params.log_odds_min;
    let alternatives = rivals.iter().filter(near).map(|rival| (rival.pose, rival.score));
    Some(Found {
        from_to: fit.from_to,
        covariance,
        score: best.score,
        alternatives: alternatives.collect(),
        slide,
        verdict,
    })
}

/// The places where some points fit, the likeliest first.
fn hypotheses(
    guess: &Guess,
    points: &[Point2<f64>],
    chart: &mut SubmapChart,
    evidence: Evidence<'_>,
) -> Vec<Hypothesis> {
    let params = &evidence.params.closures;
    let window = guess.window(params);
    let half_m = params.point_range_m + guess.from_to.distance_m() + window.half_m;
    #[expect(clippy::cast_possible_truncation, reason = "clamped")]
    let half = (half_m / evidence.params.resolution_m).clamp(0.0, N_CELLS_HALF_MAX) as i32;
    chart.reach(half);
    let peaks = peaks_in_window((&chart.field, &chart.pyramid), points, &window, &params.peaks());
    let by_graph = Edge {
        from: guess.from,
        to: guess.to,
        from_to: guess.from_to,
        information: guess.covariance.try_inverse().unwrap_or_else(Matrix3::zeros),
        chi2_turn: f64::INFINITY,
    };
    let judged = peaks.into_iter().map(|peak| Hypothesis {
        log_likelihood: peak.score / params.score_std
            - 0.5 * by_graph.chi2(Pose::IDENTITY, peak.pose),
        pose: peak.pose,
        score: peak.score,
    });
    let mut judged: Vec<Hypothesis> = judged.collect();
    judged.sort_by(|a, b| b.log_likelihood.total_cmp(&a.log_likelihood));
    judged
}

/// The fit of the scans on those of the other submap: first looking wide, since a peak lies within a
/// cell and half a step of the headings of where it should.
fn refined(
    guess: &Guess,
    start: Pose,
    there: &[Placed<'_>],
    submaps: &[Submap],
    evidence: Evidence<'_>,
) -> SubmapFit {
    let params = evidence.params;
    let anchor = submaps[guess.from].anchor;
    let keys = around(guess.from, submaps).flat_map(|near| submaps[near].keys.clone());
    let here: Vec<Placed<'_>> = keys.map(|key| evidence.placed(key, anchor)).collect();
    let stride = there.len().div_ceil(params.closures.n_scans_max.max(1)).max(1);
    let some: Vec<Placed<'_>> = there.iter().copied().step_by(stride).collect();
    let wide = fit(&here, &some, start, &params.wide_pairs());
    fit(&here, &some, wide.from_to, &params.pairs())
}

/// Covariance of a fit. Where the fit says nothing it is open.
fn covariance(fit: &SubmapFit, params: &ClosureParams) -> Option<Matrix3<f64>> {
    let open = Matrix3::identity() * OPEN_STD_M.powi(-2);
    let floor = Vector3::new(params.match_std_m, params.match_std_m, params.match_std_rad);
    let floor = Matrix3::from_diagonal(&floor.map(|std| std * std));
    Some((believed_information(&fit.information) + open).try_inverse()? + floor)
}

/// True if the fit stayed at the peak and enough scans agree with it.
fn is_confirmed(
    chart: &SubmapChart,
    scans: &[Placed<'_>],
    fit: &SubmapFit,
    (peak, params): (Pose, &ClosureParams),
) -> bool {
    let away = peak.step_to(fit.from_to);
    if params.apart_m < away.distance_m() || params.apart_rad < away.theta_rad.abs() {
        return false;
    }
    let agreeing: Vec<bool> =
        scans.iter().filter_map(|scan| agrees(chart, *scan, fit.from_to)).collect();
    let n_agreeing = agreeing.iter().filter(|&&agrees| agrees).count();
    let n_min = params.agreeing_share_min * agreeing.len() as f64;
    N_ASKED_MIN <= agreeing.len() && n_min <= n_agreeing as f64
}

/// Whether a scan agrees with the walls of a chart; `None` if too little of it lies on mapped space.
fn agrees(chart: &SubmapChart, (key, seen): Placed<'_>, pose: Pose) -> Option<bool> {
    let place = pose * seen;
    let (mut n_known, mut n_at_walls) = (0_usize, 0_usize);
    let facets = key.surface.facets();
    for facet in facets {
        let at = place * facet.at.map(f64::from);
        let (value, _, _) = chart.field.interpolate(at);
        let is_at_wall = WALL_VALUE_MIN <= value;
        let cell = chart.grid.frame().cell_at(at);
        n_known += usize::from(is_at_wall || chart.grid.log_odds(cell).is_some());
        n_at_walls += usize::from(is_at_wall);
    }
    let known = n_known as f64;
    let is_asked = N_KNOWN_MIN <= n_known && KNOWN_SHARE_MIN * facets.len() as f64 <= known;
    is_asked.then_some(AT_WALLS_SHARE_MIN * known < n_at_walls as f64)
}

/// Share of the points on mapped space that lie where others saw through.
fn contradicted_share(chart: &SubmapChart, points: &[Point2<f64>], pose: Pose) -> f64 {
    let (mut n_known, mut n_free) = (0_u32, 0_u32);
    for &point in points {
        let place = pose * point;
        let cell = chart.grid.frame().cell_at(place);
        let Some(log_odds) = chart.grid.log_odds(cell) else { continue };
        let (value, _, _) = chart.field.interpolate(place);
        n_known += 1;
        n_free += u32::from(log_odds < FREE_LOG_ODDS_MAX && value < WALL_VALUE_MIN);
    }
    f64::from(n_free) / f64::from(n_known.max(1))
}
