//! What does not change from one iteration to the next on one grid: motion tables and sightings
//! (TBF98 section 5, "caching").

use crate::em::EmParams;
use crate::landmark::Kinds;
use crate::motion_model::MotionModel;
use crate::perception::{Observation, Seen};
use crate::pose_grid::PoseGrid;
use crate::side_by_side::side_by_side;
use crate::travel::{Step, Travel};

/// A table for the way between steps costs about as much as this many multiplications.
const N_UNITS_OF_A_MOTION: usize = 100_000;

/// Entries of a motion's table below this share of its largest are dropped: a tenth of the share
/// by which poses are, so that no pose is dropped because of it.
pub(crate) const SHARE_OF_SELECTION: f32 = 0.1;

/// Tables of all steps on one grid.
#[derive(Debug)]
pub(crate) struct Level {
    pub(crate) grid: PoseGrid,
    /// By step, the way to the next.
    pub(crate) motions: Vec<MotionModel>,
    pub(crate) observations: Vec<Observation>,
}

impl Level {
    pub(crate) fn new(travel: &Travel, params: &EmParams, kinds: &Kinds, grid: PoseGrid) -> Self {
        let ways = travel.steps.get(1..).unwrap_or(&[]);
        let n = u32::try_from(ways.len()).unwrap_or(u32::MAX);
        let n_units = ways.len() * N_UNITS_OF_A_MOTION;
        let share = params.selection_share * SHARE_OF_SELECTION;
        let motions = side_by_side(n, params.n_threads, n_units, |step| {
            let motion = &ways[step as usize].motion;
            MotionModel::new(&grid, motion, &params.calibration, &params.motion, share)
        });
        let looks_around = travel.detector.range_max_m > 0.0;
        let observation = |step: &Step| Observation {
            seen: step
                .sightings
                .iter()
                .filter_map(|sighting| Seen::new(&grid, sighting, kinds, &params.perception))
                .collect(),
            // A button that is not pressed says nothing of places where the robot is not.
            something_in_view: looks_around || !step.sightings.is_empty(),
        };
        let observations = travel.steps.iter().map(observation).collect();
        Self { grid, motions, observations }
    }

    pub(crate) fn n_bytes(&self) -> usize {
        let motions: usize = self.motions.iter().map(|motion| motion.kernel().n_bytes()).sum();
        let seen = self.observations.iter().flat_map(|observation| &observation.seen);
        motions + seen.map(|seen| seen.kernel.n_bytes()).sum::<usize>()
    }
}
