//! One frame for all places of a map: local frames relaxed into one by what odometry says between
//! visits (HSSH 2004, section IV: metrical constraints, where they are asked for).
//!
//! With places `x`, headings `ψ` at visits, and the motion `(t, δ)` from visit `k` at place `p` to the
//! next at place `q`,
//!
//! ```text
//! χ² = sum over k of |R(−ψ_k) (x_q − x_p) − t_k|² / σ_k² + (ψ_k+1 − ψ_k − δ_k)² / τ_k²
//! ```
//!
//! is lessened by Levenberg's steps from dead reckoning. Headings hang together as a chain, so that they
//! are eliminated first: time O(visits × places + places³) a step, space O(visits × places).
//!
//! If a map is true and odometry errs as it is said to, χ² has so many degrees of freedom as there are
//! more measurements than unknowns. The bound is its quantile by E. B. Wilson and M. M. Hilferty, "The
//! distribution of chi-square", PNAS 17 (1931).

use meetpoint_geometry::{Point2, Pose, Vector2, wrap_angle};
use nalgebra::{DMatrix, DVector};

use crate::edge_records::TravelRecord;
use crate::map_tree::Hypothesis;
use crate::place_map::{Gateway, PlaceId};
use crate::travel::Travel;

/// How far odometry is believed, and places are points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameParams {
    /// Standard deviation of where in a place the robot takes itself to be there, along each axis, in
    /// metres.
    pub place_m: f64,
    /// Standard deviation of a way's displacement, as a share of it.
    pub length_share: f64,
    /// Standard deviation of a change of heading, in radians, on the shortest way,
    pub turned_rad: f64,
    /// and what each metre adds to it.
    pub turned_rad_per_m: f64,
    /// Standard deviations of a normal variable up to which a map fits: 3.09 is exceeded by one true map in
    /// a thousand.
    pub fits_up_to_sigmas: f64,
    /// Steps, at most.
    pub n_steps_max: u32,
}

impl FrameParams {
    /// Wheels that nobody calibrated, in corridors.
    pub const WHEELS: Self = Self {
        place_m: 0.4,
        length_share: 0.05,
        turned_rad: 0.1,
        turned_rad_per_m: 0.01,
        fits_up_to_sigmas: 3.09,
        n_steps_max: 50,
    };
}

/// All places of a map in one frame, and how well that agrees with odometry.
#[derive(Clone, Debug, PartialEq)]
pub struct ConsistentFrame {
    /// Where each place lies, in the order of ids, in metres: the first place at the origin, x where the
    /// robot looked there first.
    pub places: Vec<Point2<f64>>,
    /// What is left of the misfit.
    pub chi2: f64,
    /// Measurements beyond unknowns; 0 where no place was visited twice.
    pub n_degrees: usize,
    /// Greatest χ² of a map that fits.
    pub chi2_max: f64,
    /// Whether steps had become small, or too small to get below `chi2_max` in as many again; a frame that
    /// is not settled contradicts nothing.
    pub is_settled: bool,
}

impl ConsistentFrame {
    /// Whether odometry speaks against the map.
    pub fn is_contradicted(&self) -> bool {
        self.is_settled && self.chi2_max < self.chi2
    }
}

/// A way between two visits.
struct Way {
    places: [usize; 2],
    moved: Pose,
    /// 1 / σ² and 1 / τ².
    weights: [f64; 2],
}

/// Where everything lies.
#[derive(Clone)]
struct State {
    places: Vec<Vector2<f64>>,
    headings_rad: Vec<f64>,
}

/// χ² below which nothing is worth another step.
const CHI2_STEP_MIN: f64 = 1e-9;
/// Share of its diagonal by which the normal equations are damped at first.
const DAMPING: f64 = 1e-4;
/// Damping is multiplied or divided by this.
const DAMPING_FACTOR: f64 = 10.0;
/// A step that helps only if damped more than this has nowhere to go.
const DAMPING_MAX: f64 = 1e8;

/// The frame in which a map agrees best with what was measured on the steps of its travel; `None` where
/// not all of them were, or the map is of another travel.
pub fn consistent_frame(
    hypothesis: &Hypothesis,
    travel: &Travel,
    records: &[TravelRecord],
    params: &FrameParams,
) -> Option<ConsistentFrame> {
    let ways = ways(hypothesis, travel, records, params)?;
    let n_places = hypothesis.map.n_places();
    let mut state = dead_reckoned(n_places, &ways);
    let (mut chi2, mut damping) = (chi2(&state, &ways), DAMPING);
    let (mut gained, mut is_settled) = (f64::INFINITY, false);
    for _ in 0..params.n_steps_max {
        let (next, next_chi2) = loop {
            let next = stepped(&state, &ways, damping);
            let next_chi2 = next.as_ref().map_or(f64::INFINITY, |next| self::chi2(next, &ways));
            if next_chi2 <= chi2 || DAMPING_MAX < damping {
                break (next, next_chi2);
            }
            damping *= DAMPING_FACTOR;
        };
        gained = chi2 - next_chi2;
        if let Some(next) = next.filter(|_| 0.0 <= gained) {
            (state, chi2) = (next, next_chi2);
        }
        damping /= DAMPING_FACTOR;
        if gained <= CHI2_STEP_MIN * (1.0 + chi2) {
            is_settled = true;
            break;
        }
    }
    // Three of each way; two of each place but the first, and a heading of each visit but the first.
    let n_degrees = (2 * ways.len()).saturating_sub(2 * (n_places - 1));
    let chi2_max = quantile(n_degrees, params.fits_up_to_sigmas);
    // Frames that are far off creep for long. As many steps again, each as good as the last, change nothing.
    is_settled |= gained * f64::from(params.n_steps_max) < chi2 - chi2_max;
    Some(ConsistentFrame {
        places: state.places.into_iter().map(Point2::from).collect(),
        chi2,
        n_degrees,
        chi2_max,
        is_settled,
    })
}

/// χ² of so many degrees that is exceeded as rarely as so many standard deviations of a normal variable.
fn quantile(n_degrees: usize, sigmas: f64) -> f64 {
    if n_degrees == 0 {
        // Nothing is measured twice; what is left is rounding.
        return 1e-6;
    }
    let n = n_degrees as f64;
    let share = 2.0 / (9.0 * n);
    n * (1.0 - share + sigmas * share.sqrt()).powi(3)
}

fn ways(
    hypothesis: &Hypothesis,
    travel: &Travel,
    records: &[TravelRecord],
    params: &FrameParams,
) -> Option<Vec<Way>> {
    let start = Gateway { place: PlaceId(0), index: 0 };
    let arrivals = hypothesis.map.arrivals(start, travel.turns())?;
    let visited: Vec<usize> = arrivals.iter().map(|at| at.place.0 as usize).collect();
    let steps = visited.windows(2).enumerate();
    steps
        .map(|(step, places)| {
            let moved = records.get(step)?.moved?;
            let way_m = records.get(step)?.length_m.unwrap_or(0.0).max(moved.distance_m());
            let sigma2 = 2.0 * params.place_m.powi(2) + (params.length_share * way_m).powi(2);
            let tau2 = params.turned_rad.powi(2) + (params.turned_rad_per_m * way_m).powi(2);
            let weights = [sigma2.recip(), tau2.recip()];
            Some(Way { places: [places[0], places[1]], moved, weights })
        })
        .collect()
}

/// Headings summed up, and each place where it was come to first.
fn dead_reckoned(n_places: usize, ways: &[Way]) -> State {
    let mut state = State { places: vec![Vector2::zeros(); n_places], headings_rad: vec![0.0] };
    let (mut at, mut is_known) = (Pose::IDENTITY, vec![false; n_places]);
    if let Some(first) = is_known.first_mut() {
        *first = true;
    }
    for way in ways {
        at = at * way.moved;
        state.headings_rad.push(at.theta_rad);
        let [_, to] = way.places;
        if !std::mem::replace(&mut is_known[to], true) {
            state.places[to] = at.position().coords;
        }
    }
    state
}

/// What a way should have been, seen from where it begins, and how far the measured one is off.
fn residual(state: &State, index: usize, way: &Way) -> (Vector2<f64>, Vector2<f64>, f64) {
    let [from, to] = way.places;
    let apart = state.places[to] - state.places[from];
    let heading_rad = state.headings_rad[index];
    let (sin, cos) = heading_rad.sin_cos();
    let seen = Vector2::new(cos * apart.x + sin * apart.y, cos * apart.y - sin * apart.x);
    let turned_rad = state.headings_rad[index + 1] - heading_rad;
    (seen, seen - way.moved.position().coords, wrap_angle(turned_rad - way.moved.theta_rad))
}

fn chi2(state: &State, ways: &[Way]) -> f64 {
    let of_way = |(index, way): (usize, &Way)| {
        let (_, off, turned_off) = residual(state, index, way);
        way.weights[0] * off.norm_squared() + way.weights[1] * turned_off * turned_off
    };
    ways.iter().enumerate().map(of_way).sum()
}

/// The normal equations: of places, of headings (their diagonal, and what joins each with the one before),
/// between both, and the right-hand sides. Places but the first, headings but the first.
struct Normal {
    places: DMatrix<f64>,
    diagonal: Vec<f64>,
    before: Vec<f64>,
    /// A row a heading.
    mixed: DMatrix<f64>,
    of_places: DVector<f64>,
    of_headings: DVector<f64>,
}

fn normal(state: &State, ways: &[Way]) -> Normal {
    let (n_unknown, n_headings) = (2 * (state.places.len() - 1), ways.len());
    let mut normal = Normal {
        places: DMatrix::zeros(n_unknown, n_unknown),
        diagonal: vec![0.0; n_headings],
        before: vec![0.0; n_headings],
        mixed: DMatrix::zeros(n_headings, n_unknown),
        of_places: DVector::zeros(n_unknown),
        of_headings: DVector::zeros(n_headings),
    };
    for (index, way) in ways.iter().enumerate() {
        normal.add(state, index, way);
    }
    normal
}

impl Normal {
    fn add(&mut self, state: &State, index: usize, way: &Way) {
        let (seen, off, turned_off) = residual(state, index, way);
        let [position, turn] = way.weights;
        let (sin, cos) = state.headings_rad[index].sin_cos();
        // Of both rows by x and y of the place arrived at, and by the heading.
        let by_place = [[cos, sin], [-sin, cos]];
        let by_heading = [seen.y, -seen.x];
        let ends = [(way.places[0], -1.0), (way.places[1], 1.0)];
        let unknowns = ends
            .into_iter()
            .filter(|(place, _)| 0 < *place)
            .flat_map(|(place, sign)| (0..2).map(move |axis| (2 * (place - 1) + axis, axis, sign)));
        let unknowns: Vec<(usize, usize, f64)> = unknowns.collect();
        for row in 0..2 {
            for &(column, axis, sign) in &unknowns {
                let slope = sign * by_place[row][axis];
                self.of_places[column] -= position * slope * off[row];
                for &(other, other_axis, other_sign) in &unknowns {
                    self.places[(column, other)] +=
                        position * slope * other_sign * by_place[row][other_axis];
                }
                if let Some(heading) = index.checked_sub(1) {
                    self.mixed[(heading, column)] += position * slope * by_heading[row];
                }
            }
            if let Some(heading) = index.checked_sub(1) {
                self.diagonal[heading] += position * by_heading[row].powi(2);
                self.of_headings[heading] -= position * by_heading[row] * off[row];
            }
        }
        self.diagonal[index] += turn;
        self.of_headings[index] -= turn * turned_off;
        if let Some(heading) = index.checked_sub(1) {
            self.diagonal[heading] += turn;
            self.before[index] -= turn;
            self.of_headings[heading] += turn * turned_off;
        }
    }

    /// Solves the chain of headings for every column of `rhs`, in place.
    fn solve_headings(&self, rhs: &mut DMatrix<f64>) {
        let n = self.diagonal.len();
        let mut pivots = self.diagonal.clone();
        for index in 1..n {
            let factor = self.before[index] / pivots[index - 1];
            pivots[index] -= factor * self.before[index];
            for column in 0..rhs.ncols() {
                let above = rhs[(index - 1, column)];
                rhs[(index, column)] -= factor * above;
            }
        }
        for index in (0..n).rev() {
            for column in 0..rhs.ncols() {
                let below = if index + 1 < n {
                    self.before[index + 1] * rhs[(index + 1, column)]
                } else {
                    0.0
                };
                rhs[(index, column)] = (rhs[(index, column)] - below) / pivots[index];
            }
        }
    }
}

/// The state after one damped step; `None` where the equations cannot be solved.
fn stepped(state: &State, ways: &[Way], damping: f64) -> Option<State> {
    let mut normal = normal(state, ways);
    for index in 0..normal.places.nrows() {
        normal.places[(index, index)] *= 1.0 + damping;
    }
    normal.diagonal.iter_mut().for_each(|diagonal| *diagonal *= 1.0 + damping);
    let n_unknown = normal.places.nrows();
    let mut solved = normal.mixed.clone().insert_column(n_unknown, 0.0);
    solved.set_column(n_unknown, &normal.of_headings);
    normal.solve_headings(&mut solved);
    let by_places = solved.columns(0, n_unknown);
    let reduced = &normal.places - normal.mixed.tr_mul(&by_places);
    let rhs = &normal.of_places - normal.mixed.tr_mul(&solved.column(n_unknown));
    let places = reduced.cholesky()?.solve(&rhs);
    let headings = solved.column(n_unknown) - by_places * &places;
    let mut next = state.clone();
    for (place, step) in next.places.iter_mut().skip(1).zip(places.as_slice().chunks_exact(2)) {
        *place += Vector2::new(step[0], step[1]);
    }
    for (heading_rad, step) in next.headings_rad.iter_mut().skip(1).zip(headings.iter()) {
        *heading_rad += step;
    }
    Some(next)
}
