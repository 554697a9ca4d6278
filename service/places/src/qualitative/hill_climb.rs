//! The next step of the search for a distinctive place.
//!
//! Seen from a place, a small step `s` changes the distance `d` to a near object in direction `u`
//! (of length 1) by `-u s`. So the differences of distances vanish, to first order, at
//!
//! ```text
//! s  minimising  sum over objects of (d - u s - c)²  +  damping |s|²
//! ```
//!
//! where `c` is the mean of `d - u s`, or the distance at which walls are walked along where open
//! space leaves it open. One step of Gauss and Newton instead of trying all around: KB 1988,
//! section 2.2, says what is climbed, not how.

use meetpoint_geometry::Vector2;

use super::distinctiveness::Goal;
use super::surroundings::{Scale, Surroundings};

/// Longest step, in metres: no farther than what is seen now tells.
const STEP_MAX_M: f64 = 0.25;
/// Keeps steps short in directions of which the objects say little.
const DAMPING: f64 = 0.05;

/// The step to take, in metres in the frame of headings; its length tells how far from the summit
/// the robot is. `None` where the goal is none that can be climbed.
pub fn climb(around: &Surroundings, goal: Goal, scale: &Scale) -> Option<Vector2<f64>> {
    let n = around.objects.len() as f64;
    let mean_m = around.objects.iter().map(|object| object.distance_m).sum::<f64>() / n;
    let step = match goal {
        Goal::Passage | Goal::ComeCloser => return None,
        Goal::EqualDistances => {
            let mean = around.objects.iter().map(|object| towards(object.heading_rad)).sum();
            leveling(around, mean_m, mean, n)
        }
        Goal::WallDistances => {
            // Between two objects on either side the way out is level: follow it.
            let away_m = (scale.wall_m - mean_m).clamp(0.0, STEP_MAX_M / 2.0);
            let out = around.open_space_rad.map_or_else(Vector2::zeros, towards) * away_m;
            leveling(around, scale.wall_m, Vector2::zeros(), n) + out
        }
    };
    let length_m = step.norm();
    Some(if STEP_MAX_M < length_m { step * (STEP_MAX_M / length_m) } else { step })
}

/// The step of the equation, where a step `s` leaves distances level at `c = level_m - mean · s`.
fn leveling(around: &Surroundings, level_m: f64, mean: Vector2<f64>, n: f64) -> Vector2<f64> {
    let mean = mean / n;
    let (mut xx, mut xy, mut yy) = (DAMPING, 0.0, DAMPING);
    let mut right = Vector2::zeros();
    for object in &around.objects {
        let u = towards(object.heading_rad) - mean;
        xx += u.x * u.x;
        xy += u.x * u.y;
        yy += u.y * u.y;
        right += u * (object.distance_m - level_m);
    }
    let determinant = xx * yy - xy * xy;
    Vector2::new(yy * right.x - xy * right.y, xx * right.y - xy * right.x) / determinant
}

fn towards(heading_rad: f64) -> Vector2<f64> {
    Vector2::new(heading_rad.cos(), heading_rad.sin())
}
