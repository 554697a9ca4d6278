//! Where a robot is that has no laser: the objective J of Thrun 1998, eq. (4), its sources of information,
//! and the descent to its least value.

pub(crate) mod correlation;
pub(crate) mod gradient_descent;
pub(crate) mod heard_wall;
pub(crate) mod local_map;
pub(crate) mod objective;
pub(crate) mod patch;
pub(crate) mod sonar_position;
pub(crate) mod wall_orientation;
