//! Live mapping: the pose of every scan, matched against the grid that the scans before it drew.

mod calibration;
mod chain;
mod closure;
mod closure_search;
mod descent;
mod evidence;
mod field;
mod key_scan;
mod laser_outcome;
mod laser_relaxation;
mod laser_travel;
mod live_map;
mod matcher;
mod neighbours;
mod normal_equations;
mod observation;
mod odometry;
mod overlay;
mod params;
mod peaks;
mod placing;
mod points;
mod pose_graph;
mod pyramid;
mod relaxation_params;
mod scan_pair;
mod search;
mod sharpness;
mod state;
mod submap;
mod submap_charts;
mod submap_graph;
mod submap_match;
mod surface;
mod sweep;
mod tracker;
mod uncertainty;
mod wide_search;

pub use calibration::Calibration;
pub use chain::OdometryParams;
pub use closure::{Closure, ClosureKey, Refusal, Verdict};
pub use key_scan::KeyScanParams;
pub use laser_outcome::{LaserFigures, LaserOutcome, LaserProgress, LaserStage};
pub use laser_relaxation::LaserRelaxation;
pub use laser_travel::{DrivenScan, LaserTravel, TravelLaser};
pub use live_map::LiveMap;
pub use neighbours::NeighbourParams;
pub use observation::{
    Estimate, Observation, ObservationKind, Sensor, SensorKind, SessionConfig, SessionKey,
};
pub use params::{FieldParams, MappingParams, MatchParams, TrustParams};
pub use pose_graph::PoseGraphParams;
pub use relaxation_params::{ClosureParams, LaserRelaxationParams};
pub use sharpness::Sharpness;
pub use state::InvalidState;
pub use submap::SubmapParams;
