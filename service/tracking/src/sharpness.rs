//! Sharpness of a map: the entropy of its cells.
//!
//! ```text
//! H = - sum over observed cells of (p log2 p + (1 - p) log2 (1 - p)),  p = 1 / (1 + exp(-log-odds))
//! ```
//!
//! in bits. A wall that is drawn twice, or smeared over several cells, leaves cells of which some
//! readings say "free" and some "occupied". Only observed cells count, so that the mean does not depend
//! on how much was never seen; maps of the same scans are compared by the total, since a map that is
//! blurred also spreads over more cells. Source: C. Stachniss, G. Grisetti, W. Burgard, "Information
//! gain-based exploration using Rao-Blackwellized particle filters", RSS 2005, section IV.

use meetpoint_occupancy::Grid;

/// How sharp a map is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sharpness {
    /// Cells that some reading observed.
    pub n_cells: u64,
    /// Entropy of all of them, in bits.
    pub entropy_bits: f64,
}

impl Sharpness {
    /// Of the observed cells of a grid.
    pub fn of_grid(grid: &Grid) -> Self {
        let mut sharpness = Self::default();
        for (_, tile) in grid.tiles() {
            for &log_odds in tile.log_odds() {
                if !log_odds.is_nan() {
                    sharpness.n_cells += 1;
                    sharpness.entropy_bits += entropy_bits(f64::from(log_odds));
                }
            }
        }
        sharpness
    }

    /// Mean entropy of an observed cell, in bits; 0 of no cells.
    pub fn mean_bits(&self) -> f64 {
        self.entropy_bits / self.n_cells.max(1) as f64
    }
}

/// Entropy of a cell, in bits.
fn entropy_bits(log_odds: f64) -> f64 {
    let magnitude = log_odds.abs();
    // p of the likelier of the two, and the other one's share, without cancellation.
    let other = (-magnitude).exp() / (1.0 + (-magnitude).exp());
    if other <= 0.0 {
        return 0.0;
    }
    let likelier = 1.0 - other;
    -(likelier * likelier.log2() + other * other.log2())
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use meetpoint_geometry::{GridFrame, Pose};
    use meetpoint_occupancy::{BeamModel, LaserGeometry, ScanMarks};

    use super::*;

    #[test]
    fn of_a_cell_is_that_of_its_probability() {
        assert_eq!(entropy_bits(0.0), 1.0, "a fair coin");
        let p = 1.0 / (1.0 + (-1.5_f64).exp());
        let expected = -(p * p.log2() + (1.0 - p) * (1.0 - p).log2());
        assert!((entropy_bits(1.5) - expected).abs() < 1e-12, "by the definition");
        assert_eq!(entropy_bits(1.5), entropy_bits(-1.5), "free is as sure as occupied");
        assert_eq!(entropy_bits(1e3), 0.0, "certain");
    }

    #[test]
    fn walls_drawn_twice_are_less_sharp() {
        let laser = LaserGeometry {
            angle_min_rad: -PI,
            angle_increment_rad: PI / 180.0,
            n_beams: 360,
            range_min_m: 0.0,
            range_max_m: 9.0,
        };
        let entropy = |step_m: f64| {
            let mut grid = Grid::new(GridFrame::new(0.05).expect("a length"));
            for i in 0..10 {
                let pose = Pose::new(step_m * f64::from(i % 2), 0.0, 0.0);
                let model = &BeamModel::INDOOR;
                grid.insert_scan(pose, &laser, &[2.02; 360], model, &mut ScanMarks::new());
            }
            Sharpness::of_grid(&grid)
        };
        let (sharp, blurred) = (entropy(0.0), entropy(0.15));
        assert!(sharp.mean_bits() < 0.9 * blurred.mean_bits(), "{sharp:?} {blurred:?}");
        assert_eq!(Sharpness::default().mean_bits(), 0.0, "of no cells");
    }
}
