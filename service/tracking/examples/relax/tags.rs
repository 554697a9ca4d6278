//! Named tags along a log, as a camera that is not well calibrated would see them.

use std::collections::BTreeMap;

use meetpoint_geometry::{Point2, Pose};
use meetpoint_tracking::LandmarkSighting;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Tags hang in the middle of squares with this edge, in metres, wherever the robot comes.
const EDGE_M: f64 = 6.0;
/// The camera sees them so far, in metres, and to half of its field of view, in radians.
const SEEN_MAX_M: f64 = 5.0;
const HALF_FIELD_OF_VIEW_RAD: f64 = 1.0;
/// All it sees is a decimetre too far to the left, and up to a tenth of the range off.
const LEFT_M: f64 = 0.1;
const RANGE_SHARE: f64 = 0.1;
/// One sighting in so many has the name of another tag.
const MISREAD_EACH: u32 = 100;

/// What is seen from these poses.
pub(crate) fn sightings(poses: &[Pose]) -> Vec<LandmarkSighting> {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut names: BTreeMap<[i64; 2], usize> = BTreeMap::new();
    let mut seen = Vec::new();
    for (scan, pose) in poses.iter().enumerate() {
        #[expect(clippy::cast_possible_truncation, reason = "of a building")]
        let [x, y] = [pose.x_m, pose.y_m].map(|along_m| (along_m / EDGE_M).floor() as i64);
        for square in (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| [x + dx, y + dy])) {
            let [x_m, y_m] = square.map(|along| (along as f64 + 0.5) * EDGE_M);
            let there = pose.inverse() * Point2::new(x_m, y_m);
            let range_m = there.coords.norm();
            if SEEN_MAX_M < range_m || HALF_FIELD_OF_VIEW_RAD < there.y.atan2(there.x).abs() {
                continue;
            }
            let n_names = names.len();
            let name = *names.entry(square).or_insert(n_names);
            let is_misread = rng.random_ratio(1, MISREAD_EACH);
            let landmark = if is_misread { rng.random_range(0..names.len()) } else { name };
            let mut off_m = || rng.random_range(-RANGE_SHARE..RANGE_SHARE) * range_m;
            let robot_from_landmark = Point2::new(there.x + off_m(), there.y + off_m() + LEFT_M);
            let std_m = 0.2_f64.hypot(0.05 * range_m);
            seen.push(LandmarkSighting { scan, robot_from_landmark, landmark, std_m });
        }
    }
    seen
}
