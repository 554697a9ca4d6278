//! Correlative search: the best of all poses on a lattice about a prediction.
//!
//! The score of a pose is the mean of the field over the scan's points, less what the pose's
//! distance from the prediction costs. For one heading, the sums of all shifts by whole cells of a
//! 16 by 16 block come from adding up blocks of the field, a row at a time: E. Olson, "Real-time
//! correlative scan matching", ICRA 2009, with the loops turned inside out. Time
//! O(headings * blocks * points).

use std::f64::consts::PI;

use meetpoint_geometry::{Cell, Point2, Pose, angle_between};

use crate::matching::field::{
    BLOCK_CELLS, FULL, Field, STRIDE, floor_cell, stored_place, tile_place,
};

/// Points that a search may have: more could overflow the sums.
pub(crate) const N_POINTS_MAX: usize = 256;

/// No window has more steps to a side, whatever the parameters say.
const N_STEPS_MAX: f64 = 1024.0;

/// Where to search.
#[derive(Clone, Copy, Debug)]
pub struct Window {
    /// The middle.
    pub center: Pose,
    /// Half its side, in metres.
    pub half_m: f64,
    /// Half its headings, in radians.
    pub half_rad: f64,
    /// From one heading to the next, in radians.
    pub step_rad: f64,
}

/// What it costs to lie away from the prediction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Prior {
    pub(crate) center: Pose,
    /// Of mean correlation, for the square metre.
    pub(crate) gain_per_m2: f64,
    /// Of mean correlation, for the square radian.
    pub(crate) gain_per_rad2: f64,
    /// All that it can cost.
    pub(crate) loss_max: f64,
}

impl Prior {
    pub(crate) fn loss(&self, pose: Pose) -> f64 {
        let (dx, dy) = (pose.x_m - self.center.x_m, pose.y_m - self.center.y_m);
        let turn = angle_between(self.center.theta_rad, pose.theta_rad);
        let loss = self.gain_per_m2 * (dx * dx + dy * dy) + self.gain_per_rad2 * turn * turn;
        loss.min(self.loss_max)
    }
}

/// A pose and its score.
#[derive(Clone, Copy, Debug)]
pub struct Candidate {
    /// The pose.
    pub pose: Pose,
    /// Mean of the field less the prior's loss.
    pub score: f64,
}

impl Window {
    /// Half the window in cells.
    pub(crate) fn half_cells(&self, resolution_m: f64) -> i32 {
        whole_steps(self.half_m / resolution_m)
    }
}

/// The best pose of the window's lattice; of equals the first in the order of search, which goes
/// from the middle heading outwards. `points` are in the robot's frame, [`N_POINTS_MAX`] at most;
/// without any the middle is returned.
pub(crate) fn best_in_window(
    field: &Field,
    points: &[Point2<f64>],
    window: &Window,
    prior: &Prior,
) -> Candidate {
    let mut best = Candidate { pose: window.center, score: f64::NEG_INFINITY };
    let points = &points[..points.len().min(N_POINTS_MAX)];
    if points.is_empty() || !window.center.is_finite() {
        return best;
    }
    let half = window.half_cells(field.resolution_m());
    let mut cells = Vec::with_capacity(points.len());
    for pose in headings(window) {
        place_points(field, points, pose, &mut cells);
        for low in block_lows(half) {
            search_block(field, &cells, (pose, half), low, (prior, &mut best));
        }
    }
    best
}

/// The window's headings at its middle, from the middle heading outwards: 0, 1, -1, 2, -2... steps.
pub(crate) fn headings(window: &Window) -> impl Iterator<Item = Pose> {
    let Window { center, step_rad, .. } = *window;
    let n = whole_steps(window.half_rad.min(PI) / step_rad);
    (0..=2 * n).map(move |i| {
        let steps = f64::from((i + 1) / 2);
        let turn_rad = if i % 2 == 1 { steps * step_rad } else { -steps * step_rad };
        Pose::new(center.x_m, center.y_m, center.theta_rad + turn_rad)
    })
}

/// The lowest shifts of the blocks that cover the shifts from `-half` to `half` cells.
pub(crate) fn block_lows(half: i32) -> impl Iterator<Item = Cell> {
    let lows = move || (-half..=half).step_by(BLOCK_CELLS);
    lows().flat_map(move |y| lows().map(move |x| Cell { x, y }))
}

#[expect(clippy::cast_possible_truncation, reason = "clamped")]
fn whole_steps(steps: f64) -> i32 {
    steps.ceil().clamp(0.0, N_STEPS_MAX) as i32
}

/// The cells of the points seen from a pose.
pub(crate) fn place_points(
    field: &Field,
    points: &[Point2<f64>],
    pose: Pose,
    cells: &mut Vec<Cell>,
) {
    let resolution_m = field.resolution_m();
    let (sin, cos) = pose.theta_rad.sin_cos();
    cells.clear();
    cells.extend(points.iter().map(|point| {
        let x = pose.x_m + cos * point.x - sin * point.y;
        let y = pose.y_m + sin * point.x + cos * point.y;
        floor_cell(x / resolution_m, y / resolution_m)
    }));
}

/// Raises `best` to the best shift of a block. `cells` are those of the points at `heading`; shifts
/// beyond `half` are left out.
pub(crate) fn search_block(
    field: &Field,
    cells: &[Cell],
    (heading, half): (Pose, i32),
    low: Cell,
    (prior, best): (&Prior, &mut Candidate),
) {
    let resolution_m = field.resolution_m();
    let sums = block_sums(field, cells, low);
    let scale = 1.0 / (FULL * cells.len() as f64);
    for (y, row) in (low.y..=half).zip(sums.chunks_exact(BLOCK_CELLS)) {
        for (x, &sum) in (low.x..=half).zip(row) {
            let mean = f64::from(sum) * scale;
            if mean <= best.score {
                continue;
            }
            let pose = Pose {
                x_m: heading.x_m + f64::from(x) * resolution_m,
                y_m: heading.y_m + f64::from(y) * resolution_m,
                ..heading
            };
            let score = mean - prior.loss(pose);
            if score > best.score {
                *best = Candidate { pose, score };
            }
        }
    }
}

/// Sums of the field over all cells, for the shifts of a block whose lowest is given.
fn block_sums(field: &Field, cells: &[Cell], low: Cell) -> [u16; BLOCK_CELLS * BLOCK_CELLS] {
    let mut sums = [0_u16; BLOCK_CELLS * BLOCK_CELLS];
    for cell in cells {
        let first = Cell { x: cell.x + low.x, y: cell.y + low.y };
        if let Some(tile) = field.tile(tile_place(first).0) {
            add_block(&mut sums, &tile.values[stored_place(first)..]);
        }
    }
    sums
}

#[inline]
fn add_block(sums: &mut [u16; BLOCK_CELLS * BLOCK_CELLS], values: &[u8]) {
    for (sums, values) in sums.chunks_exact_mut(BLOCK_CELLS).zip(values.chunks(STRIDE)) {
        for (sum, &value) in sums.iter_mut().zip(&values[..BLOCK_CELLS]) {
            *sum += u16::from(value);
        }
    }
}
