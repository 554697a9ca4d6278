//! What a straight way costs, and whether there is one.

use meetpoint_geometry::Point2;

use super::obstacles::Obstacles;
use crate::cost::WEIGHT_ONE;
use crate::space::Space;

/// Obstacles and weights as a robot of one size sees them; all in cells.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Terrain<'a> {
    pub(crate) obstacles: &'a Obstacles,
    /// How near the robot's centre may come to an obstacle.
    pub(crate) radius: f64,
    /// `None` where all costs its length.
    pub(crate) weights: Option<&'a Space>,
}

impl Terrain<'_> {
    pub(crate) fn is_clear(&self, a: Point2<f64>, b: Point2<f64>) -> bool {
        self.obstacles.is_clear(a, b, self.radius)
    }

    /// What the straight way costs, in cells of weight one: the integral of the weights along it.
    pub(crate) fn cost(&self, a: Point2<f64>, b: Point2<f64>) -> f64 {
        let length = (b - a).norm();
        match self.weights {
            None => length,
            Some(space) => length * mean_weight(space, a, b),
        }
    }
}

/// Mean weight along a segment, in parts of [`WEIGHT_ONE`].
fn mean_weight(space: &Space, a: Point2<f64>, b: Point2<f64>) -> f64 {
    let along = b - a;
    let (mut share, mut sum) = (0.0, 0.0);
    while share < 1.0 {
        let here = a + along * share;
        let next = next_border([here.x, here.y], [along.x, along.y]);
        let until = (share + next).min(1.0);
        let middle = a + along * f64::midpoint(share, until);
        sum += (until - share) * f64::from(weight_at(space, middle));
        share = until;
    }
    sum / f64::from(WEIGHT_ONE)
}

/// How far along a segment the next border of a cell is, as a share of the segment.
fn next_border(here: [f64; 2], along: [f64; 2]) -> f64 {
    // A millionth of a cell past the border, so that every step gets on.
    let axis = |here: f64, along: f64| {
        let border = if 0.0 < along { here.floor() + 1.0 } else { here.ceil() - 1.0 };
        let left = (border - here).abs() + 1e-6;
        if along == 0.0 { f64::INFINITY } else { left / along.abs() }
    };
    axis(here[0], along[0]).min(axis(here[1], along[1]))
}

/// Weight of the cell that holds a point. A cell that cannot be entered, which a straight way may
/// clip, weighs as much as the heaviest one around it.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturating")]
fn weight_at(space: &Space, point: Point2<f64>) -> u8 {
    let info = space.info();
    let (width, height) = (info.width as usize, info.height as usize);
    let (x, y) = (point.x as usize, point.y as usize);
    if width <= x || height <= y {
        return u8::MAX;
    }
    let weight = space.weight(y * width + x);
    if 0 < weight {
        return weight;
    }
    let rows = y.saturating_sub(1)..(y + 2).min(height);
    let columns = x.saturating_sub(1)..(x + 2).min(width);
    let around = rows.flat_map(|y| columns.clone().map(move |x| space.weight(y * width + x)));
    around.max().filter(|&weight| 0 < weight).unwrap_or(u8::MAX)
}
