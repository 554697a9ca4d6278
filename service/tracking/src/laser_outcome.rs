//! What a relaxation of a laser session tells: how far it is, and what it found.

use meetpoint_geometry::Pose;

use crate::closures::closure::Closure;
use crate::scans::calibration::Calibration;
use crate::sharpness::Sharpness;

/// What a relaxation is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LaserStage {
    /// Drawing the map by the live poses, to measure it, beside matching each key scan with the one before.
    Before,
    /// Matching each key scan with several before it.
    Chain,
    /// Looking for closures.
    Closures,
    /// Matching each key scan with all that were taken near it.
    Sweeps,
    /// Matching each key scan with the map that all of them draw.
    MapMatching,
    /// Placing the scans between key scans, beside drawing the map by the relaxed poses.
    Placing,
    /// Measuring the map by the relaxed poses.
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
    /// Entropy of the grid that the poses draw; `None` where no map was drawn.
    pub sharpness: Option<Sharpness>,
    /// Sum over all constraints of the last pose graph of the square of their residuals in units of
    /// their covariance, at these poses.
    pub chi2: f64,
}

/// What a relaxation found.
#[derive(Clone, Debug, PartialEq)]
pub struct LaserOutcome {
    /// Of each travel, in the order in which they were given.
    pub travels: Vec<TravelOutcome>,
    /// Every closure that was considered, within a travel or between two, accepted or not, by key.
    pub closures: Vec<Closure>,
    /// The map of all travels by live poses.
    pub before: LaserFigures,
    /// The map by the relaxed ones.
    pub after: LaserFigures,
}

/// What a relaxation found of one travel.
#[derive(Clone, Debug, PartialEq)]
pub struct TravelOutcome {
    /// Pose of the robot at each scan of the travel: `map_from_robot`. The first key scan of the first
    /// travel stays where live mapping had it; a travel that meets none of the others, where it was.
    pub poses: Vec<Pose>,
    /// The farthest that a pose moved, in metres.
    pub move_max_m: f64,
    /// How its odometry errs in scale; nothing to correct without odometry.
    pub calibration: Calibration,
    /// Sightings of landmarks that the poses rest on: of landmarks that were seen from several places.
    pub n_sightings_in_graph: usize,
    /// Sightings of landmarks that were seen from several places, but not where they were: wrong names,
    /// or several landmarks of one name.
    pub n_sightings_doubted: usize,
}
