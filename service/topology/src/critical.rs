//! Critical points: where space is locally narrowest.
//!
//! ```text
//! p is critical if it lies on the diagram and D(q) >= D(p) for all q on it within epsilon of p
//! ```
//!
//! its critical line will join its two basis points. S. Thrun, Artificial Intelligence 99 (1998), section
//! 3.1 (iii). Where the clearance stays the same along the diagram (a corridor, a door in
//! a thick wall) all its cells are minima; the middle one stands for them. Epsilon is measured
//! along the diagram, in metres. Time O(cells of the diagram · epsilon), space O(those cells).

use std::collections::{BTreeSet, VecDeque};

use crate::bisectors::cosine;
use crate::clearance::Clearance;
use crate::lattice::Lattice;
use crate::neighborhood::Neighborhood;
use crate::voronoi::Voronoi;

/// Tunables of [`critical_points`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CriticalParams {
    /// Reach of "locally", in metres along the diagram (the paper's epsilon).
    pub epsilon_m: f64,
    /// The two basis points lie at least so far apart as seen from the point, in radians. In the
    /// plane it is a half circle; cells and rough walls leave less of it.
    pub opening_min_rad: f64,
}

/// A point of the diagram where the clearance is a local minimum.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct CriticalPoint {
    /// The cell, by its index in the free space.
    pub index: usize,
    /// The obstacle cells on its two sides that its critical line joins, by index.
    pub basis: [usize; 2],
}

/// The critical points of a diagram, in the order of the minima that they are the middles of.
pub fn critical_points(
    voronoi: &Voronoi,
    clearance: &Clearance,
    params: &CriticalParams,
) -> Vec<CriticalPoint> {
    let minima = minima(voronoi, clearance, params, voronoi.cells().iter().copied());
    points_at(&minima, clearance, params)
}

/// Those of some cells of a diagram, in the same order, where the clearance is a local minimum.
pub(crate) fn minima(
    voronoi: &Voronoi,
    clearance: &Clearance,
    params: &CriticalParams,
    cells: impl Iterator<Item = usize>,
) -> Vec<usize> {
    let reach = reach(voronoi, params);
    let mut neighborhood = Neighborhood::new(voronoi);
    let squared = clearance.squared();
    cells
        .filter(|&index| {
            voronoi.degree(index) == 2
                && neighborhood.within(index, reach).all(|other| squared[index] <= squared[other])
        })
        .collect()
}

/// Brings `minima` to what they are of a diagram now, given all cells that came onto it, left it,
/// or lie on it and have another clearance.
pub(crate) fn update_minima(
    minima: &mut Vec<usize>,
    voronoi: &Voronoi,
    clearance: &Clearance,
    params: &CriticalParams,
    changed: &[usize],
) {
    let lattice = Lattice::new(voronoi.info());
    // No way along the diagram is shorter than the larger of columns and rows.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates at 0")]
    let around = (reach(voronoi, params).ceil() as usize).max(1);
    let mut is_near = vec![false; voronoi.is_on().len()];
    for &index in changed {
        lattice.for_each_row(index, around, |cells| is_near[cells].fill(true));
    }
    let again = voronoi.cells().iter().copied().filter(|&index| is_near[index]);
    let again = self::minima(voronoi, clearance, params, again);
    minima.retain(|&index| !is_near[index]);
    minima.extend(again);
    minima.sort_unstable();
}

/// The paper's epsilon, in cells.
fn reach(voronoi: &Voronoi, params: &CriticalParams) -> f64 {
    params.epsilon_m / voronoi.info().frame.resolution_m()
}

/// The critical points among the minima of the clearance along a diagram.
pub(crate) fn points_at(
    minima: &[usize],
    clearance: &Clearance,
    params: &CriticalParams,
) -> Vec<CriticalPoint> {
    let lattice = Lattice::new(clearance.info());
    let points = middles(lattice, minima).into_iter();
    points
        .filter_map(|index| {
            let (basis, opening_rad) = widest_basis(lattice, clearance, index);
            (params.opening_min_rad <= opening_rad).then_some(CriticalPoint { index, basis })
        })
        .collect()
}

/// The middle cell of every connected run of cells.
fn middles(lattice: Lattice, cells: &[usize]) -> Vec<usize> {
    let mut left: BTreeSet<usize> = cells.iter().copied().collect();
    let mut middles = vec![];
    while let Some(start) = left.pop_first() {
        let mut run = VecDeque::from([start]);
        // Grown from both ends in turn, the run lies in the order of the line.
        for is_front in [false, true] {
            while let Some(&end) = if is_front { run.front() } else { run.back() } {
                let Some(next) = lattice.around(end).into_iter().find(|next| left.remove(next))
                else {
                    break;
                };
                if is_front { run.push_front(next) } else { run.push_back(next) }
            }
        }
        middles.push(run[run.len() / 2]);
    }
    middles
}

/// The two basis points of a cell on the diagram, by index: its own, and of those of its neighbours
/// the one farthest around.
///
/// # Panics
/// If `index` lies outside or on the rim; no cell of the diagram does.
pub fn basis_points(clearance: &Clearance, index: usize) -> [usize; 2] {
    widest_basis(Lattice::new(clearance.info()), clearance, index).0
}

/// [`basis_points`], and the angle between the two, in radians.
fn widest_basis(lattice: Lattice, clearance: &Clearance, index: usize) -> ([usize; 2], f64) {
    let basis = |index: usize| clearance.basis()[index] as usize;
    let own = basis(index);
    let cosine_to = |other: usize| cosine(lattice.offset(index, own), lattice.offset(index, other));
    let others = lattice.around(index).map(basis);
    let far = others
        .into_iter()
        .min_by(|&a, &b| cosine_to(a).total_cmp(&cosine_to(b)).then(a.cmp(&b)))
        .unwrap_or(own);
    ([own, far], cosine_to(far).clamp(-1.0, 1.0).acos())
}
