//! How much both maps have seen.

use meetpoint_geometry::Pose;

use crate::ground::Known;
use crate::part::Part;

/// Places that are asked, at most, about.
const N_ASKED_MAX: f64 = 10_000.0;

/// Area that both have seen, in square metres, and as a share of what the smaller has.
pub(crate) fn overlap(site: &Part, newcomer: &Part, site_from_newcomer: Pose) -> (f64, f64) {
    let edge_m = newcomer.ground.edge_m();
    let n_known = newcomer.known_m2() / (edge_m * edge_m);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small number")]
    let stride = ((n_known / N_ASKED_MAX).sqrt().ceil() as usize).max(1);
    let asked = newcomer.ground.known_points(stride);
    let is_known = |point| site.ground.at(site_from_newcomer * point) != Known::Unknown;
    let n_both = asked.iter().filter(|&&point| is_known(point)).count();
    let share = n_both as f64 / asked.len().max(1) as f64;
    let both_m2 = share * newcomer.known_m2();
    let smaller_m2 = newcomer.known_m2().min(site.known_m2()).max(edge_m * edge_m);
    (both_m2, (both_m2 / smaller_m2).min(1.0))
}
