//! The map of one firing, in the robot's own frame.

use meetpoint_geometry::Point2;
use meetpoint_occupancy::Interpretation;

use super::patch::occupied;

/// A place of the robot's frame, and how much what is heard of it differs from what is heard on average.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LocalPlace {
    pub(crate) at: Point2<f64>,
    /// `2 p - 1` for the probability of being occupied, less its mean over the local map.
    pub(crate) value: f64,
}

/// Places are so far apart, in metres: what a cone tells apart at best.
const SPACING_M: f64 = 0.1;

/// The local map of a firing: a lattice of all places of which it says something.
pub(crate) fn local_map(heard: &Interpretation) -> Vec<LocalPlace> {
    #[expect(clippy::cast_possible_truncation, reason = "some tens of places")]
    let n = (heard.reach_m() / SPACING_M).ceil() as i32;
    let lattice = (-n..=n).flat_map(|y| (-n..=n).map(move |x| (f64::from(x), f64::from(y))));
    let places = lattice.map(|(x, y)| Point2::new(SPACING_M * x, SPACING_M * y));
    let said = places.filter_map(|at| {
        let evidence = heard.evidence(at);
        (evidence != 0.0).then(|| LocalPlace { at, value: occupied(evidence) })
    });
    let mut said: Vec<LocalPlace> = said.collect();
    let mean = said.iter().map(|place| place.value).sum::<f64>() / said.len().max(1) as f64;
    for place in &mut said {
        place.value -= mean;
    }
    said
}
