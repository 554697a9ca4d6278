//! Distances all around one place.

use std::f64::consts::{PI, TAU};

use meetpoint_geometry::{angle_between, wrap_angle};

/// Distances at even steps all around, of one firing or the mean of several.
#[derive(Clone, Debug, PartialEq)]
pub struct Ring {
    /// In metres, counter-clockwise. Invariant: finite, at least one.
    ranges_m: Vec<f64>,
    /// Direction of the first, in the frame of headings.
    first_rad: f64,
}

impl Ring {
    /// The mean of several firings of one ring, the first sonar of which looks along `first_rad`.
    /// Readings above `range_max_m` and NaN count as that, those below 0 as 0. `None` without any reading.
    pub fn mean_of<'a>(
        firings: impl IntoIterator<Item = &'a [f64]>,
        first_rad: f64,
        range_max_m: f64,
    ) -> Option<Self> {
        let mut sums: Vec<f64> = Vec::new();
        let mut n_firings = 0_u32;
        for firing in firings {
            sums.resize(firing.len().max(sums.len()), 0.0);
            for (sum, range_m) in sums.iter_mut().zip(firing) {
                *sum += range_m.min(range_max_m).max(0.0);
            }
            n_firings += 1;
        }
        let ranges_m: Vec<f64> = sums.into_iter().map(|sum| sum / f64::from(n_firings)).collect();
        (!ranges_m.is_empty()).then_some(Self { ranges_m, first_rad })
    }

    /// Two rings of equally many sonars, the second turned counter-clockwise by half a step, as one of
    /// twice as many.
    pub fn interleaved(&self, half_a_step_on: &Self) -> Self {
        let pairs = self.ranges_m.iter().zip(&half_a_step_on.ranges_m);
        let ranges_m = pairs.flat_map(|(&a, &b)| [a, b]).collect();
        Self { ranges_m, first_rad: self.first_rad }
    }

    /// Number of directions.
    pub fn n(&self) -> usize {
        self.ranges_m.len()
    }

    /// Angle between neighbours.
    pub fn step_rad(&self) -> f64 {
        TAU / self.n() as f64
    }

    /// Distances, counter-clockwise.
    pub fn ranges_m(&self) -> &[f64] {
        &self.ranges_m
    }

    /// Direction of a distance, any number of times around.
    pub fn heading_rad(&self, index: usize) -> f64 {
        wrap_angle(self.first_rad + self.step_rad() * (index % self.n()) as f64)
    }

    /// Directions and distances, counter-clockwise.
    pub fn readings(&self) -> impl Iterator<Item = (f64, f64)> {
        self.ranges_m.iter().enumerate().map(|(index, &range_m)| (self.heading_rad(index), range_m))
    }

    /// Distance to a wall that stands across that direction: the mean over all readings within 30
    /// degrees, each as it would be head-on.
    pub fn wall_m(&self, heading_rad: f64) -> f64 {
        let within =
            |&(at_rad, _): &(f64, f64)| angle_between(heading_rad, at_rad).abs() < PI / 6.0;
        let (mut sum_m, mut n) = (0.0, 0.0);
        for (at_rad, range_m) in self.readings().filter(within) {
            sum_m += range_m * (at_rad - heading_rad).cos();
            n += 1.0;
        }
        if n == 0.0 { f64::INFINITY } else { sum_m / n }
    }

    /// The shortest reading within that angle of a direction; `+inf` if there is none.
    pub fn nearest_m(&self, heading_rad: f64, within_rad: f64) -> f64 {
        self.readings()
            .filter(|&(at_rad, _)| angle_between(heading_rad, at_rad).abs() <= within_rad)
            .fold(f64::INFINITY, |least_m, (_, range_m)| least_m.min(range_m))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn firings_are_averaged_and_interleaved() {
        let firings: [&[f64]; 2] = [&[1.0, 2.0, 3.0, f64::INFINITY], &[3.0, 2.0, 1.0, 6.0]];
        let ring = Ring::mean_of(firings, 0.1, 6.0).expect("readings");
        assert_eq!(ring.ranges_m(), [2.0, 2.0, 2.0, 6.0], "nothing heard is as far as can be");
        assert!((ring.heading_rad(1) - 0.1 - FRAC_PI_2).abs() < 1e-12, "counter-clockwise");
        let turned = Ring::mean_of([&[5.0; 4][..]], 0.1 + PI / 4.0, 6.0).expect("readings");
        let both = ring.interleaved(&turned);
        assert_eq!(both.ranges_m(), [2.0, 5.0, 2.0, 5.0, 2.0, 5.0, 6.0, 5.0], "one by one");
        assert_eq!(Ring::mean_of([], 0.0, 6.0), None, "nothing was read");
    }

    #[test]
    fn a_wall_is_as_far_as_it_is_head_on() {
        // A wall 1 m to the left, nothing else.
        let range_m = |index: i32| {
            let across = (TAU * f64::from(index) / 16.0).sin();
            if 0.0 < across { (1.0 / across).min(6.0) } else { 6.0 }
        };
        let ranges_m: Vec<f64> = (0..16).map(range_m).collect();
        let ring = Ring::mean_of([&ranges_m[..]], 0.0, 6.0).expect("readings");
        assert!((ring.wall_m(FRAC_PI_2) - 1.0).abs() < 1e-9, "{} m", ring.wall_m(FRAC_PI_2));
        assert_eq!(ring.nearest_m(0.0, 0.1), 6.0, "free ahead");
    }
}
