//! Probabilities of displacements on the grid, a table for every heading.
//!
//! A displacement between nodes and headings is split among the eight around it by linear
//! interpolation, so that means are kept exactly. Only the headings of a quarter of a turn have
//! tables; the others' are these turned by right angles (TBF98 section 5, "exploiting symmetry").

use crate::layer::{Layer, tight};
use crate::pose_grid::PoseGrid;
use crate::spread::Spread;
use crate::window::Window;

/// Probabilities of all displacements that turn by `turn` headings.
#[derive(Clone, Debug)]
pub(crate) struct Slab {
    /// Headings further, to either side.
    pub(crate) turn: i32,
    /// Probabilities by displacement, in nodes.
    pub(crate) table: Layer,
}

/// Where one gets to from a cell, and how probably.
#[derive(Clone, Debug)]
pub(crate) struct Kernel {
    /// Slabs by turn, for every heading of the first quarter.
    quarter: Vec<Vec<Slab>>,
}

impl Kernel {
    /// From possible displacements as the robot sees them; those that lead off any grid of this
    /// size are left out. Entries below `share` of the largest are dropped, and the others made to
    /// sum to one again.
    pub(crate) fn new(grid: &PoseGrid, spreads: &[Spread], share: f32) -> Self {
        let quarter =
            grid.quarter_headings().map(|heading| slabs(grid, spreads, heading, share)).collect();
        Self { quarter }
    }

    /// The tables of a heading, and by how many right angles they have to be turned.
    pub(crate) fn slabs(&self, grid: &PoseGrid, heading: u32) -> (u32, &[Slab]) {
        let (n_quarters, base) = grid.quarter(heading);
        (n_quarters, &self.quarter[base as usize])
    }

    /// The largest single probability.
    pub(crate) fn weight_max(&self) -> f32 {
        let weights = self.quarter.iter().flatten().flat_map(|slab| slab.table.weights());
        weights.fold(0.0, |max, &weight| max.max(weight))
    }

    /// Entries of the tables of one heading, on average.
    pub(crate) fn n_entries(&self) -> usize {
        let all: usize = self.quarter.iter().flatten().map(|slab| slab.table.weights().len()).sum();
        all / self.quarter.len().max(1)
    }

    /// Bytes held.
    pub(crate) fn n_bytes(&self) -> usize {
        self.quarter.iter().flatten().map(|slab| slab.table.n_bytes()).sum()
    }
}

/// A displacement counted in nodes and headings.
struct Displacement {
    position: [f64; 3],
    weight: f64,
}

fn slabs(grid: &PoseGrid, spreads: &[Spread], heading_rad: f64, share: f32) -> Vec<Slab> {
    let (sin, cos) = heading_rad.sin_cos();
    let displacements: Vec<Displacement> = spreads
        .iter()
        .map(|spread| {
            let (x, y, turn) = grid.in_cells(spread);
            let position = [cos * x - sin * y, sin * x + cos * y, turn].map(on_node);
            Displacement { position, weight: spread.weight }
        })
        .filter(|displacement| displacement.stays_on(grid))
        .collect();
    let mut table = Table::around(&displacements);
    for displacement in &displacements {
        table.split(displacement);
    }
    table.into_slabs(share)
}

impl Displacement {
    /// Whether it may end on a grid that it begins on; not if it is not finite.
    fn stays_on(&self, grid: &PoseGrid) -> bool {
        let Window { width, height, .. } = grid.window();
        let [x, y, turn] = self.position;
        x.abs() <= f64::from(width)
            && y.abs() <= f64::from(height)
            && turn.abs() <= 2.0 * f64::from(grid.n_headings())
    }
}

/// Rounding must not tell a quarter's first heading from the others.
fn on_node(position: f64) -> f64 {
    let nearest = position.round();
    if (position - nearest).abs() < 1e-9 { nearest } else { position }
}

/// Sums over nodes and headings while displacements are being split.
struct Table {
    first: [i32; 3],
    size: [usize; 3],
    sums: Vec<f64>,
}

impl Table {
    #[expect(clippy::cast_possible_truncation, reason = "far displacements saturate")]
    #[expect(clippy::cast_sign_loss, reason = "not negative: max is at least min")]
    fn around(displacements: &[Displacement]) -> Self {
        let (mut first, mut size) = ([0; 3], [1; 3]);
        for axis in 0..3 {
            let along = displacements.iter().map(|displacement| displacement.position[axis]);
            let min = along.clone().fold(f64::INFINITY, f64::min).floor();
            let max = along.fold(f64::NEG_INFINITY, f64::max).floor();
            if min <= max {
                first[axis] = min as i32;
                size[axis] = (max - min) as usize + 2;
            }
        }
        Self { first, size, sums: vec![0.0; size.iter().product()] }
    }

    #[expect(clippy::cast_possible_truncation, reason = "inside the table, see around()")]
    #[expect(clippy::cast_sign_loss, reason = "inside the table, see around()")]
    fn split(&mut self, displacement: &Displacement) {
        let (mut at, mut part) = ([0_usize; 3], [0.0; 3]);
        for axis in 0..3 {
            let offset = displacement.position[axis] - f64::from(self.first[axis]);
            at[axis] = offset.floor() as usize;
            part[axis] = offset - offset.floor();
        }
        for corner in 0..8_usize {
            let step = [corner & 1, corner >> 1 & 1, corner >> 2];
            let mut weight = displacement.weight;
            for axis in 0..3 {
                weight *= if step[axis] == 1 { part[axis] } else { 1.0 - part[axis] };
            }
            let row = (at[2] + step[2]) * self.size[1] + at[1] + step[1];
            self.sums[row * self.size[0] + at[0] + step[0]] += weight;
        }
    }

    /// Cut into slabs by turn, each without the empty rows and columns around it.
    #[expect(clippy::cast_possible_truncation, reason = "probabilities in single precision")]
    #[expect(clippy::cast_possible_wrap, reason = "grids have far fewer nodes")]
    fn into_slabs(self, share: f32) -> Vec<Slab> {
        let [width, height, _] = self.size;
        let limit = self.sums.iter().fold(0.0_f64, |max, &sum| max.max(sum)) * f64::from(share);
        let kept = |&sum: &f64| if sum < limit { 0.0 } else { sum };
        let total: f64 = self.sums.iter().map(kept).sum();
        let window = Window {
            x: self.first[0],
            y: self.first[1],
            width: width as i32,
            height: height as i32,
        };
        let layers = self.sums.chunks(width * height).zip(self.first[2]..);
        let slabs = layers.map(|(sums, turn)| {
            let weights: Vec<f32> = sums.iter().map(|sum| (kept(sum) / total) as f32).collect();
            let around = tight(window, &weights);
            Slab { turn, table: Layer::new(window, weights).cut(around) }
        });
        slabs.filter(|slab| !slab.table.is_empty()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pose_grid::Area;
    use meetpoint_geometry::Point2;

    fn grid() -> PoseGrid {
        let area = Area { min: Point2::new(-5.0, -5.0), max: Point2::new(5.0, 5.0) };
        PoseGrid::new(area, 0.5, 72).expect("a grid")
    }

    #[test]
    fn means_are_kept() {
        let turn_rad = 0.3 * grid().heading_step_rad();
        let spread = Spread { x_m: 1.7, y_m: -0.4, turn_rad, weight: 1.0 };
        let kernel = Kernel::new(&grid(), &[spread], 0.0);
        for heading in 0..18 {
            let (_, slabs) = kernel.slabs(&grid(), heading);
            let (sin, cos) = grid().heading_rad(heading).sin_cos();
            let expected = (2.0 * (cos * 1.7 + sin * 0.4), 2.0 * (sin * 1.7 - cos * 0.4), 0.3);
            let mut mean = (0.0, 0.0, 0.0);
            for slab in slabs {
                for (x, y, weight) in slab.table.entries() {
                    let weight = f64::from(weight);
                    mean.0 += weight * f64::from(x);
                    mean.1 += weight * f64::from(y);
                    mean.2 += weight * f64::from(slab.turn);
                }
            }
            let off = (mean.0 - expected.0).abs() + (mean.1 - expected.1).abs();
            assert!(off + (mean.2 - expected.2).abs() < 1e-5, "{mean:?} is not {expected:?}");
        }
    }

    #[test]
    fn no_displacement_stays() {
        let spread = Spread { x_m: 0.0, y_m: 0.0, turn_rad: 0.0, weight: 1.0 };
        let kernel = Kernel::new(&grid(), &[spread], 0.0);
        assert_eq!(kernel.n_entries(), 1, "one entry");
        assert_eq!(kernel.weight_max(), 1.0, "all of it");
    }
}
