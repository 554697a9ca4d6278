//! Live mapping: from each observation to the robot's pose and the grid.

mod hearing;
pub(crate) mod live_map;
pub(crate) mod matcher;
pub(crate) mod observation;
pub(crate) mod odometry;
pub(crate) mod sonar_networks;
pub(crate) mod state;
pub(crate) mod tracker;
