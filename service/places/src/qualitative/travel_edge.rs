//! Edges between places, and what is measured along them (KB 1988, section 2.3).

use super::control::Strategy;
use crate::place_map::Gateway;

/// What was measured on one way from a place to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Traversal {
    /// The strategy that fitted most of the way.
    pub strategy: Strategy,
    /// How far it was, in metres.
    pub length_m: f64,
    /// Mean distance from wall to wall, in metres; `None` where there were not two.
    pub width_m: Option<f64>,
    /// Net change of orientation from leaving to arriving, counter-clockwise.
    pub turned_rad: f64,
}

/// A mean of independent measurements, and how sure it is.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Averaged {
    /// How many.
    pub n: u32,
    /// Their mean; 0 of none.
    pub mean: f64,
    /// Sum of the squares of what each is off the mean.
    squares: f64,
}

impl Averaged {
    /// Takes one more in: B. P. Welford, Technometrics 4 (1962).
    pub fn take_in(&mut self, value: f64) {
        self.n += 1;
        let off = value - self.mean;
        self.mean += off / f64::from(self.n);
        self.squares += off * (value - self.mean);
    }

    /// Standard deviation of a single measurement; `None` of fewer than two.
    pub fn std(&self) -> Option<f64> {
        (2 <= self.n).then(|| (self.squares / f64::from(self.n - 1)).sqrt())
    }
}

/// An edge: two places, how to get from one to the other, and its measures over all traversals.
#[derive(Clone, Debug, PartialEq)]
pub struct TravelEdge {
    /// Where it was left and where it arrived when it was found.
    pub ends: [Gateway; 2],
    /// The strategy, as travelled from the first end.
    pub strategy: Strategy,
    /// In metres.
    pub length_m: Averaged,
    /// From wall to wall, in metres.
    pub width_m: Averaged,
    /// Change of orientation from the first end to the second.
    pub turned_rad: Averaged,
}

impl TravelEdge {
    /// An edge that was travelled for the first time.
    pub fn new(ends: [Gateway; 2], first: &Traversal) -> Self {
        let none = Averaged::default();
        let mut edge = Self {
            ends,
            strategy: first.strategy,
            length_m: none,
            width_m: none,
            turned_rad: none,
        };
        edge.take_in(ends[0], first);
        edge
    }

    /// Takes in one more traversal, which left from `from`.
    pub fn take_in(&mut self, from: Gateway, traversal: &Traversal) {
        self.length_m.take_in(traversal.length_m);
        if let Some(width_m) = traversal.width_m {
            self.width_m.take_in(width_m);
        }
        // Who comes back turns the other way.
        let sign = if from == self.ends[0] { 1.0 } else { -1.0 };
        self.turned_rad.take_in(sign * traversal.turned_rad);
    }

    /// Mean curvature as travelled from the first end, in radians a metre.
    pub fn curvature_rad_per_m(&self) -> f64 {
        self.turned_rad.mean / self.length_m.mean.max(1e-6)
    }

    /// Whether a traversal may have been one of this edge, by its length.
    pub fn may_be(&self, traversal: &Traversal, share: f64, slack_m: f64) -> bool {
        let off_m = (self.length_m.mean - traversal.length_m).abs();
        off_m <= slack_m + share * self.length_m.mean
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::place_map::PlaceId;

    #[test]
    fn traversals_are_averaged_both_ways() {
        let ends = [0, 1].map(|place| Gateway { place: PlaceId(place), index: 0 });
        let there = Traversal {
            strategy: Strategy::FollowMidline,
            length_m: 8.0,
            width_m: Some(2.1),
            turned_rad: 1.5,
        };
        let mut edge = TravelEdge::new(ends, &there);
        assert_eq!(edge.length_m.std(), None, "one says nothing of the error");
        let back = Traversal { length_m: 9.0, width_m: None, turned_rad: -1.7, ..there };
        edge.take_in(ends[1], &back);
        assert_eq!(edge.length_m.mean, 8.5, "the mean of both");
        assert!((edge.length_m.std().expect("two") - 0.5_f64.sqrt()).abs() < 1e-12, "of one");
        assert_eq!(edge.width_m.n, 1, "measured on the way there");
        assert!((edge.turned_rad.mean - 1.6).abs() < 1e-12, "back is the other way around");
        assert!((edge.curvature_rad_per_m() - 1.6 / 8.5).abs() < 1e-12, "to the left");
        assert!(edge.may_be(&back, 0.1, 0.0), "9 m are 8.5 m by a tenth");
        assert!(!edge.may_be(&Traversal { length_m: 12.0, ..there }, 0.1, 1.0), "12 m are not");
    }
}
