//! How well the map of one firing agrees with the map, as a function of the robot's pose.
//!
//! ```text
//! corr(pose) = sum over places i of  l_i g(pose * p_i)  /  sqrt(n sum over i of l_i²)
//! ```
//!
//! `l_i` is the local map's value at `p_i` less its mean, `g` the map's value, interpolated; by Cauchy and
//! Schwarz it lies in -1..=1. S. Thrun, "Learning metric-topological maps for indoor mobile robot
//! navigation", Artificial Intelligence 99 (1998), section 2.3 (ii) and eq. (3). Two departures: the
//! interpolation is bilinear, since the weights of eq. (3) as printed are largest for the farthest corner;
//! and it is the map that is interpolated, at places of the local map, so that the sum has as many terms
//! whatever the map's resolution. It is not divided by the spread of `g`, which would make a place of
//! which little is known look good. Time O(places).

use meetpoint_geometry::Pose;

use super::local_map::LocalPlace;
use super::patch::Patch;

/// The correlation at a pose, and its derivatives along x, y (per metre) and by theta (per radian). 0 for no
/// places, or places that are all alike.
pub(crate) fn correlation(patch: &Patch, local: &[LocalPlace], pose: Pose) -> (f64, [f64; 3]) {
    let (sin, cos) = pose.theta_rad.sin_cos();
    let (mut sum, mut slope, mut square) = (0.0, [0.0; 3], 0.0);
    for &LocalPlace { at, value } in local {
        let (x, y) = (cos * at.x - sin * at.y, sin * at.x + cos * at.y);
        let (there, along_x, along_y) = patch.interpolate([pose.x_m + x, pose.y_m + y].into());
        sum += value * there;
        slope[0] += value * along_x;
        slope[1] += value * along_y;
        slope[2] += value * (x * along_y - y * along_x);
        square += value * value;
    }
    let scale = (local.len() as f64 * square).sqrt();
    if scale == 0.0 {
        return (0.0, [0.0; 3]);
    }
    (sum / scale, slope.map(|part| part / scale))
}
