//! The whole relaxation of a travel, from controls and sightings to a map, in pieces that can be
//! put down and taken up again.
//!
//! 1. The search over associations ([`crate::search`]) finds what may have been seen when, and how
//!    the odometry drifts.
//! 2. EM ([`crate::em`]) runs with the odometry so corrected, once from the controls alone, as in
//!    the paper, and once from the best hypothesis' map. Plain EM climbs the nearest hill; the search
//!    says where the hills are.
//! 3. The associations that EM found are judged by the same evidence as the search's; the best is
//!    fitted by least squares ([`crate::refine`]).

use std::num::NonZero;

use nalgebra::Matrix2;

use crate::association::nearest_landmarks;
use crate::em::{Em, EmParams, Start};
use crate::em_state::InvalidState;
use crate::error_model::ErrorModel;
use crate::grid_choice::grid_for;
use crate::hypothesis::{Hypothesis, read_u64, taken};
use crate::key_steps::KeySteps;
use crate::landmark::{Landmark, LandmarkKind};
use crate::landmarks::PeakParams;
use crate::motion_model::MotionParams;
use crate::outcome::{Outcome, outcome};
use crate::perception::PerceptionParams;
use crate::search::SearchParams;
use crate::travel::Travel;
use crate::ways::{Judged, Means, Ways};

/// Tunables of [`Relaxation`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelaxationParams {
    /// How wrong odometry and sightings may be from one step to the next, where it is asked which
    /// landmark was seen.
    pub model: ErrorModel,
    /// How wrong they may be over all of the travel, for the last fit.
    pub refinement_model: ErrorModel,
    /// How associations are searched.
    pub search: SearchParams,
    /// Whether EM runs on a grid of poses after the search.
    pub runs_em: bool,
    /// Threads that may be used; results do not depend on it.
    pub n_threads: NonZero<usize>,
}

/// A detector that sees no farther is a person with a button, in metres.
const BUTTON_RANGE_MAX_M: f64 = 1.0;
/// What a peak of EM's map is.
const PEAKS: PeakParams = PeakParams::BUTTON;
const FORMAT: u8 = 1;

impl RelaxationParams {
    /// What fits the travel's detector.
    pub fn of(travel: &Travel) -> Self {
        let is_button = travel.detector.range_max_m <= BUTTON_RANGE_MAX_M;
        let mut sightings = travel.steps.iter().flat_map(|step| &step.sightings);
        let (model, refinement_model, search) = if is_button {
            (ErrorModel::BUTTON, ErrorModel::BUTTON, SearchParams::BUTTON)
        } else if sightings.any(|sighting| sighting.identity.is_some()) {
            (ErrorModel::CAMERA, ErrorModel::CAMERA, SearchParams::TAGS)
        } else {
            (ErrorModel::CAMERA_STEPS, ErrorModel::CAMERA, SearchParams::CAMERA)
        };
        let n_threads = NonZero::<usize>::MIN;
        Self { model, refinement_model, search, runs_em: is_button, n_threads }
    }
}

/// What a piece of work was.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// A step of the search over associations.
    Search,
    /// An iteration of EM from the controls alone.
    FromControls,
    /// An iteration of EM from the best hypothesis' map.
    FromHypothesis,
    /// The last fit.
    Refinement,
}

/// How far a relaxation is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// What was done.
    pub stage: Stage,
    /// Share of all work done, 0 to 1, as far as it can be told.
    pub share: f64,
    /// Iteration of the stage, from 1.
    pub iteration: u32,
    /// `ln P(d|m)` where the stage knows it: of EM's map, or the best hypothesis' evidence.
    pub log_likelihood: Option<f64>,
    /// Whether all is done.
    pub is_done: bool,
}

/// A relaxation under way.
#[derive(Debug)]
pub struct Relaxation<'a> {
    travel: &'a Travel,
    /// What the search looks at; hypotheses are about these steps.
    keys: KeySteps,
    params: RelaxationParams,
    hypotheses: Judged,
    work: Work<'a>,
}

#[derive(Debug)]
enum Work<'a> {
    Search(Box<Ways>),
    Em { from: From, em: Box<Em<'a>> },
    Refine,
    Done(Option<Box<Outcome>>),
}

/// Where EM starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum From {
    Controls,
    Hypothesis,
}

impl<'a> Relaxation<'a> {
    /// Before the first piece of work.
    pub fn new(travel: &'a Travel, params: RelaxationParams) -> Self {
        let spacing = (params.search.key_way_m, params.search.key_turn_rad);
        let keys = KeySteps::of(travel, spacing);
        let ways = Box::new(Ways::new(&keys.travel, means(&params)));
        Self { travel, keys, params, hypotheses: Judged::default(), work: Work::Search(ways) }
    }

    /// Does one piece of work.
    pub fn advance(&mut self) -> Progress {
        match &mut self.work {
            Work::Search(ways) => {
                if self.keys.steps.is_empty() {
                    self.work = Work::Refine;
                    return progress(Stage::Search, 0.5);
                }
                let goes_on = ways.advance();
                let (share, log_likelihood) = (ways.share(), ways.log_evidence());
                if !goes_on {
                    self.hypotheses = ways.found().clone();
                    self.work = self.begun(From::Controls).unwrap_or(Work::Refine);
                }
                Progress { log_likelihood, ..progress(Stage::Search, 0.5 * share) }
            }
            Work::Em { from, em } => {
                let from = *from;
                let figures = em.iterate();
                if em.has_converged() {
                    let found = found_by(self.travel, em);
                    self.judge(found);
                    let next = (from == From::Controls).then(|| self.begun(From::Hypothesis));
                    self.work = next.flatten().unwrap_or(Work::Refine);
                }
                let (stage, begun) = match from {
                    From::Controls => (Stage::FromControls, 0.5),
                    From::Hypothesis => (Stage::FromHypothesis, 0.7),
                };
                let share = begun + 0.2 * (f64::from(figures.iteration) / 16.0).min(1.0);
                let iteration = figures.iteration;
                let log_likelihood = figures.log_likelihood;
                Progress { iteration, log_likelihood, ..progress(stage, share) }
            }
            Work::Refine => {
                let model = &self.params.refinement_model;
                let found = outcome((self.travel, &self.keys), model, &self.hypotheses.0);
                self.work = Work::Done(found.map(Box::new));
                Progress { is_done: true, ..progress(Stage::Refinement, 1.0) }
            }
            Work::Done(_) => Progress { is_done: true, ..progress(Stage::Refinement, 1.0) },
        }
    }

    /// What was found; `None` before the end, or if nothing was seen at all.
    pub fn outcome(&self) -> Option<&Outcome> {
        match &self.work {
            Work::Done(found) => found.as_deref(),
            _ => None,
        }
    }

    /// All that the rest of the work needs besides travel and parameters. A search that is not over
    /// starts anew and finds the same.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = vec![FORMAT];
        bytes.push(match &self.work {
            Work::Search(_) => 0,
            Work::Em { from: From::Controls, .. } => 1,
            Work::Em { from: From::Hypothesis, .. } => 2,
            Work::Refine | Work::Done(_) => 3,
        });
        bytes.extend((self.hypotheses.0.len() as u64).to_le_bytes());
        for hypothesis in &self.hypotheses.0 {
            hypothesis.write(&mut bytes);
        }
        if let Work::Em { em, .. } = &self.work {
            bytes.extend(em.to_bytes());
        }
        bytes
    }

    /// Taken up where [`Self::to_bytes`] put it down.
    ///
    /// # Errors
    /// [`InvalidState`] if the bytes are of another travel, other parameters, or damaged.
    pub fn from_bytes(
        travel: &'a Travel,
        params: RelaxationParams,
        mut bytes: &[u8],
    ) -> Result<Self, InvalidState> {
        let mut relaxation = Self::new(travel, params);
        let [format, tag] = taken(&mut bytes)?;
        let counts = (relaxation.keys.sightings.len(), relaxation.keys.steps.len());
        let n = read_u64(&mut bytes)?;
        for _ in 0..n {
            let hypothesis = Hypothesis::read(&mut bytes, counts)?;
            relaxation.hypotheses.0.push(hypothesis);
        }
        let from = match (format, tag) {
            (FORMAT, 0) if bytes.is_empty() => return Ok(relaxation),
            (FORMAT, 1) => From::Controls,
            (FORMAT, 2) => From::Hypothesis,
            (FORMAT, 3) if bytes.is_empty() => {
                relaxation.work = Work::Refine;
                return Ok(relaxation);
            }
            _ => return Err(InvalidState),
        };
        let params = relaxation.em_params(from).ok_or(InvalidState)?;
        let em = Box::new(Em::from_bytes(travel, params, bytes)?);
        relaxation.work = Work::Em { from, em };
        Ok(relaxation)
    }

    /// EM before its first iteration; `None` if the parameters ask for none, or there is nothing to
    /// start from.
    fn begun(&self, from: From) -> Option<Work<'a>> {
        let params = self.em_params(from)?;
        let known;
        let start = match from {
            From::Controls => Start::Controls,
            From::Hypothesis => {
                known =
                    landmarks_of(&self.keys.travel, self.hypotheses.0.first()?, &self.params.model);
                Start::Map(&known)
            }
        };
        Some(Work::Em { from, em: Box::new(Em::new(self.travel, params, start)) })
    }

    fn em_params(&self, from: From) -> Option<EmParams> {
        let best = self.hypotheses.0.first().filter(|_| self.params.runs_em)?;
        let calibration = best.calibration;
        let (motion, perception) = (&MotionParams::CARPET, &PerceptionParams::BUTTON);
        let grid = grid_for(self.travel, &calibration, motion, perception).ok()?;
        let n_threads = self.params.n_threads;
        let mut params = EmParams { calibration, n_threads, ..EmParams::button(grid) };
        if from == From::Hypothesis {
            // A map that is given is not to be blurred first.
            params.n_coarse_iterations = 0;
            params.map.n_even_iterations = 0;
        }
        Some(params)
    }

    /// Takes in what EM found, if it is new, where its evidence puts it.
    fn judge(&mut self, association: Option<Vec<Option<u32>>>) {
        let Some(association) = association else { return };
        let association = self.keys.picked(&association);
        self.hypotheses.judge(&self.keys.travel, &means(&self.params), association);
    }

    /// The expectation maximisation under way, for who wants to look at its tables.
    pub fn em(&self) -> Option<&Em<'a>> {
        match &self.work {
            Work::Em { em, .. } => Some(em),
            _ => None,
        }
    }
}

fn means(params: &RelaxationParams) -> Means {
    Means { model: params.model, params: params.search, n_threads: params.n_threads }
}

fn progress(stage: Stage, share: f64) -> Progress {
    Progress { stage, share, iteration: 0, log_likelihood: None, is_done: false }
}

/// Which landmark each sighting saw, as EM's map and path have it.
fn found_by(travel: &Travel, em: &Em<'_>) -> Option<Vec<Option<u32>>> {
    let landmarks = em.map()?.landmarks(&PEAKS);
    Some(nearest_landmarks(travel, &em.path()?.poses, &landmarks))
}

/// A hypothesis' map as one to start EM from.
fn landmarks_of(travel: &Travel, hypothesis: &Hypothesis, model: &ErrorModel) -> Vec<Landmark> {
    let sightings = travel.steps.iter().flat_map(|step| &step.sightings);
    let mut kinds = vec![LandmarkKind::Type(0); hypothesis.landmarks.len()];
    for (sighting, landmark) in sightings.zip(&hypothesis.association) {
        if let Some(landmark) = landmark {
            kinds[*landmark as usize] = LandmarkKind::of(sighting);
        }
    }
    let covariance_m2 = Matrix2::identity() * model.sighting_std_m.powi(2);
    let places = hypothesis.landmarks.iter().zip(kinds);
    places
        .map(|(&position, kind)| Landmark { position, covariance_m2, kind, certainty: 1.0 })
        .collect()
}
