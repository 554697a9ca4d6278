//! The relaxation of one travel, one iteration after the other: expectation maximisation as in
//! Thrun, Burgard and Fox, Machine Learning 31 (1998), once with the odometry as it is and, if its
//! steady errors are to be estimated, once more without them.
//!
//! What is kept between two iterations is enough to go on bit for bit.

use std::collections::BTreeMap;

use meetpoint_geometry::{Point2, Pose, wrap_angle};
use meetpoint_relaxation::{
    Calibration, Em, EmParams, LandmarkKind, PeakParams, Sighting, Start, Travel, grid_for,
};
use prost::Message;

/// How a travel is relaxed.
#[derive(Clone, Copy, Debug)]
pub(super) struct SolverParams {
    /// Whether steady errors of the odometry are estimated.
    pub(super) estimate_odometry: bool,
}

/// How far a relaxation is.
pub(super) struct Progress {
    /// 0 to 1.
    pub(super) share: f64,
    /// What was done, for people.
    pub(super) stage: &'static str,
    pub(super) log_likelihood: Option<f64>,
    pub(super) is_done: bool,
}

/// What was found.
pub(super) struct Found {
    /// At each step, from the first one's.
    pub(super) poses: Vec<Pose>,
    pub(super) calibration: Calibration,
    pub(super) landmarks: Vec<FoundLandmark>,
    pub(super) log_likelihood: f64,
    /// 0 to 1.
    pub(super) confidence: f64,
    /// Logarithms of how much less probable they are, and what would decide.
    pub(super) alternatives: Vec<(f64, String)>,
}

/// A landmark, in the frame of the first pose.
#[derive(Clone, Debug)]
pub(super) struct FoundLandmark {
    pub(super) position: Point2<f64>,
    /// xx, xy, yy.
    pub(super) covariance_m2: [f64; 3],
    pub(super) landmark_type: u32,
    pub(super) identity: Option<u32>,
    pub(super) certainty: f64,
    /// Steps, and which of their sightings.
    pub(super) sightings: Vec<(usize, usize)>,
}

/// A relaxation under way.
pub(super) struct Solver {
    travel: Travel,
    params: SolverParams,
    state: State,
}

#[derive(Clone, PartialEq, Message)]
struct State {
    /// Whether the odometry's steady errors are estimated already.
    #[prost(bool, tag = "1")]
    is_calibrated: bool,
    #[prost(double, tag = "2")]
    scale: f64,
    #[prost(double, tag = "3")]
    turn_per_m: f64,
    #[prost(double, tag = "4")]
    turn_per_rad: f64,
    /// Of expectation maximisation; empty before its first iteration.
    #[prost(bytes = "vec", tag = "5")]
    em: Vec<u8>,
}

impl Solver {
    pub(super) fn new(travel: Travel, params: SolverParams) -> Self {
        let Calibration { scale, turn_per_m, turn_per_rad } = Calibration::NONE;
        let is_calibrated = !params.estimate_odometry;
        let state = State { is_calibrated, scale, turn_per_m, turn_per_rad, em: Vec::new() };
        Self { travel, params, state }
    }

    /// A relaxation as [`Solver::to_bytes`] left it; `None` if the bytes are none.
    pub(super) fn from_bytes(travel: Travel, params: SolverParams, bytes: &[u8]) -> Option<Self> {
        let state = State::decode(bytes).ok()?;
        let solver = Self { travel, params, state };
        solver.em().is_ok().then_some(solver)
    }

    pub(super) fn to_bytes(&self) -> Vec<u8> {
        self.state.encode_to_vec()
    }

    fn calibration(&self) -> Calibration {
        let State { scale, turn_per_m, turn_per_rad, .. } = self.state;
        Calibration { scale, turn_per_m, turn_per_rad }
    }

    fn em(&self) -> Result<Em<'_>, String> {
        let usual = EmParams::button;
        let calibration = self.calibration();
        let grid = grid_for(
            &self.travel,
            &calibration,
            &meetpoint_relaxation::MotionParams::CARPET,
            &meetpoint_relaxation::PerceptionParams::BUTTON,
        );
        let grid = grid.map_err(|error| error.to_string())?;
        let params = EmParams { calibration, ..usual(grid) };
        if self.state.em.is_empty() {
            return Ok(Em::new(&self.travel, params, Start::Controls));
        }
        Em::from_bytes(&self.travel, params, &self.state.em).map_err(|error| error.to_string())
    }

    /// One iteration.
    ///
    /// # Errors
    /// Why the travel cannot be relaxed, for people.
    pub(super) fn advance(&mut self) -> Result<Progress, String> {
        let mut em = self.em()?;
        let figures = em.iterate();
        let has_converged = em.has_converged();
        let stage =
            if self.state.is_calibrated { "relaxation" } else { "relaxation, odometry as it is" };
        let of_stage = f64::from(figures.iteration) / f64::from(N_ITERATIONS_USUAL);
        let calibration = if has_converged && !self.state.is_calibrated {
            let path = em.path().ok_or_else(left_the_grid)?;
            Some(calibrated(&self.travel, &path.poses))
        } else {
            None
        };
        let em = em.to_bytes();
        self.state.em = em;
        let share = self.share(of_stage.min(1.0));
        if let Some(Calibration { scale, turn_per_m, turn_per_rad }) = calibration {
            self.state =
                State { is_calibrated: true, scale, turn_per_m, turn_per_rad, em: Vec::new() };
        }
        let is_done = has_converged && calibration.is_none();
        Ok(Progress { share, stage, log_likelihood: figures.log_likelihood, is_done })
    }

    fn share(&self, of_stage: f64) -> f64 {
        match (self.params.estimate_odometry, self.state.is_calibrated) {
            (false, _) => of_stage,
            (true, false) => 0.5 * of_stage,
            (true, true) => 0.5 + 0.5 * of_stage,
        }
    }

    /// What the iterations came to.
    ///
    /// # Errors
    /// Why the travel cannot be relaxed, for people.
    pub(super) fn found(&self) -> Result<Found, String> {
        let em = self.em()?;
        let path = em.path().ok_or_else(left_the_grid)?;
        let map = em.map().ok_or_else(left_the_grid)?;
        let peaks = map.landmarks(&PeakParams::BUTTON);
        let places = peaks.iter().map(|peak| (peak.kind, peak.position)).collect::<Vec<_>>();
        let mut seen: BTreeMap<usize, Vec<(usize, usize)>> = BTreeMap::new();
        let (mut n_certain, mut n_all) = (0.0, 0.0);
        for (step, (station, &pose)) in self.travel.steps.iter().zip(&path.poses).enumerate() {
            for (index, sighting) in station.sightings.iter().enumerate() {
                n_all += 1.0;
                if let Some(landmark) = nearest(&places, pose, sighting) {
                    n_certain += path.certainty[step] * peaks[landmark].certainty;
                    seen.entry(landmark).or_default().push((step, index));
                }
            }
        }
        let landmark = |(landmark, sightings): (usize, Vec<(usize, usize)>)| {
            let peak = &peaks[landmark];
            let first = self.travel.steps[sightings[0].0].sightings[sightings[0].1];
            let at = sightings.iter().fold(Point2::origin(), |sum: Point2<f64>, &(step, index)| {
                let offset = self.travel.steps[step].sightings[index].offset_m();
                sum + (path.poses[step] * offset).coords
            });
            let covariance = peak.covariance_m2;
            FoundLandmark {
                position: at / sightings.len() as f64,
                covariance_m2: [covariance[(0, 0)], covariance[(0, 1)], covariance[(1, 1)]],
                landmark_type: first.landmark_type,
                identity: first.identity,
                certainty: peak.certainty,
                sightings,
            }
        };
        Ok(Found {
            calibration: self.calibration(),
            landmarks: seen.into_iter().map(landmark).collect(),
            log_likelihood: em.figures().and_then(|figures| figures.log_likelihood).unwrap_or(0.0),
            confidence: if n_all == 0.0 { 0.0 } else { n_certain / n_all },
            alternatives: Vec::new(),
            poses: path.poses,
        })
    }
}

/// Iterations of one stage that are usual.
const N_ITERATIONS_USUAL: u32 = 16;

fn left_the_grid() -> String {
    "the robot left the area that was chosen for it".to_owned()
}

/// The landmark of its kind that a sighting is nearest to.
fn nearest(
    places: &[(LandmarkKind, Point2<f64>)],
    pose: Pose,
    sighting: &Sighting,
) -> Option<usize> {
    let at = pose * sighting.offset_m();
    let kind = LandmarkKind::of(sighting);
    let of_kind = places.iter().enumerate().filter(|(_, (other, _))| *other == kind);
    of_kind
        .min_by(|(_, (_, a)), (_, (_, b))| {
            (a - at).norm_squared().total_cmp(&(b - at).norm_squared())
        })
        .map(|(index, _)| index)
}

/// Below this the normal equations tell nothing, in square metres or radians.
const NORMAL_MIN: f64 = 1e-6;

/// The steady errors by which odometry misses the poses of its steps, by least squares: its scale by
/// lengths, its drift by turns.
fn calibrated(travel: &Travel, poses: &[Pose]) -> Calibration {
    let (mut long, mut short) = (0.0, NORMAL_MIN);
    // Normal equations of turn missing = turn_per_m length + turn_per_rad turn.
    let [mut aa, mut ab, mut bb, mut ar, mut br] = [NORMAL_MIN, 0.0, NORMAL_MIN, 0.0, 0.0];
    for (step, pair) in travel.steps.iter().skip(1).zip(poses.windows(2)) {
        let measured = step.motion.displacement(&Calibration::NONE);
        let true_step = pair[0].step_to(pair[1]);
        long += true_step.distance_m() * measured.distance_m();
        short += measured.distance_m() * measured.distance_m();
        let missing_rad = wrap_angle(true_step.theta_rad - measured.theta_rad);
        let turns_rad: f64 = step.motion.legs().iter().map(|leg| leg.theta_rad).sum();
        let length_m = step.motion.distance_m();
        aa += length_m * length_m;
        ab += length_m * turns_rad;
        bb += turns_rad * turns_rad;
        ar += length_m * missing_rad;
        br += turns_rad * missing_rad;
    }
    let determinant = aa * bb - ab * ab;
    if long <= 0.0 || determinant <= NORMAL_MIN {
        return Calibration::NONE;
    }
    Calibration {
        scale: long / short,
        turn_per_m: (ar * bb - br * ab) / determinant,
        turn_per_rad: (br * aa - ar * ab) / determinant,
    }
}

#[cfg(test)]
mod tests {
    use meetpoint_relaxation::{Detector, Motion, Step};

    use super::*;

    /// Around a square of 10 m twice, by legs of half a metre, with odometry that drifts, past four
    /// doors that look alike.
    fn square() -> (Travel, Vec<Pose>) {
        let drift = Calibration { scale: 1.0 / 1.03, turn_per_m: -0.01, turn_per_rad: 0.0 };
        let sighting =
            Sighting { identity: None, landmark_type: 0, range_m: 0.0, bearing_rad: 0.0 };
        let mut steps = vec![Step { motion: Motion::NONE, sightings: vec![sighting] }];
        let (mut pose, mut truth) = (Pose::IDENTITY, vec![Pose::IDENTITY]);
        for _ in 0..8 {
            let true_leg = Pose::new(0.5, 0.0, 0.0);
            let turn = Pose::new(0.0, 0.0, std::f64::consts::FRAC_PI_2);
            let measured = Pose::new(0.5 / drift.scale, 0.0, 0.005);
            let legs = std::iter::repeat_n(measured, 20).chain([turn]).collect();
            pose = (0..20).fold(pose, |pose, _| pose * true_leg) * turn;
            truth.push(pose);
            steps.push(Step { motion: Motion::new(legs), sightings: vec![sighting] });
        }
        let detector = Detector { range_max_m: 0.0, half_field_of_view_rad: 3.0 };
        (Travel { detector, steps }, truth)
    }

    fn run(mut solver: Solver, is_interrupted: bool) -> (Found, u32) {
        let params = solver.params;
        for n in 1..100 {
            let progress = solver.advance().expect("it fits a grid");
            assert!((0.0..=1.0).contains(&progress.share), "{}", progress.share);
            if progress.is_done {
                return (solver.found().expect("it stayed in the grid"), n);
            }
            if is_interrupted {
                let (travel, bytes) = (solver.travel.clone(), solver.to_bytes());
                solver = Solver::from_bytes(travel, params, &bytes).expect("just written");
            }
        }
        panic!("it does not end")
    }

    #[test]
    fn a_square_is_closed_and_its_drift_known() {
        let (travel, truth) = square();
        let params = SolverParams { estimate_odometry: true };
        let (found, n) = run(Solver::new(travel.clone(), params), false);
        assert_eq!(found.landmarks.len(), 4, "{:?}", found.landmarks);
        let off_m = truth
            .iter()
            .zip(&found.poses)
            .map(|(truth, pose)| (truth.position() - pose.position()).norm());
        let worst_m = off_m.fold(0.0, f64::max);
        assert!(worst_m < 1.0, "{worst_m} m");
        assert!(found.calibration.turn_per_m < 0.0 && found.calibration.scale < 1.0, "undone");
        let (again, n_again) = run(Solver::new(travel, params), true);
        assert_eq!((n_again, &again.poses), (n, &found.poses), "bit for bit");
    }

    #[test]
    fn bytes_of_something_else_are_refused() {
        let (travel, _) = square();
        let params = SolverParams { estimate_odometry: false };
        assert!(Solver::from_bytes(travel, params, b"\x2a\x01\x07").is_none(), "no state");
    }
}
