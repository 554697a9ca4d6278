//! Plain expectation maximisation as in the paper: from the controls alone, odometry believed, no
//! search.

use meetpoint_geometry::{Point2, Pose};
use meetpoint_relaxation::{Area, Em, EmParams, PoseGrid, Start};

use super::iterations::Iterations;
use super::simulated::Simulated;

/// The paper's area is 90 by 90 m; this is half of it less half a cell.
const HALF_SIDE_M: f64 = 44.5;
/// The paper's cells, in metres.
const RESOLUTION_M: f64 = 1.0;
/// And its headings: five degrees.
const N_HEADINGS: u32 = 72;

/// The paper's grid, about the true path, with as many threads as there are cores to measure on.
pub(super) fn paper_params(simulated: &Simulated) -> EmParams {
    let middle = |values: &dyn Fn(&Pose) -> f64| {
        let values = simulated.poses.iter().map(values);
        let [min, max] = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[min, max], value| {
            [min.min(value), max.max(value)]
        });
        f64::midpoint(min, max)
    };
    let (x, y) = (middle(&|pose| pose.x_m), middle(&|pose| pose.y_m));
    let corner = |side_m: f64| Point2::new(x + side_m, y + side_m);
    let area = Area { min: corner(-HALF_SIDE_M), max: corner(HALF_SIDE_M) };
    let grid = PoseGrid::new(area, RESOLUTION_M, N_HEADINGS).expect("a small grid");
    EmParams { n_threads: super::TWO, n_coarse_iterations: 0, ..EmParams::button(grid) }
}

/// Iterates until it stops by itself, and judges each iteration.
pub(super) fn plain_em(simulated: &Simulated, params: &EmParams) -> Iterations {
    let mut em = Em::new(&simulated.travel, *params, Start::Controls);
    let mut found = Iterations::default();
    while !em.has_converged() {
        em.iterate();
        found.note(&em, simulated);
    }
    found
}
