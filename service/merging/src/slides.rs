//! Whether the walls let the newcomer slide.

use meetpoint_geometry::Point2;
use nalgebra::Vector3;

use crate::evidence::Evidence;
use crate::part::Part;
use crate::refinement::{Refined, turned_about};
use crate::rivals::margin;

/// How far the newcomer is slid each way, in metres.
const SLIDES_M: [f64; 5] = [0.4, 0.8, 1.4, 2.2, 3.2];

/// The least logarithm of the odds of a place against the newcomer's having slid in the direction in
/// which its walls hold it least, and how far that is in metres.
pub(crate) fn least_margin(
    (site, newcomer): (&Part, &Part),
    place: &Refined,
    (middle, evidence): (Point2<f64>, &Evidence),
    n_walls_max: usize,
) -> (f64, f64) {
    let (_, along) = place.weakest();
    let slid = |slide_m: f64| {
        let step = Vector3::new(along.x * slide_m, along.y * slide_m, 0.0);
        let pose = turned_about(place.site_from_newcomer, middle, step);
        (margin(evidence, &Evidence::new((site, newcomer), pose, n_walls_max)), slide_m.abs())
    };
    let both_ways = SLIDES_M.iter().flat_map(|&slide_m| [slide_m, -slide_m]);
    both_ways.map(slid).min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((f64::INFINITY, 0.0))
}
