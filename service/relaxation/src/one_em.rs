//! Which landmark every sighting of several travels saw, by one expectation maximisation over all of them
//! (TBF98 section 8, once it is about known how they lie to each other).
//!
//! ```text
//! E-step   what each travel saw, given one map of all
//! M-step   that map, given what all of them saw
//! ```
//!
//! A travel that was relaxed by itself has told its sightings by itself, and what is ambiguous in it need not
//! be so among the landmarks of others. Where a button is pressed upon landmarks both steps are the paper's,
//! on a grid of poses ([`crate::joint_em`]), from the map that all come to together and from that of the
//! travel that is surest, as the second robot of the paper from that of the first.
//! Which sighting is of which landmark is then settled by what fits best, in units of its error, with least
//! squares over all ([`crate::together`]).
//!
//! What cameras see is finer than such a grid, and to settle it by best fit alone makes it worse: without
//! names MRCLAM 6 comes out 0.105 m off instead of 0.056. There what the travels told stands.
//!
//! What comes of it is taken only if the evidence of all measurements says so: EM climbs the nearest hill.

use std::ops::ControlFlow;

use meetpoint_geometry::{Pose, Rotation2};

use crate::association::of_known;
use crate::calibration::Calibration;
use crate::consolidation::{best_fitting, renumber};
use crate::em::{EmParams, Figures};
use crate::grid_choice::grid_for_all;
use crate::joint::{JointLandmark, JointOutcome, Placed};
use crate::joint_em::{JointEm, JointTravel};
use crate::key_steps::KeySteps;
use crate::landmark::{Landmark, LandmarkKind};
use crate::landmarks::PeakParams;
use crate::motion_model::MotionParams;
use crate::perception::PerceptionParams;
use crate::relaxation::RelaxationParams;
use crate::shape::shape_covariance;
use crate::start::StartBelief;
use crate::together::{Member, RefinedTogether, refined_together};
/// Rounds in which every sighting goes to the landmark that fits it best.
const N_ROUNDS_MAX: u32 = 5;
/// What is found is taken if its evidence is better by more than this, as a logarithm: twenty to one. What
/// each travel found by itself was searched for more widely than EM climbs.
const LOG_ODDS_MIN: f64 = 3.0;

/// A travel that was relaxed by itself, and how surely it is known where it begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Started<'a> {
    /// The travel, and about where it lies.
    pub placed: Placed<'a>,
    /// alpha(1): [`StartBelief::At`] one that was told, [`StartBelief::About`] one that was found in the
    /// map of others.
    pub start: StartBelief,
}

/// What one EM over all found.
#[derive(Clone, Debug, PartialEq)]
pub struct OneEm {
    /// The map of all: what was there before, if nothing better was found.
    pub outcome: JointOutcome,
    /// Iterations of EM on a grid of poses, from all maps together; 0 if it was not run, as where cameras saw.
    pub n_iterations: u32,
    /// Sightings that are of another landmark than each travel by itself, and all of them together before,
    /// had them.
    pub n_told_otherwise: usize,
    /// Logarithm of the odds of the best that was found against what was before; at most so little above
    /// 0 that it was not taken, if `n_told_otherwise` is 0.
    pub log_odds: f64,
}

/// Which landmark each sighting of each travel saw, what fits that best, and what speaks for it.
struct Told {
    association: Vec<Vec<Option<u32>>>,
    fit: RefinedTogether,
    log_evidence: f64,
}

/// Poses of all travels, and what undoes their odometry's errors.
type Ways = (Vec<Vec<Pose>>, Vec<Calibration>);

/// The travels with what does not change.
struct All<'a> {
    started: &'a [Started<'a>],
    params: Vec<RelaxationParams>,
    keys: Vec<KeySteps>,
}

/// One EM over travels that [`crate::joint`] has fitted together as `before`. Tells of every iteration on a
/// grid, and breaks if it is told to. `None` if what was before cannot be fitted again.
pub fn one_em(
    started: &[Started<'_>],
    before: JointOutcome,
    mut tell: impl FnMut(&Figures) -> ControlFlow<()>,
) -> ControlFlow<(), Option<OneEm>> {
    let all = All::new(started);
    if !all.params.iter().all(|params| params.runs_em) {
        let (n_iterations, n_told_otherwise, log_odds) = (0, 0, 0.0);
        let stands = OneEm { outcome: before, n_iterations, n_told_otherwise, log_odds };
        return ControlFlow::Continue(Some(stands));
    }
    let ways = (before.poses.clone(), before.calibrations.clone());
    let Some(told) = all.told(associations(started, &before), ways) else {
        return ControlFlow::Continue(None);
    };
    let mut n_iterations = 0;
    let mut found = Vec::new();
    for map in all.maps(&before) {
        let Some(mut em) = all.em(&map, &before) else { continue };
        while !em.has_converged() {
            let figures = em.iterate();
            n_iterations += 1;
            tell(&figures)?;
        }
        found.extend(all.read_off(&em, &before));
    }
    found.push((told.association.clone(), (told.fit.poses.clone(), told.fit.calibrations.clone())));
    let settled = found
        .into_iter()
        .filter_map(|(association, ways)| all.settled(all.told(association, ways)?));
    let best = settled.max_by(|a, b| a.log_evidence.total_cmp(&b.log_evidence));
    let log_odds = best.as_ref().map_or(0.0, |best| best.log_evidence - told.log_evidence);
    let Some(best) = best.filter(|_| LOG_ODDS_MIN < log_odds) else {
        let unchanged = OneEm { outcome: before, n_iterations, n_told_otherwise: 0, log_odds };
        return ControlFlow::Continue(Some(unchanged));
    };
    let n_told_otherwise = n_told_otherwise(&told.association, &best.association);
    let outcome = all.outcome(best);
    ControlFlow::Continue(Some(OneEm { outcome, n_iterations, n_told_otherwise, log_odds }))
}

impl<'a> All<'a> {
    fn new(started: &'a [Started<'a>]) -> Self {
        let travels = started.iter().map(|it| it.placed.travel);
        let params: Vec<RelaxationParams> = travels.clone().map(RelaxationParams::of).collect();
        let keys = travels.zip(&params).map(|(travel, params)| {
            KeySteps::of(travel, (params.search.key_way_m, params.search.key_turn_rad))
        });
        Self { started, keys: keys.collect(), params }
    }

    /// Maps that EM begins with: that of all, and that of the travel which is surest by itself.
    fn maps(&self, before: &JointOutcome) -> Vec<Vec<Landmark>> {
        let surest = self.started.iter().zip(&before.poses).max_by(|(a, _), (b, _)| {
            let [a, b] = [a, b].map(|it| it.placed.outcome);
            let by_confidence = a.confidence.total_cmp(&b.confidence);
            by_confidence.then(a.association.len().cmp(&b.association.len()))
        });
        let alone = surest.and_then(|(started, poses)| {
            let frame = *poses.first()?;
            let known = started.placed.outcome.known_map().into_iter();
            Some(known.map(|landmark| moved(landmark, frame)).collect())
        });
        [before.known_map()].into_iter().chain(alone).collect()
    }

    /// EM on a grid from a map; `None` if no grid holds all travels.
    fn em(&self, map: &[Landmark], before: &JointOutcome) -> Option<JointEm<'a>> {
        let (motion, perception) = (MotionParams::CARPET, PerceptionParams::BUTTON);
        let travels = self.started.iter().zip(&before.calibrations);
        let travels: Vec<_> = travels
            .map(|(it, calibration)| (it.placed.travel, calibration, it.placed.site_from_travel))
            .collect();
        let grid = grid_for_all(&travels, &motion, &perception).ok()?;
        let joint = self.started.iter().zip(&before.calibrations);
        let joint: Vec<JointTravel<'a>> = joint
            .map(|(it, &calibration)| JointTravel {
                travel: it.placed.travel,
                start: it.start,
                calibration,
            })
            .collect();
        let mut params = EmParams::button(grid);
        // A map that is given is not to be blurred first.
        params.map.n_even_iterations = 0;
        Some(JointEm::new(&joint, params, map))
    }

    /// Which landmark every sighting saw, as EM's map and paths have it; `None` if a robot left the grid.
    fn read_off(
        &self,
        em: &JointEm<'_>,
        before: &JointOutcome,
    ) -> Option<(Vec<Vec<Option<u32>>>, Ways)> {
        let landmarks = em.map().landmarks(&PeakParams::BUTTON);
        let paths: Option<Vec<Vec<Pose>>> =
            em.paths().into_iter().map(|path| Some(path?.poses)).collect();
        let paths = paths?;
        let travels = self.started.iter().map(|it| it.placed.travel).zip(&paths);
        let association =
            travels.map(|(travel, poses)| of_known(travel, poses, &landmarks)).collect();
        Some((association, (paths, before.calibrations.clone())))
    }

    /// What fits the sightings of key steps best; `None` if nothing does.
    fn told(&self, mut association: Vec<Vec<Option<u32>>>, ways: Ways) -> Option<Told> {
        for (of_travel, keys) in association.iter_mut().zip(&self.keys) {
            let mut is_key = vec![false; of_travel.len()];
            keys.sightings.iter().for_each(|&sighting| is_key[sighting] = true);
            for (landmark, is_key) in of_travel.iter_mut().zip(is_key) {
                *landmark = landmark.filter(|_| is_key);
            }
        }
        renumber_all(&mut association);
        let (poses, calibrations) = ways;
        let members = self.started.iter().zip(&self.params).zip(poses).zip(calibrations);
        let members: Vec<Member<'_>> = members
            .zip(&association)
            .map(|((((started, params), poses), calibration), association)| Member {
                travel: started.placed.travel,
                model: params.refinement_model,
                poses,
                calibration,
                association: association.clone(),
            })
            .collect();
        let fit = refined_together(&members)?;
        let log_evidence = fit.log_evidence + self.log_prior(&association);
        Some(Told { association, fit, log_evidence })
    }

    /// Of landmarks that are new and of sightings that are false, as the search has it.
    fn log_prior(&self, association: &[Vec<Option<u32>>]) -> f64 {
        let n_landmarks = n_landmarks(association) as f64;
        let densities = self.params.iter().map(|params| params.search.density_per_m2);
        let log_new = densities.fold(f64::INFINITY, f64::min).ln();
        let of_false = association.iter().zip(&self.keys).zip(&self.params);
        let of_false = of_false.map(|((association, keys), params)| {
            let is_false = |sighting: &&usize| association[**sighting].is_none();
            let n_false = keys.sightings.iter().filter(is_false).count() as f64;
            n_false * (params.search.false_share.ln() + params.search.density_per_m2.ln())
        });
        n_landmarks * log_new + of_false.sum::<f64>()
    }

    /// Every sighting with the landmark that fits it best, until that changes nothing or is no better.
    fn settled(&self, mut told: Told) -> Option<Told> {
        for _ in 0..N_ROUNDS_MAX {
            let again = self.best_fitting(&told);
            let ways = (told.fit.poses.clone(), told.fit.calibrations.clone());
            let again = self.told(again, ways)?;
            if again.log_evidence <= told.log_evidence {
                break;
            }
            told = again;
        }
        Some(told)
    }

    fn best_fitting(&self, told: &Told) -> Vec<Vec<Option<u32>>> {
        let kinds = self.kinds(&told.association);
        let all = self.started.iter().zip(&self.params).zip(&told.fit.poses);
        all.map(|((started, params), poses)| {
            let landmarks = (&told.fit.landmarks[..], &kinds[..]);
            best_fitting(started.placed.travel, &params.refinement_model, poses, landmarks)
        })
        .collect()
    }

    /// What each landmark is, by the first sighting of it.
    fn kinds(&self, association: &[Vec<Option<u32>>]) -> Vec<LandmarkKind> {
        let mut kinds = vec![None; n_landmarks(association)];
        for (started, association) in self.started.iter().zip(association) {
            let seen = started.placed.travel.steps.iter().flat_map(|step| &step.sightings);
            for (seen, landmark) in seen.zip(association) {
                if let Some(landmark) = landmark {
                    kinds[*landmark as usize].get_or_insert(LandmarkKind::of(seen));
                }
            }
        }
        kinds.into_iter().map(|kind| kind.unwrap_or(LandmarkKind::Type(0))).collect()
    }

    /// The map of all, with the sightings of all steps.
    fn outcome(&self, told: Told) -> JointOutcome {
        let mut association = self.best_fitting(&told);
        for ((whole, keys), of_keys) in
            association.iter_mut().zip(&self.keys).zip(&told.association)
        {
            // What is told of the key steps stands.
            keys.sightings.iter().for_each(|&sighting| whole[sighting] = of_keys[sighting]);
        }
        let kinds = self.kinds(&told.association);
        let shape = shape_covariance(&told.fit.landmarks, &told.fit.landmark_covariance);
        let mut landmarks: Vec<JointLandmark> = kinds
            .into_iter()
            .zip(&told.fit.landmarks)
            .enumerate()
            .map(|(index, (kind, &position))| {
                let at = (2 * index, 2 * index);
                JointLandmark {
                    position,
                    covariance_m2: told
                        .fit
                        .landmark_covariance
                        .fixed_view::<2, 2>(at.0, at.1)
                        .into(),
                    shape_covariance_m2: shape.fixed_view::<2, 2>(at.0, at.1).into(),
                    kind,
                    certainty: 1.0,
                    sightings: Vec::new(),
                }
            })
            .collect();
        for (travel, association) in association.iter().enumerate() {
            let Placed { travel: of_travel, outcome, .. } = self.started[travel].placed;
            let steps = of_travel.steps.iter().enumerate();
            let seen =
                steps.flat_map(|(step, at)| (0..at.sightings.len()).map(move |it| (step, it)));
            for (sighting, (step, within)) in seen.enumerate() {
                let Some(landmark) = association[sighting] else { continue };
                let landmark = &mut landmarks[landmark as usize];
                landmark.sightings.push((travel, step, within));
                let alone = outcome.association.get(sighting).copied().flatten();
                let alone = alone.and_then(|alone| outcome.landmarks.get(alone as usize));
                landmark.certainty = alone
                    .map_or(landmark.certainty, |alone| landmark.certainty.min(alone.certainty));
            }
        }
        JointOutcome {
            landmarks,
            poses: told.fit.poses,
            calibrations: told.fit.calibrations,
            cost: told.fit.cost,
        }
    }
}

/// By travel and sighting: its landmark in the map of all.
fn associations(started: &[Started<'_>], outcome: &JointOutcome) -> Vec<Vec<Option<u32>>> {
    let firsts: Vec<Vec<usize>> = started.iter().map(|it| firsts(it)).collect();
    let nothing = |it: &Started<'_>| vec![None; it.placed.travel.n_sightings()];
    let mut all: Vec<Vec<Option<u32>>> = started.iter().map(nothing).collect();
    for (number, landmark) in (0_u32..).zip(&outcome.landmarks) {
        for &(travel, step, within) in &landmark.sightings {
            all[travel][firsts[travel][step] + within] = Some(number);
        }
    }
    all
}

/// By step: the index of its first sighting.
fn firsts(started: &Started<'_>) -> Vec<usize> {
    let mut n_before = 0;
    let steps = started.placed.travel.steps.iter();
    steps
        .map(|step| {
            let first = n_before;
            n_before += step.sightings.len();
            first
        })
        .collect()
}

fn n_landmarks(association: &[Vec<Option<u32>>]) -> usize {
    let last = association.iter().flatten().flatten().max();
    last.map_or(0, |last| *last as usize + 1)
}

/// Numbers landmarks in the order in which travels and steps saw them first.
fn renumber_all(association: &mut [Vec<Option<u32>>]) {
    let mut flat: Vec<Option<u32>> = association.iter().flatten().copied().collect();
    renumber(&mut flat);
    let mut rest = flat.as_slice();
    for of_travel in association {
        let (own, later) = rest.split_at(of_travel.len());
        of_travel.copy_from_slice(own);
        rest = later;
    }
}

/// Sightings that have another landmark than before.
fn n_told_otherwise(before: &[Vec<Option<u32>>], after: &[Vec<Option<u32>>]) -> usize {
    // Two that become one, and one that becomes two, count alike.
    n_left_behind(before, after).max(n_left_behind(after, before))
}

/// The same if every landmark of `to` is the one of `from` that it has most sightings in common with.
fn n_left_behind(from: &[Vec<Option<u32>>], to: &[Vec<Option<u32>>]) -> usize {
    let n_from = n_landmarks(from);
    let mut n_common = vec![0_usize; n_from * n_landmarks(to)];
    let (mut n_all, mut n_none) = (0, 0);
    for pair in from.iter().flatten().zip(to.iter().flatten()) {
        n_all += 1;
        match pair {
            (Some(from), Some(to)) => n_common[*to as usize * n_from + *from as usize] += 1,
            (None, None) => n_none += 1,
            _ => {}
        }
    }
    let most = n_common.chunks(n_from.max(1)).filter_map(|common| common.iter().max());
    n_all - n_none - most.sum::<usize>()
}

/// A landmark of a frame that lies there.
fn moved(landmark: Landmark, frame: Pose) -> Landmark {
    let turn = Rotation2::new(frame.theta_rad).into_inner();
    Landmark {
        position: frame * landmark.position,
        covariance_m2: turn * landmark.covariance_m2 * turn.transpose(),
        ..landmark
    }
}
