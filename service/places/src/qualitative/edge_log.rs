//! Measures of the edge under way.

use super::control::Strategy;
use super::travel_edge::Traversal;

const STRATEGIES: [Strategy; 3] =
    [Strategy::FollowMidline, Strategy::WalkAlongLeft, Strategy::WalkAlongRight];

/// What was measured since a place was left.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub(crate) struct EdgeLog {
    /// The way so far, in metres.
    pub(crate) length_m: f64,
    /// Net change of orientation so far.
    pub(crate) turned_rad: f64,
    width_sum_m: f64,
    /// Steps by each of [`STRATEGIES`]. Blind ones are not counted: those of leaving tell nothing of
    /// the edge.
    n_steps: [u32; 3],
}

impl EdgeLog {
    /// Counts a step; `width_m` is the distance from wall to wall, if it is one between walls.
    pub(crate) fn step(&mut self, strategy: Strategy, width_m: f64) {
        if let Some(index) = STRATEGIES.iter().position(|&known| known == strategy) {
            self.n_steps[index] += 1;
        }
        if strategy == Strategy::FollowMidline {
            self.width_sum_m += width_m;
        }
    }

    /// The edge, at its end.
    pub(crate) fn traversal(&self) -> Traversal {
        let most = (0..3).max_by_key(|&index| self.n_steps[index]);
        let most = most.filter(|&index| 0 < self.n_steps[index]);
        let n_midline = self.n_steps[0];
        Traversal {
            strategy: most.map_or(Strategy::BlindStep, |index| STRATEGIES[index]),
            length_m: self.length_m,
            width_m: (0 < n_midline).then(|| self.width_sum_m / f64::from(n_midline)),
            turned_rad: self.turned_rad,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_strategy_is_that_of_most_steps() {
        let mut log = EdgeLog::default();
        assert_eq!(log.traversal().strategy, Strategy::BlindStep, "nothing to go by");
        log.step(Strategy::FollowMidline, 2.0);
        log.step(Strategy::WalkAlongRight, 9.0);
        log.step(Strategy::WalkAlongRight, 9.0);
        let traversal = log.traversal();
        assert_eq!(traversal.strategy, Strategy::WalkAlongRight, "two of three");
        assert_eq!(traversal.width_m, Some(2.0), "where there were two walls");
    }
}
