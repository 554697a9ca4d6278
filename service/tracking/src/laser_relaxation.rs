//! Relaxation of one laser session: closures, pose graph, and every scan matched against all that was
//! seen near it; a slice at a time.

use meetpoint_geometry::{GridFrame, InvalidResolution, Pose};
use meetpoint_occupancy::{Grid, ScanMarks};

use crate::closure::{Closure, ClosureKey};
use crate::laser_travel::LaserTravel;
use crate::relaxation_params::LaserRelaxationParams;
use crate::sharpness::Sharpness;

/// What a relaxation is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LaserStage {
    /// Drawing the map by the live poses, to measure it.
    Before,
    /// Matching each key scan with those just before it.
    Chain,
    /// Looking for closures.
    Closures,
    /// Matching each key scan with all that were taken near it.
    Sweeps,
    /// Placing the scans between key scans.
    Placing,
    /// Drawing the map by the relaxed poses, to measure it.
    After,
}

/// How far a relaxation is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LaserProgress {
    /// Share of the work that is done, in 0..=1.
    pub share: f64,
    /// What is done next.
    pub stage: LaserStage,
    /// Closures accepted so far.
    pub n_accepted: usize,
    /// Closures refused so far.
    pub n_refused: usize,
}

/// What is told of a map.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LaserFigures {
    /// Entropy of the grid that the poses draw.
    pub sharpness: Sharpness,
    /// Sum over all constraints of the last pose graph of the square of their residuals in units of
    /// their covariance, at these poses.
    pub chi2: f64,
}

/// What a relaxation found.
#[derive(Clone, Debug, PartialEq)]
pub struct LaserOutcome {
    /// Pose of the robot at each scan of the travel: `map_from_robot`. The first key scan stays where
    /// live mapping had it.
    pub poses: Vec<Pose>,
    /// Every closure that was considered, accepted or not, by key.
    pub closures: Vec<Closure>,
    /// The map by live poses.
    pub before: LaserFigures,
    /// The map by the relaxed ones.
    pub after: LaserFigures,
    /// The farthest that a pose moved, in metres.
    pub move_max_m: f64,
}

/// A relaxation of one travel, under way. The same calls give the same bits.
#[derive(Debug)]
pub struct LaserRelaxation {
    travel: LaserTravel,
    params: LaserRelaxationParams,
    before: Drawing,
    after: Drawing,
    stage: Option<LaserStage>,
}

/// A map drawn scan by scan.
#[derive(Debug)]
struct Drawing {
    grid: Grid,
    marks: ScanMarks,
    n_done: usize,
}

/// Scans drawn in one slice.
const N_SCANS_SLICE: usize = 500;

impl LaserRelaxation {
    /// Begins a relaxation. `refused` are the closures that an operator switched off.
    ///
    /// # Errors
    /// [`InvalidResolution`] unless that of the parameters is finite and positive.
    pub fn new(
        travel: LaserTravel,
        params: LaserRelaxationParams,
        refused: &[ClosureKey],
    ) -> Result<Self, InvalidResolution> {
        let _ = refused;
        let frame = GridFrame::new(params.resolution_m)?;
        let drawing = || Drawing { grid: Grid::new(frame), marks: ScanMarks::new(), n_done: 0 };
        Ok(Self {
            travel,
            params,
            before: drawing(),
            after: drawing(),
            stage: Some(LaserStage::Before),
        })
    }

    /// Does a slice of the work, some tens of milliseconds, and says what comes next; `None` when all
    /// is done.
    pub fn advance(&mut self) -> Option<LaserProgress> {
        let stage = self.stage?;
        let drawing = match stage {
            LaserStage::Before => &mut self.before,
            _ => &mut self.after,
        };
        let end = (drawing.n_done + N_SCANS_SLICE).min(self.travel.scans.len());
        for scan in &self.travel.scans[drawing.n_done..end] {
            if let Some(laser) = self.travel.lasers.get(scan.laser) {
                let pose = scan.map_from_robot * laser.robot_from_sensor;
                let model = &self.params.mapping.beam_model;
                drawing.grid.insert_scan(
                    pose,
                    &laser.geometry,
                    &scan.ranges_m,
                    model,
                    &mut drawing.marks,
                );
            }
        }
        drawing.n_done = end;
        if end == self.travel.scans.len() {
            self.stage = if stage == LaserStage::Before { Some(LaserStage::After) } else { None };
        }
        let stage = self.stage?;
        let n = 2 * self.travel.scans.len().max(1);
        let share = (self.before.n_done + self.after.n_done) as f64 / n as f64;
        Some(LaserProgress { share, stage, n_accepted: 0, n_refused: 0 })
    }

    /// What was found. Before [`LaserRelaxation::advance`] said that all is done: the poses as far as
    /// they are.
    pub fn into_outcome(self) -> LaserOutcome {
        let figures = |drawing: &Drawing| LaserFigures {
            sharpness: Sharpness::of_grid(&drawing.grid),
            chi2: 0.0,
        };
        LaserOutcome {
            poses: self.travel.scans.iter().map(|scan| scan.map_from_robot).collect(),
            closures: Vec::new(),
            before: figures(&self.before),
            after: figures(&self.after),
            move_max_m: 0.0,
        }
    }
}
