//! Corners of obstacles grown by the robot: where a taut string turns.
//!
//! Around a corner the robot's centre goes on an arc. The arc is taken for the polygon around it
//!
//! ```text
//! q + R (cos t, sin t),  t = (j + 1/2) pi / (2 n),  R = r / cos(pi / (4 n))
//! ```
//!
//! which touches the arc in n places a quarter turn and is never nearer than r to the corner.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use meetpoint_geometry::{Point2, Vector2};

/// How far the polygon may stand out from the arc, in cells: at cells of 0.05 m some 6 mm.
const BULGE_MAX: f64 = 0.125;
/// Points a quarter turn, at most: enough for robots of 100 cells.
const N_A_QUARTER_MAX: usize = 16;

/// The polygon around a disc.
#[derive(Clone, Debug)]
pub(crate) struct Outline {
    n_a_quarter: usize,
    points: Vec<Vector2<f64>>,
}

impl Outline {
    /// The polygon around the disc of `radius` cells.
    pub(crate) fn new(radius: f64) -> Self {
        let outer = |n: usize| radius / (FRAC_PI_4 / n as f64).cos();
        let is_close = |&n: &usize| outer(n) - radius <= BULGE_MAX;
        let n_a_quarter = (1..N_A_QUARTER_MAX).find(is_close).unwrap_or(N_A_QUARTER_MAX);
        let point = |j: usize| {
            let (sin, cos) = ((j as f64 + 0.5) * FRAC_PI_2 / n_a_quarter as f64).sin_cos();
            Vector2::new(cos, sin) * outer(n_a_quarter)
        };
        Self { n_a_quarter, points: (0..4 * n_a_quarter).map(point).collect() }
    }

    /// How far the polygon reaches at most.
    pub(crate) fn reach(&self) -> f64 {
        self.points[0].norm()
    }

    /// The point that lies farthest in a direction.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "an angle")]
    pub(crate) fn farthest(&self, direction: Vector2<f64>) -> Vector2<f64> {
        let angle = direction.y.atan2(direction.x).rem_euclid(4.0 * FRAC_PI_2);
        let j = (angle / FRAC_PI_2 * self.n_a_quarter as f64) as usize;
        self.points[j % self.points.len()]
    }
}

/// A point where a string turns, with the corner it turns around, if it does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Turn {
    pub(crate) point: Point2<f64>,
    pub(crate) corner: Option<Point2<f64>>,
}

/// The string from `a` to `b` that lies tight around all `corners` which stand out from the line
/// between the two on the side of `side`, 1 for left and -1 for right; without its ends, appended
/// to `turns`. By quickhull: W. Eddy, "A new convex hull algorithm for planar sets", ACM
/// Transactions on Mathematical Software 3 (1977).
pub(crate) fn tight_around(
    corners: &[Point2<f64>],
    outline: &Outline,
    side: f64,
    [a, b]: [Point2<f64>; 2],
    turns: &mut Vec<Turn>,
) {
    let along = b - a;
    let length = along.norm();
    if length < 1e-9 {
        return;
    }
    let out = Vector2::new(-along.y, along.x) * (side / length);
    let height = |corner: &&Point2<f64>| out.dot(&corner.coords);
    let Some(&corner) = corners.iter().max_by(|p, q| height(p).total_cmp(&height(q))) else {
        return;
    };
    let point = corner + outline.farthest(out);
    let (forth, up) = ((point - a).dot(&along) / length, (point - a).dot(&out));
    // Points of the string itself are found again, but for rounding.
    if up < 1e-7 || forth <= 0.0 || length <= forth {
        return;
    }
    tight_around(corners, outline, side, [a, point], turns);
    turns.push(Turn { point, corner: Some(corner) });
    tight_around(corners, outline, side, [point, b], turns);
}
