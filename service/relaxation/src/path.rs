//! The most likely path: the sequence of poses that together are most probable (A. Viterbi, "Error
//! bounds for convolutional codes", IEEE Transactions on Information Theory 13 (1967)), over the
//! cells that the posterior keeps.
//!
//! The peaks of the posteriors alone would be cheaper, but where these have several peaks a robot
//! would jump between paths that exclude each other. Each pose is then the posterior's mean over
//! the nearest cells, which is finer than the grid.

use std::f64::consts::TAU;

use meetpoint_geometry::{Point2, Pose, angle_between};

use crate::belief::Belief;
use crate::calibration::Calibration;
use crate::carry::Direction;
use crate::e_step::Model;
use crate::forward::likelihood_of;
use crate::layer::Layer;
use crate::perception::Perception;
use crate::pose_grid::{PoseCell, PoseGrid};
use crate::stencil::Combine;
use crate::travel::Travel;

/// Where a robot most likely was.
#[derive(Clone, Debug, PartialEq)]
pub struct Path {
    /// The pose at every step.
    pub poses: Vec<Pose>,
    /// How much of the posterior lies within one node and heading of that pose, by step.
    pub certainty: Vec<f64>,
}

impl Path {
    /// Poses at the ends of all legs of every step, the step's own pose last: odometry, with the
    /// error that it has at the step spread linearly over the distance (TBF98 section 5).
    pub fn between_steps(&self, travel: &Travel, calibration: &Calibration) -> Vec<Vec<Pose>> {
        let mut before = self.poses.first().copied().unwrap_or(Pose::IDENTITY);
        let mut all = Vec::with_capacity(self.poses.len());
        for (i, (step, &at)) in travel.steps.iter().zip(&self.poses).enumerate() {
            let legs = if i == 0 { &[] } else { step.motion.legs() };
            let mut measured = before;
            let (mut poses, mut driven_m) = (Vec::with_capacity(legs.len() + 1), Vec::new());
            let mut total_m = 0.0;
            for &leg in legs {
                measured = measured * calibration.corrected(leg);
                total_m += leg.distance_m();
                poses.push(measured);
                driven_m.push(total_m);
            }
            let off = at.position() - measured.position();
            let turned_rad = angle_between(measured.theta_rad, at.theta_rad);
            for (pose, driven_m) in poses.iter_mut().zip(driven_m) {
                let share = if total_m > 0.0 { driven_m / total_m } else { 1.0 };
                let position = pose.position() + off * share;
                *pose = Pose::new(position.x, position.y, pose.theta_rad + turned_rad * share);
            }
            match poses.last_mut() {
                Some(last) => *last = at,
                None => poses.push(at),
            }
            all.push(poses);
            before = at;
        }
        all
    }
}

/// The cells of the most likely path; `None` if no pose is possible at some step.
pub(crate) fn most_likely(
    model: &Model<'_>,
    start: &Belief,
    perception: Option<&Perception>,
    posterior: &[Belief],
) -> Option<Vec<PoseCell>> {
    let mut best: Vec<Belief> = Vec::with_capacity(posterior.len());
    for (step, kept) in posterior.iter().enumerate() {
        let reached = match best.last() {
            None => start.clone(),
            Some(before) => {
                Belief::new(model.carry(step - 1, Combine::Max).all(before, Direction::Forward))
            }
        };
        let reached = within(&reached, kept);
        let mut weighed = match perception {
            None => reached,
            Some(perception) => {
                let observation = &model.observations[step];
                let likelihood = likelihood_of(model.grid, &reached, observation, perception);
                times(&reached, &likelihood)
            }
        };
        let max = weighed.max();
        if max <= 0.0 {
            return None;
        }
        weighed.scale(1.0 / max);
        best.push(weighed);
    }
    traced(model, &best)
}

/// The path along cells, each pose the posterior's mean around its cell.
pub(crate) fn around(grid: &PoseGrid, cells: &[PoseCell], posterior: &[Belief]) -> Path {
    let means = cells.iter().zip(posterior).map(|(&cell, belief)| mean_around(grid, cell, belief));
    let (poses, certainty) = means.unzip();
    Path { poses, certainty }
}

/// Without what the posterior does not keep.
fn within(reached: &Belief, kept: &Belief) -> Belief {
    Belief::new(kept.with_each_layer(|heading, kept| {
        let reached = reached.layer(heading);
        let weights = kept
            .window()
            .nodes()
            .zip(kept.weights())
            .map(|((x, y), &weight)| if weight > 0.0 { reached.at(x, y) } else { 0.0 });
        Layer::new(kept.window(), weights.collect())
    }))
}

fn times(left: &Belief, right: &Belief) -> Belief {
    Belief::new(left.with_each_layer(|heading, layer| {
        let factors = right.layer(heading).weights();
        let products = layer.weights().iter().zip(factors).map(|(&left, &right)| left * right);
        Layer::new(layer.window(), products.collect())
    }))
}

/// From the best last cell back, each time to the cell that it was best reached from.
fn traced(model: &Model<'_>, best: &[Belief]) -> Option<Vec<PoseCell>> {
    let mut at = best.last()?.peak()?;
    let mut cells = vec![at];
    for (step, before) in best.iter().enumerate().rev().skip(1) {
        let motion = &model.motions[step];
        let mut from: Option<(PoseCell, f32)> = None;
        for (cell, weight) in before.entries() {
            let turn = i64::from(at.heading) - i64::from(cell.heading);
            let turn = i32::try_from(turn).unwrap_or(0);
            let way = (at.x - cell.x, at.y - cell.y, turn);
            let value = weight * motion.probability(model.grid, cell.heading, way);
            if from.is_none_or(|(_, best)| value > best) {
                from = Some((cell, value));
            }
        }
        at = from?.0;
        cells.push(at);
    }
    cells.reverse();
    Some(cells)
}

/// The posterior's mean over a cell and its neighbours, and their share of it.
fn mean_around(grid: &PoseGrid, at: PoseCell, belief: &Belief) -> (Pose, f64) {
    let (mut sum, mut x_m, mut y_m, mut turn_rad) = (0.0, 0.0, 0.0, 0.0);
    for turn in -1..=1 {
        let heading = grid.turned(at.heading, turn);
        for x in at.x - 1..=at.x + 1 {
            for y in at.y - 1..=at.y + 1 {
                let weight = f64::from(belief.at(PoseCell { x, y, heading }));
                let point: Point2<f64> = grid.point_of(x, y);
                sum += weight;
                x_m += weight * point.x;
                y_m += weight * point.y;
                turn_rad += weight * f64::from(turn) * TAU / f64::from(grid.n_headings());
            }
        }
    }
    if sum <= 0.0 {
        return (grid.pose_of(at), 0.0);
    }
    let heading_rad = grid.heading_rad(at.heading) + turn_rad / sum;
    (Pose::new(x_m / sum, y_m / sum, heading_rad), sum)
}
