//! Voronoi diagram of the walls.
//!
//! The cells with two basis points far apart, thinned to lines one cell wide that hang together as
//! the space does:
//!
//! ```text
//! V ⊇ { p : a neighbour's basis point lies beyond an angle and a length from that of p }
//! ```
//!
//! S. Thrun, Artificial Intelligence 99 (1998), section 3.1 (ii), asks for two *different*
//! equidistant basis points; on a grid every cell of a wall is a basis point of its own, so that
//! "different" needs a measure. Cells are peeled off from the walls inwards, a cell only if the
//! topology stays the same: C. Pudney, "Distance-ordered homotopic thinning", Computer Vision and
//! Image Understanding 72 (1998). Time O(cells log cells), space O(cells).

use meetpoint_geometry::GridInfo;

use crate::clearance::Clearance;
use crate::free::FreeSpace;
use crate::lattice::Lattice;

/// Tunables of [`voronoi`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VoronoiParams {
    /// Two basis points are different if seen from their cell they lie at least so far apart, in
    /// radians ...
    pub basis_angle_min_rad: f64,
    /// ... and at least so far from each other, in metres.
    pub basis_distance_min_m: f64,
}

/// The diagram's cells.
#[derive(Clone, Debug)]
pub struct Voronoi {
    info: GridInfo,
    is_on: Vec<bool>,
    cells: Vec<usize>,
}

impl Voronoi {
    /// Which cells were asked: those of the free space.
    pub fn info(&self) -> GridInfo {
        self.info
    }

    /// One word a cell of [`Self::info`]: does it lie on the diagram?
    pub fn is_on(&self) -> &[bool] {
        &self.is_on
    }

    /// The cells on the diagram, by index, ascending.
    pub fn cells(&self) -> &[usize] {
        &self.cells
    }

    /// Lines of the diagram that leave a cell: 0 for a point, 1 at an end, 2 along a line, 3 and
    /// more at a junction. Said of cells of the diagram.
    ///
    /// # Panics
    /// If `index` lies outside or on the rim; no cell of the diagram does.
    pub fn degree(&self, index: usize) -> usize {
        let on = Lattice::new(self.info).around(index).map(|neighbor| self.is_on[neighbor]);
        (0..8).filter(|&at| on[at] && !on[(at + 7) % 8]).count()
    }

    /// Takes cells off the diagram.
    pub(crate) fn take_off(&mut self, cells: &[usize]) {
        for &index in cells {
            self.is_on[index] = false;
        }
        self.cells.retain(|&index| self.is_on[index]);
    }
}

/// The Voronoi diagram of the walls of `open`.
pub fn voronoi(open: &FreeSpace, clearance: &Clearance, params: &VoronoiParams) -> Voronoi {
    let anchors = anchors(open, clearance, params);
    let mut is_on = open.is_free().to_vec();
    let mut order: Vec<usize> = (0..is_on.len()).filter(|&index| is_on[index]).collect();
    order.sort_unstable_by_key(|&index| (clearance.squared()[index], index));
    let lattice = Lattice::new(open.info());
    let mut thinning = Thinning { lattice, clearance, is_on: &mut is_on };
    thinning.peel(&order, |index, _| anchors[index]);
    thinning.peel(&order, |index, n_neighbors| n_neighbors < 2 && anchors[index]);
    let cells = (0..is_on.len()).filter(|&index| is_on[index]).collect();
    Voronoi { info: open.info(), is_on, cells }
}

/// Cells beside the bisector of two different basis points, on its nearer side: lines about one
/// cell wide, with gaps. W. Hesselink and J. Roerdink, "Euclidean skeletons of digital image and
/// volume data in linear time by the integer medial axis transform", IEEE Transactions on Pattern
/// Analysis and Machine Intelligence 30 (2008).
fn anchors(open: &FreeSpace, clearance: &Clearance, params: &VoronoiParams) -> Vec<bool> {
    let lattice = Lattice::new(open.info());
    let resolution_m = open.info().frame.resolution_m();
    let distance_squared_min = (params.basis_distance_min_m / resolution_m).powi(2);
    let cosine_max = params.basis_angle_min_rad.cos();
    let basis = |index: usize| clearance.basis()[index] as usize;
    let mut anchors = vec![false; open.is_free().len()];
    for index in (0..anchors.len()).filter(|&index| open.is_free()[index]) {
        let [right, above, ..] = lattice.beside(index);
        for neighbor in [right, above].into_iter().filter(|&index| open.is_free()[index]) {
            let (own, other) = (basis(index), basis(neighbor));
            let apart = lattice.distance_squared(own, other) as f64;
            if apart < distance_squared_min
                || cosine_max < cosine(lattice.offset(index, own), lattice.offset(index, other))
            {
                continue;
            }
            // Twice the middle of the step against twice the middle of the basis points.
            let [a, b, step] = [own, other, neighbor].map(|to| lattice.offset(index, to));
            let beyond = (0..2)
                .map(|axis| (b[axis] - a[axis]) * (step[axis] - a[axis] - b[axis]))
                .sum::<i64>();
            anchors[if 0 <= beyond { index } else { neighbor }] = true;
        }
    }
    anchors
}

/// Cosine of the angle between two directions; 1 if one has no length.
pub(crate) fn cosine(a: [i64; 2], b: [i64; 2]) -> f64 {
    let dot = |a: [i64; 2], b: [i64; 2]| (a[0] * b[0] + a[1] * b[1]) as f64;
    let lengths = (dot(a, a) * dot(b, b)).sqrt();
    if lengths == 0.0 { 1.0 } else { dot(a, b) / lengths }
}

struct Thinning<'a> {
    lattice: Lattice,
    clearance: &'a Clearance,
    is_on: &'a mut [bool],
}

impl Thinning<'_> {
    /// Takes cells off in the given order, each if the topology allows it and `is_kept` does not
    /// forbid it; a cell that was refused is asked again when a neighbour has gone.
    fn peel(&mut self, order: &[usize], is_kept: impl Fn(usize, usize) -> bool) {
        let key = |clearance: &Clearance, index: usize| (clearance.squared()[index], index);
        let mut again = vec![];
        for &next in order {
            again.push(next);
            while let Some(index) = again.pop() {
                if !self.is_on[index] || !self.is_simple(index, &is_kept) {
                    continue;
                }
                self.is_on[index] = false;
                let passed = |&neighbor: &usize| {
                    self.is_on[neighbor]
                        && key(self.clearance, neighbor) < key(self.clearance, next)
                };
                again.extend(self.lattice.around(index).into_iter().filter(passed));
            }
        }
    }

    /// Whether the cell can go without tearing, joining or emptying anything: its neighbours on
    /// the diagram hang together (8-connected), and so do those off it (4-connected).
    fn is_simple(&self, index: usize, is_kept: &impl Fn(usize, usize) -> bool) -> bool {
        let on = self.lattice.around(index).map(|neighbor| self.is_on[neighbor]);
        let n_neighbors = on.iter().filter(|&&is_on| is_on).count();
        // Yokoi's connectivity number.
        let crossings =
            [0, 2, 4, 6].iter().filter(|&&at| !on[at] && (on[at + 1] || on[(at + 2) % 8])).count();
        crossings == 1 && !is_kept(index, n_neighbors)
    }
}
