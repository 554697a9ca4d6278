//! Live mapping: the pose of every scan, matched against the grid that the scans before it drew.

mod descent;
mod field;
mod live_map;
mod matcher;
mod observation;
mod odometry;
mod params;
mod points;
mod search;
mod state;
mod tracker;
mod wide_search;

pub use live_map::LiveMap;
pub use observation::{
    Estimate, Observation, ObservationKind, Sensor, SensorKind, SessionConfig, SessionKey,
};
pub use params::{FieldParams, MappingParams, MatchParams, TrustParams};
pub use state::InvalidState;
