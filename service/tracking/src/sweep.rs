//! Sweeps: every key scan matched with those taken near it, all poses found together.
//!
//! A sweep makes of each pair of neighbours the two edges that say what one saw of the walls of the
//! other ([`pair_form`]) and of each step the edge of its odometry, and optimises the poses over all of
//! them. Since matching is linearised anew with every sweep, the sweeps together are Gauss-Newton steps
//! of one least-squares problem over all poses and all that was seen: F. Lu, E. Milios (1997), with
//! distances from points to walls in place of those between points.

use meetpoint_geometry::Pose;
use nalgebra::Matrix3;

use crate::key_scan::KeyScan;
use crate::pose_graph::Edge;
use crate::scan_pair::{PairParams, moved, pair_form};

/// Two key scans that may have seen the same walls. Invariant: the first was taken before.
pub(crate) type Pair = (usize, usize);

/// The edges of a pair at the poses as they are: what the earlier scan saw of the later's walls, and
/// the other way round. Edges without information if they saw nothing in common.
pub(crate) fn pair_edges(
    keys: &[KeyScan],
    poses: &[Pose],
    (a, b): Pair,
    params: &PairParams,
    n_facets_max: usize,
) -> [Edge; 2] {
    [(a, b), (b, a)].map(|(from, to)| {
        let seen = poses[from].step_to(poses[to]);
        let (here, there) = (&keys[from].surface, &keys[to].surface);
        let stride = there.facets().len().div_ceil(n_facets_max.max(1));
        let form = pair_form(here, there, seen, params, stride);
        let met = N_MET_MIN <= form.n_met && MET_SHARE_MIN <= form.met_share();
        let edge = Edge {
            from,
            to,
            from_to: seen,
            information: Matrix3::zeros(),
            chi2_turn: f64::INFINITY,
        };
        if !met {
            return edge;
        }
        Edge { from_to: moved(seen, form.step()), information: form.hessian, ..edge }
    })
}

/// Pairs with fewer facets that met say nothing.
const N_MET_MIN: u32 = 12;
/// The same for a smaller share of those that were asked.
const MET_SHARE_MIN: f64 = 0.15;
