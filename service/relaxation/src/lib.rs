//! Expectation maximisation over a robot's poses and the landmarks that it saw, whether these can
//! be told apart or not, and whatever its odometry does.
//!
//! S. Thrun, W. Burgard and D. Fox, "A probabilistic approach to concurrent mapping and
//! localization for mobile robots", Machine Learning 31 (1998).

mod arrow;
mod association;
mod backward;
mod belief;
mod branch;
mod calibration;
mod carry;
mod chain;
mod consolidation;
mod e_step;
mod em;
mod em_state;
mod error_model;
mod forward;
mod frame;
mod grid_choice;
mod hypothesis;
mod kernel;
mod key_steps;
mod landmark;
mod landmark_map;
mod landmarks;
mod layer;
mod least_squares;
mod level;
mod m_step;
mod merging;
mod missed;
mod motion;
mod motion_model;
mod no_landmark;
mod outcome;
mod past;
mod path;
mod perception;
mod pose_grid;
mod refine;
mod relaxation;
mod search;
mod side_by_side;
mod spread;
mod start;
mod stencil;
mod travel;
mod ways;
mod whole;
mod window;

pub use belief::Belief;
pub use calibration::Calibration;
pub use e_step::Posterior;
pub use em::{Em, EmParams, Figures, Start};
pub use em_state::InvalidState;
pub use error_model::ErrorModel;
pub use grid_choice::grid_for;
pub use hypothesis::Hypothesis;
pub use landmark::{Landmark, LandmarkKind};
pub use landmark_map::LandmarkMap;
pub use landmarks::PeakParams;
pub use m_step::MapParams;
pub use motion::Motion;
pub use motion_model::{MotionModel, MotionParams};
pub use outcome::{Alternative, MappedLandmark, Outcome};
pub use path::Path;
pub use perception::PerceptionParams;
pub use pose_grid::{Area, InvalidGrid, PoseCell, PoseGrid};
pub use refine::{Refined, refined};
pub use relaxation::{Progress, Relaxation, RelaxationParams, Stage};
pub use search::{Search, SearchParams};
pub use start::StartBelief;
pub use travel::{Detector, Sighting, Step, Travel};
