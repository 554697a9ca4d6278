//! Where a robot with a laser or sonars was: while it drives, and with a laser better once it has driven.
//!
//! [`LiveMap`] matches every scan against the grid that the scans before it drew; without a laser it corrects
//! odometry by the objective of Thrun 1998, eq. (4). [`LaserRelaxation`]
//! goes over whole drives again, of one robot or several: closures between submaps, a pose graph, and
//! every key scan matched with all that were taken near it.

mod closures;
mod drawing;
mod graph;
mod landmarks;
mod laser_outcome;
mod laser_relaxation;
mod live;
mod matching;
mod params;
mod position;
mod relaxation_params;
mod scans;
mod sharpness;
mod side_by_side;

pub use closures::closure::{Closure, ClosureKey, ClosureMoment, Refusal, Verdict};
pub use closures::submap::SubmapParams;
pub use graph::pose_graph::PoseGraphParams;
pub use laser_outcome::{LaserFigures, LaserOutcome, LaserProgress, LaserStage, TravelOutcome};
pub use laser_relaxation::LaserRelaxation;
pub use live::live_map::LiveMap;
pub use live::observation::{
    Estimate, Observation, ObservationKind, Sensor, SensorKind, SessionConfig, SessionKey,
};
pub use live::odometry::{Odometry, Velocity};
pub use live::sonar_networks::SonarNetworks;
pub use live::state::InvalidState;
pub use matching::field::Field;
pub use matching::peaks::{PeakParams, peaks_in_window};
pub use matching::pyramid::Pyramid;
pub use matching::search::{Candidate, Window};
pub use params::{
    DescentParams, FieldParams, MappingParams, MatchParams, PositionParams, SonarParams,
    TrustParams, WallParams,
};
pub use relaxation_params::{ClosureParams, LaserRelaxationParams};
pub use scans::calibration::Calibration;
pub use scans::chain::OdometryParams;
pub use scans::key_scan::KeyScanParams;
pub use scans::landmark_sighting::LandmarkSighting;
pub use scans::laser_travel::{DrivenScan, LaserTravel, PlacedTravel, TravelLaser};
pub use scans::neighbours::NeighbourParams;
pub use sharpness::Sharpness;
pub use side_by_side::side_by_side;
