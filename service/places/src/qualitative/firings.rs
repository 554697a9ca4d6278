//! The last firings of a ring of sonars, and what they say together.

use std::collections::VecDeque;
use std::f64::consts::TAU;

use meetpoint_geometry::angle_between;

use super::ring::Ring;

/// The last firings, the newest last, each with the heading of the robot.
#[derive(Clone, Debug)]
pub(crate) struct Firings {
    recent: VecDeque<(f64, Vec<f64>)>,
    n_kept: usize,
    range_max_m: f64,
}

impl Firings {
    /// None so far; `n_kept` of them will be kept.
    pub(crate) fn new(n_kept: usize, range_max_m: f64) -> Self {
        Self { recent: VecDeque::new(), n_kept, range_max_m }
    }

    pub(crate) fn take_in(&mut self, heading_rad: f64, ranges_m: &[f64]) {
        self.recent.push_back((heading_rad, ranges_m.to_vec()));
        while self.n_kept < self.recent.len() {
            self.recent.pop_front();
        }
    }

    /// Sonars of the ring; 0 if nothing was heard.
    pub(crate) fn n_sonars(&self) -> usize {
        self.recent.back().map_or(0, |(_, ranges_m)| ranges_m.len())
    }

    /// Turns the frame of headings counter-clockwise.
    pub(crate) fn turn_frame(&mut self, by_rad: f64) {
        for (heading_rad, _) in &mut self.recent {
            *heading_rad -= by_rad;
        }
    }

    /// The mean of the last `n`, each rotated by whole sonars to where the robot looks now; `None`
    /// if there are none.
    pub(crate) fn mean(&self, n: usize, heading_rad: f64) -> Option<Ring> {
        self.mean_before(0, n, heading_rad)
    }

    /// The same of the last `n` before the last `n_skipped`.
    pub(crate) fn mean_before(&self, n_skipped: usize, n: usize, heading_rad: f64) -> Option<Ring> {
        let newest = self.recent.iter().rev().skip(n_skipped).take(n);
        let aligned: Vec<Vec<f64>> = newest.map(|firing| aligned(firing, heading_rad)).collect();
        Ring::mean_of(aligned.iter().map(Vec::as_slice), heading_rad, self.range_max_m)
    }

    /// The last `2 n`, of which the second `n` were fired turned counter-clockwise by half the angle
    /// between sonars, as one ring of twice as many; `None` if there are fewer.
    pub(crate) fn survey(&self, n: usize) -> Option<Ring> {
        let mean = |n_skipped: usize| {
            let firings = || self.recent.iter().rev().skip(n_skipped).take(n);
            let heading_rad = firings().next()?.0;
            let ranges_m = firings().map(|(_, ranges_m)| ranges_m.as_slice());
            Ring::mean_of(ranges_m, heading_rad, self.range_max_m)
        };
        Some(mean(n)?.interleaved(&mean(0)?))
    }
}

fn aligned((fired_rad, ranges_m): &(f64, Vec<f64>), heading_rad: f64) -> Vec<f64> {
    let mut ranges_m = ranges_m.clone();
    let n = ranges_m.len();
    let steps = angle_between(*fired_rad, heading_rad) * n as f64 / TAU;
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "between 0 and the number of sonars"
    )]
    let on = steps.round().rem_euclid(n.max(1) as f64) as usize;
    ranges_m.rotate_left(on.min(n));
    ranges_m
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

    #[test]
    fn firings_are_rotated_to_where_the_robot_looks() {
        let mut firings = Firings::new(4, 9.0);
        firings.take_in(0.0, &[1.0, 2.0, 3.0, 4.0]);
        // A quarter turn to the left: what was on the left is ahead.
        firings.take_in(FRAC_PI_2, &[2.0, 3.0, 4.0, 1.0]);
        let ring = firings.mean(2, FRAC_PI_2).expect("firings");
        assert_eq!(ring.ranges_m(), [2.0, 3.0, 4.0, 1.0], "both say the same");
    }

    #[test]
    fn a_survey_looks_twice() {
        let mut firings = Firings::new(4, 9.0);
        assert_eq!(firings.survey(1), None, "nothing yet");
        firings.take_in(0.0, &[1.0, 2.0, 3.0, 4.0]);
        firings.take_in(FRAC_PI_4, &[5.0, 6.0, 7.0, 8.0]);
        let ring = firings.survey(1).expect("two firings");
        assert_eq!(ring.ranges_m(), [1.0, 5.0, 2.0, 6.0, 3.0, 7.0, 4.0, 8.0], "in between");
        assert_eq!(ring.heading_rad(0), 0.0, "from where it looked first");
    }
}
