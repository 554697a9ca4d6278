//! Bisectors of the different basis points of neighbouring cells.
//!
//! W. Hesselink and J. Roerdink, "Euclidean skeletons of digital image and volume data in linear time
//! by the integer medial axis transform", IEEE Transactions on Pattern Analysis and Machine
//! Intelligence 30 (2008). Time O(cells).

use crate::clearance::Clearance;
use crate::free::FreeSpace;
use crate::lattice::Lattice;
use crate::voronoi::VoronoiParams;

/// What decides where bisectors run.
pub(crate) struct Bisectors<'a> {
    lattice: Lattice,
    open: &'a FreeSpace,
    clearance: &'a Clearance,
    distance_squared_min: f64,
    cosine_max: f64,
}

impl<'a> Bisectors<'a> {
    pub(crate) fn new(
        open: &'a FreeSpace,
        clearance: &'a Clearance,
        params: &VoronoiParams,
    ) -> Self {
        let resolution_m = open.info().frame.resolution_m();
        Self {
            lattice: Lattice::new(open.info()),
            open,
            clearance,
            distance_squared_min: (params.basis_distance_min_m / resolution_m).powi(2),
            cosine_max: params.basis_angle_min_rad.cos(),
        }
    }

    /// For every cell whether it lies beside a bisector, on its nearer side: lines about one cell
    /// wide, with gaps.
    pub(crate) fn all(&self) -> Vec<bool> {
        let is_free = self.open.is_free();
        let mut are_beside = vec![false; is_free.len()];
        for index in (0..is_free.len()).filter(|&index| is_free[index]) {
            let [right, above, ..] = self.lattice.beside(index);
            for neighbor in [right, above].into_iter().filter(|&index| is_free[index]) {
                if let Some(nearer) = self.nearer(index, neighbor) {
                    are_beside[nearer] = true;
                }
            }
        }
        are_beside
    }

    /// The same of one cell.
    pub(crate) fn pass_by(&self, index: usize) -> bool {
        let is_free = self.open.is_free();
        if !is_free[index] {
            return false;
        }
        let [right, above, left, below] = self.lattice.beside(index);
        [right, above]
            .into_iter()
            .any(|other| is_free[other] && self.nearer(index, other) == Some(index))
            || [left, below]
                .into_iter()
                .any(|other| is_free[other] && self.nearer(other, index) == Some(index))
    }

    /// Which of two neighbours, the left or lower one first, is nearer to the bisector between
    /// them; `None` if none is there, or it is one of two basis points on the same wall.
    fn nearer(&self, index: usize, neighbor: usize) -> Option<usize> {
        let [own, other] = [index, neighbor].map(|cell| self.clearance.basis()[cell] as usize);
        if own == other && 0.0 < self.distance_squared_min {
            return None;
        }
        let lattice = self.lattice;
        let apart = lattice.distance_squared(own, other) as f64;
        let [a, b] = [own, other].map(|to| lattice.offset(index, to));
        if apart < self.distance_squared_min || self.cosine_max < cosine(a, b) {
            return None;
        }
        // Twice the middle of the step against twice the middle of the basis points.
        let step = lattice.offset(index, neighbor);
        let beyond =
            (0..2).map(|axis| (b[axis] - a[axis]) * (step[axis] - a[axis] - b[axis])).sum::<i64>();
        Some(if 0 <= beyond { index } else { neighbor })
    }
}

/// Cosine of the angle between two directions; 1 if one has no length.
pub(crate) fn cosine(a: [i64; 2], b: [i64; 2]) -> f64 {
    let dot = |a: [i64; 2], b: [i64; 2]| (a[0] * b[0] + a[1] * b[1]) as f64;
    let lengths = (dot(a, a) * dot(b, b)).sqrt();
    if lengths == 0.0 { 1.0 } else { dot(a, b) / lengths }
}
