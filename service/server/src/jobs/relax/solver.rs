//! The relaxation of one travel, piece by piece, so that it can be put down and taken up again.

use std::ops::ControlFlow;

use meetpoint_relaxation::{
    ErrorModel, Outcome, Progress, Relaxation, RelaxationParams, Stage, Travel,
};

use super::saved::Method;

/// Odometry that is to be believed is wrong by no more than this, as a share, in radians a metre and
/// radians a radian: below what anybody measures, above what arithmetic resolves.
const BELIEVED_STD: f64 = 1e-6;
/// A way by scans matched with those of the last metres, and meet points of grids passed along it. Along a
/// corridor without features matching slips by some hundredths of the way; headings it keeps to a tenth of
/// a degree a metre. Where walls are rough, or seen from one side, a meet point is two decimetres off.
const MATCHED: ErrorModel = ErrorModel {
    distance_std_m: 0.02,
    distance_share_std: 0.03,
    heading_std_rad: 0.005,
    way_turn_std_per_m: 0.002,
    turn_share_std: 0.01,
    sighting_std_m: 0.2,
    range_share_std: 0.05,
    bearing_std_rad: 0.05,
    scale_std: 0.02,
    turn_per_m_std: 0.001,
    turn_per_rad_std: 0.005,
};
/// The share of all work at which the search over associations is over.
const SHARE_SEARCHED: f64 = 0.5;

/// A piece of work that is done.
pub(super) struct Piece {
    /// Of all work, 0 to 1.
    pub(super) share: f64,
    /// What it is to be remembered by: an iteration, or the end of the search.
    pub(super) milestone: Option<Milestone>,
}

/// Sightings of a session: hypotheses keep what each was taken for, and memory is not to run out.
/// Hours of a camera that sees one a second.
const N_SIGHTINGS_MAX: usize = 20_000;

/// A piece that work goes on from after a crash.
pub(super) struct Milestone {
    /// What was done, for people.
    pub(super) stage: &'static str,
    pub(super) log_likelihood: Option<f64>,
    /// Whether expectation maximisation goes on from here, so that its tables can be made.
    pub(super) has_tables: bool,
    /// All that the rest of the work needs.
    pub(super) state: Vec<u8>,
}

/// What a travel's way is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reckoning {
    /// By odometry whose steady errors are estimated.
    Odometry,
    /// By odometry that is believed to be right on average.
    BelievedOdometry,
    /// By scans matched with those of the last metres.
    Matched,
}

impl Reckoning {
    /// What the way of a session is that is relaxed by that method.
    pub(super) fn of(method: Method, estimate_odometry: Option<bool>) -> Self {
        match (method, estimate_odometry) {
            (Method::GridLandmarks, _) => Self::Matched,
            (Method::Landmarks | Method::Scans, Some(false)) => Self::BelievedOdometry,
            (Method::Landmarks | Method::Scans, Some(true) | None) => Self::Odometry,
        }
    }
}

/// Relaxes a travel from its beginning, or from a milestone on, and tells of every piece; `None` if
/// it was told to stop.
///
/// # Errors
/// Why the travel cannot be relaxed, for people.
pub(super) fn relaxed(
    travel: &Travel,
    reckoning: Reckoning,
    state: Option<&[u8]>,
    mut tell: impl FnMut(Piece) -> ControlFlow<()>,
) -> Result<Option<Outcome>, String> {
    let params = params(travel, reckoning);
    let n_sightings = travel.n_sightings();
    if N_SIGHTINGS_MAX < n_sightings {
        return Err(format!("{n_sightings} sightings are more than {N_SIGHTINGS_MAX}"));
    }
    let mut relaxation = match state {
        Some(state) => {
            Relaxation::from_bytes(travel, params, state).map_err(|error| error.to_string())?
        }
        None => Relaxation::new(travel, params),
    };
    loop {
        let Progress { stage, share, log_likelihood, is_done, .. } = relaxation.advance();
        if is_done {
            let found = relaxation.outcome().cloned();
            let found = found.ok_or_else(|| "nothing fits what was seen".to_owned())?;
            let n_landmarks_max = params.search.n_landmarks_max;
            if n_landmarks_max as usize <= found.landmarks.len() {
                return Err(format!("{n_landmarks_max} landmarks or more are too many"));
            }
            return Ok(Some(found));
        }
        let milestone = milestone(stage, share);
        let milestone = milestone.map(|stage| {
            let (has_tables, state) = (relaxation.em().is_some(), relaxation.to_bytes());
            Milestone { stage, log_likelihood, has_tables, state }
        });
        if tell(Piece { share, milestone }).is_break() {
            return Ok(None);
        }
    }
}

/// How a travel is relaxed.
pub(super) fn params(travel: &Travel, reckoning: Reckoning) -> RelaxationParams {
    let params = RelaxationParams::of(travel);
    match reckoning {
        Reckoning::Odometry => params,
        Reckoning::BelievedOdometry => {
            let mut believed = params;
            for model in [&mut believed.model, &mut believed.refinement_model] {
                model.scale_std = BELIEVED_STD;
                model.turn_per_m_std = BELIEVED_STD;
                model.turn_per_rad_std = BELIEVED_STD;
            }
            believed
        }
        Reckoning::Matched => RelaxationParams {
            model: MATCHED,
            refinement_model: MATCHED,
            // Its tables of poses are coarser than the way is known.
            runs_em: false,
            ..params
        },
    }
}

/// What a piece is called if it is to be remembered. The search is too quick to be put down half way.
fn milestone(stage: Stage, share: f64) -> Option<&'static str> {
    match stage {
        Stage::Search if share < SHARE_SEARCHED => None,
        Stage::Search => Some("search over associations"),
        Stage::FromControls => Some("EM from the controls"),
        Stage::FromHypothesis => Some("EM from the search's map"),
        Stage::Refinement => Some("refinement"),
    }
}

#[cfg(test)]
mod tests {
    use meetpoint_geometry::Pose;
    use meetpoint_relaxation::{Detector, Motion, Sighting, Step};

    use super::*;

    /// Around a square of 10 m twice, by legs of half a metre, with odometry that drifts, past four
    /// doors with names; and the true poses.
    fn square() -> (Travel, Vec<Pose>) {
        let sightings = |door: u32| {
            let identity = Some(door % 4);
            vec![Sighting { identity, landmark_type: 0, range_m: 0.0, bearing_rad: 0.0 }]
        };
        let mut steps = vec![Step { motion: Motion::NONE, sightings: sightings(0) }];
        let (mut pose, mut truth) = (Pose::IDENTITY, vec![Pose::IDENTITY]);
        let turn = Pose::new(0.0, 0.0, std::f64::consts::FRAC_PI_2);
        for corner in 1..=8 {
            let legs = std::iter::repeat_n(Pose::new(0.51, 0.0, 0.005), 20).chain([turn]).collect();
            pose = pose * Pose::new(10.0, 0.0, 0.0) * turn;
            truth.push(pose);
            steps.push(Step { motion: Motion::new(legs), sightings: sightings(corner) });
        }
        let detector = Detector { range_max_m: 0.0, half_field_of_view_rad: 3.0 };
        (Travel { detector, steps }, truth)
    }

    /// The outcome when put down and taken up again after every milestone, or never.
    fn run(travel: &Travel, is_interrupted: bool) -> Outcome {
        let mut state: Option<Vec<u8>> = None;
        for _ in 0..200 {
            let mut last = None;
            let outcome = relaxed(travel, Reckoning::Odometry, state.as_deref(), |piece| {
                assert!((0.0..=1.0).contains(&piece.share), "{}", piece.share);
                let Some(milestone) = piece.milestone else { return ControlFlow::Continue(()) };
                last = Some(milestone.state);
                if is_interrupted { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            });
            if let Some(outcome) = outcome.expect("it fits") {
                return outcome;
            }
            state = last;
        }
        panic!("it does not end")
    }

    #[test]
    fn a_square_is_closed_whether_interrupted_or_not() {
        let (travel, truth) = square();
        let found = run(&travel, false);
        assert_eq!(found.landmarks.len(), 4, "{:?}", found.landmarks);
        for (pose, truth) in found.poses.iter().zip(&truth) {
            let off_m = (truth.position() - pose.position()).norm();
            assert!(off_m < 0.5, "{off_m} m: {pose:?}");
        }
        assert!(found.calibration.turn_per_m < 0.0, "undone: {:?}", found.calibration);
        assert_eq!(run(&travel, true), found, "bit for bit");
    }

    #[test]
    fn odometry_that_is_believed_stays_as_it_is() {
        let (travel, _) = square();
        let tell = |_| ControlFlow::Continue(());
        let found = relaxed(&travel, Reckoning::BelievedOdometry, None, tell)
            .expect("it fits")
            .expect("to its end");
        assert!(found.calibration.turn_per_m.abs() < 1e-4, "{:?}", found.calibration);
        assert!(
            relaxed(&travel, Reckoning::Odometry, Some(b"else"), tell).is_err(),
            "no state of a relaxation"
        );
    }

    #[test]
    fn more_sightings_than_memory_bears_are_refused() {
        let (mut travel, _) = square();
        let last = travel.steps[8].clone();
        travel.steps.resize(N_SIGHTINGS_MAX + 1, last);
        let problem = relaxed(&travel, Reckoning::Odometry, None, |_| ControlFlow::Continue(()));
        let problem = problem.expect_err("too many");
        assert_eq!(problem, "20001 sightings are more than 20000");
    }
}
