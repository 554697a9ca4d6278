//! The walls on the left and right of one who travels, and the control law they allow.
//!
//! ```text
//! MIDLINE        left + right <= width
//! LEFT, RIGHT    the nearer of the two is within range
//! BLIND STEP     neither is
//! ```
//!
//! HSSH 2004, section III-C, has the first two laws for offices; that a robot goes straight on where no
//! wall is near is from B. Kuipers and Y.-T. Byun, "A robust, qualitative method for robot spatial
//! learning", AAAI 1988.

use std::f64::consts::FRAC_PI_2;

use meetpoint_geometry::Pose;
use meetpoint_topology::FreeSpace;

use crate::local::params::LawParams;
use crate::local::sight::free_way_m;
use crate::star::ControlLaw;

/// Two walls that are so much nearer to each other than to one who travels are as near, in metres.
const AS_NEAR_M: f64 = 0.1;

/// The law of one who travels there, in that direction.
pub(crate) fn control_law(space: &FreeSpace, at: Pose, params: &LawParams) -> ControlLaw {
    let sight_m = params.midline_width_max_m.max(params.wall_range_max_m) + AS_NEAR_M;
    let way_m = |side_rad: f64| free_way_m(space, at.position(), at.theta_rad + side_rad, sight_m);
    let (left_m, right_m) = (way_m(FRAC_PI_2), way_m(-FRAC_PI_2));
    if left_m + right_m <= params.midline_width_max_m {
        ControlLaw::Midline
    } else if left_m.min(right_m) > params.wall_range_max_m {
        ControlLaw::BlindStep
    } else if left_m <= right_m + AS_NEAR_M {
        ControlLaw::LeftWall
    } else {
        ControlLaw::RightWall
    }
}
