//! Exploration: where robots go to see what nobody has seen.
//!
//! Every robot goes the cheapest way to the nearest cell that was never observed, down the values of
//!
//! ```text
//! V(p) = 0                                               p unexplored
//! V(p) = min over neighbours q of V(q) + step + P(q)     p explored
//! ```
//!
//! with `P(q)` the probability that q is occupied: S. Thrun, "Learning metric-topological maps for
//! indoor mobile robot navigation", Artificial Intelligence 99 (1998), section 2.5, where `step` is
//! 0. Cells that the robot cannot be at for what was observed are closed, so that nothing behind a
//! wall is a goal; nor is what is smaller than [`ExplorationParams::unexplored_min_m`]: B. Yamauchi,
//! "A frontier-based approach for autonomous exploration", CIRA (1997).
//!
//! Of several robots the one that is nearest to a goal takes it, and what will be seen from there is
//! no goal of the others: W. Burgard, M. Moors, C. Stachniss and F. Schneider, "Coordinated
//! multi-robot exploration", IEEE Transactions on Robotics 21 (2005), Algorithm 1, with a utility of
//! 0 for what another robot will see.
//!
//! Values are kept from one question to the next, and only what changed is worked on again
//! (`value_iteration.rs`): they are the same, bit for bit, as from scratch. Time O(cells) for what
//! is compared; see there for the values.

mod chart;
mod errands;
mod frontiers;

use meetpoint_geometry::{Cell, GridInfo, Point2};

use crate::value_iteration::{Ground, InvalidGround, Settled, ValueIteration};

use chart::Chart;
pub use errands::{Errand, Way};
pub use frontiers::Frontier;

/// Tunables of exploration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExplorationParams {
    /// Of the robot, in metres; at least 0.
    pub radius_m: f64,
    /// What entering a cell costs besides its probability of being occupied.
    pub step_cost: f32,
    /// Cells that are at least as likely occupied are closed, as a probability; at least one half, from which on they cost
    /// [`ExplorationParams::doubt_cost`].
    pub closed_from: f32,
    /// What entering a cell costs besides that is likelier occupied than not, and not closed.
    pub doubt_cost: f32,
    /// What a diagonal step costs as a multiple of a straight one; at least 1.
    pub diagonal: f32,
    /// Unexplored cells that hang together and cover less than a square of that side are no goals,
    /// in metres.
    pub unexplored_min_m: f64,
    /// How far a robot will see from its goal, in metres.
    pub sight_m: f64,
    /// How far a robot that is where it cannot be is moved to where it can, in metres.
    pub tolerance_m: f64,
}

impl ExplorationParams {
    /// The paper's costs: the probability and nothing else, and diagonal steps as dear as straight
    /// ones.
    pub const THRUN_1998: Self = Self { step_cost: 0.0, diagonal: 1.0, ..Self::INDOOR };

    /// The nearest goal by length, where all cells are free; for any robot that is not told apart.
    pub const INDOOR: Self = Self {
        // The radius of a cleaning or delivery robot.
        radius_m: 0.2,
        // A cell that is free for sure then costs its length, and one at even odds half as much
        // again. Without it a cell crossed by one beam costs twenty that were crossed by many, and
        // robots go long ways round over what they know best.
        step_cost: 1.0,
        // No less likely occupied than not is taken for occupied, as everywhere: lasers are rarely in doubt.
        closed_from: 0.5,
        doubt_cost: 0.0,
        diagonal: std::f32::consts::SQRT_2,
        // Smaller than any robot: what beams left out between them, and corners behind legs.
        unexplored_min_m: 0.3,
        // As far as beams that hit nothing are believed (`BeamModel::INDOOR`).
        sight_m: 5.0,
        // A pose that is off by some cells beside a wall.
        tolerance_m: 0.3,
    };

    /// For maps drawn from sonar, whose walls waver: closed is what a map shows as occupied, and what is only likelier
    /// occupied than not is entered where the way round is longer by two metres at cells of 0.1 m, and looked at from
    /// near. A door in which one echo was wrong would else end an exploration.
    pub const HEARD: Self = Self { closed_from: 0.7, doubt_cost: 20.0, ..Self::INDOOR };
}

/// What is known of a map.
#[derive(Clone, Copy, Debug)]
pub struct Known<'a> {
    /// Which cells: see [`exploration_rectangle`].
    pub info: GridInfo,
    /// Log-odds of "occupied", one number a cell, row-major; NaN where never observed.
    pub log_odds: &'a [f32],
    /// Cells, by their place in `log_odds`, that no robot is to enter whatever was observed.
    pub closed: &'a [usize],
}

/// Where robots are to go, and what is left.
#[derive(Clone, Debug, PartialEq)]
pub struct Explored {
    /// For each robot, in the order asked.
    pub errands: Vec<Errand>,
    /// Where what is explored and can be reached by one of the robots meets what is not, by their
    /// lowest cells.
    pub frontiers: Vec<Frontier>,
    /// Area that was observed, in square metres.
    pub observed_m2: f64,
    /// Area that the centre of one of the robots can reach without leaving what was observed, in
    /// square metres.
    pub reached_m2: f64,
    /// How the values were found.
    pub settled: Settled,
}

impl Explored {
    /// Length of all frontiers, in metres.
    pub fn frontier_m(&self) -> f64 {
        self.frontiers.iter().fold(0.0, |sum_m, frontier| sum_m + frontier.length_m)
    }
}

/// Unexplored cells are known this far around what was observed, in metres: more than a robot's
/// radius, so that what lies outside is one piece of unexplored ground.
const MARGIN_M: f64 = 2.0;
/// Rectangles begin and end at multiples of so many cells, so that they stay the same while a map
/// grows a little.
const BLOCK_CELLS: i32 = 64;

/// The cells to look at for a map whose observed ones are `bounds`, for a robot of that radius.
pub fn exploration_rectangle(bounds: GridInfo, radius_m: f64) -> GridInfo {
    let margin = cells(MARGIN_M + radius_m.max(0.0), bounds);
    let along = |first: i32, n_cells: u32| {
        let last = first.saturating_add_unsigned(n_cells).saturating_add(margin);
        let first = first.saturating_sub(margin).div_euclid(BLOCK_CELLS);
        let end = last.div_euclid(BLOCK_CELLS).saturating_add(1);
        (first.saturating_mul(BLOCK_CELLS), end.saturating_mul(BLOCK_CELLS))
    };
    let (left, right) = along(bounds.first.x, bounds.width);
    let (low, high) = along(bounds.first.y, bounds.height);
    let first = Cell { x: left, y: low };
    GridInfo { first, width: right.abs_diff(left), height: high.abs_diff(low), ..bounds }
}

/// A length in whole cells, rounded up.
#[expect(clippy::cast_possible_truncation, reason = "saturating on purpose")]
fn cells(length_m: f64, info: GridInfo) -> i32 {
    (length_m / info.frame.resolution_m()).ceil() as i32
}

/// Exploration of one map by robots of one radius: values that are kept from question to question.
#[derive(Clone, Debug)]
pub struct Exploration {
    params: ExplorationParams,
    kept: Option<Kept>,
}

/// What the question before left.
#[derive(Clone, Debug)]
struct Kept {
    /// Invariant: what the values were told last.
    ground: Vec<Ground>,
    /// Invariant: settled.
    values: ValueIteration,
}

impl Exploration {
    /// Nothing is known yet.
    pub fn new(params: ExplorationParams) -> Self {
        Self { params, kept: None }
    }

    /// Where robots at these points are to go, in the frame of the map.
    ///
    /// # Errors
    /// [`InvalidGround`] if there is not one number a cell, or the parameters make diagonal steps
    /// too cheap.
    pub fn explore(
        &mut self,
        known: &Known,
        robots: &[Point2<f64>],
    ) -> Result<Explored, InvalidGround> {
        let (n_given, n_cells) = (known.log_odds.len(), known.info.n_cells());
        if n_given != n_cells {
            return Err(InvalidGround::WrongLength { n_given, n_cells });
        }
        let chart = Chart::new(&self.params, known, robots);
        // Put back at the end: nothing half done is ever kept.
        let (mut kept, settled) = self.brought_up(&chart)?;
        let located: Vec<_> = robots.iter().map(|&robot| chart.locate(robot)).collect();
        let errands = errands::errands(&chart, &mut kept.values, robots, &located);
        let starts = located.iter().flatten().map(|place| place.cell);
        let (frontiers, n_reached) = frontiers::frontiers(&chart, starts);
        self.kept = Some(kept);
        let cell_m2 = known.info.frame.resolution_m().powi(2);
        let n_observed = known.log_odds.iter().filter(|log_odds| !log_odds.is_nan()).count();
        Ok(Explored {
            errands,
            frontiers,
            observed_m2: n_observed as f64 * cell_m2,
            reached_m2: n_reached as f64 * cell_m2,
            settled,
        })
    }

    /// The values as of the question before; `None` before the first. Their cells are those asked
    /// about and a ring around them.
    pub fn values(&self) -> Option<&ValueIteration> {
        self.kept.as_ref().map(|kept| &kept.values)
    }

    /// What the values were made of: one piece of ground a cell; empty before the first question.
    pub fn ground(&self) -> &[Ground] {
        self.kept.as_ref().map_or(&[], |kept| &kept.ground)
    }

    /// Brings values and ground to what is known now: from what they were, if the cells are the
    /// same, else from scratch.
    fn brought_up(&mut self, chart: &Chart) -> Result<(Kept, Settled), InvalidGround> {
        let is_same = |kept: &Kept| kept.values.info() == chart.info;
        let mut kept = match self.kept.take().filter(is_same) {
            Some(mut kept) => {
                for (cell, (before, &now)) in kept.ground.iter_mut().zip(&chart.ground).enumerate()
                {
                    if *before != now {
                        *before = now;
                        kept.values.set(cell, now);
                    }
                }
                kept
            }
            None => {
                let ground = chart.ground.clone();
                let values = ValueIteration::new(chart.info, &ground, self.params.diagonal)?;
                Kept { ground, values }
            }
        };
        let settled = kept.values.settle(u32::MAX);
        Ok((kept, settled))
    }
}
