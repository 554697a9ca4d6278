//! The walls of a map as points with the direction that they face.

use std::collections::BTreeMap;

use meetpoint_geometry::{Cell, Point2, Vector2};

use crate::ground::{Ground, Known};

/// A piece of wall, about as long as a cell of the ground is wide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Wall {
    pub(crate) at: Point2<f64>,
    /// Unit vector across the wall; `None` at corners, posts and clutter. Its sign means nothing unless
    /// `is_one_sided`.
    pub(crate) normal: Option<Vector2<f64>>,
    /// True if the normal points to free space, and there is none behind.
    pub(crate) is_one_sided: bool,
}

/// Walls this far around, in metres, tell the direction of one.
const NORMAL_RADIUS_M: f64 = 0.35;
/// Fewer walls around tell no direction.
const N_AROUND_MIN: usize = 4;
/// Share of the spread along a wall that the spread across it may have: squares.
const STRAIGHT_SHARE_MAX: f64 = 0.15;
/// How far in front of a wall and behind it is asked whether it is free, in metres.
const FACING_M: [f64; 2] = [0.15, 0.25];

/// The walls at some points, one a cell of the ground, by cell. What is surrounded by walls is left out:
/// nobody sees it, drawings fill it.
pub(crate) fn walls(ground: &Ground, points: &[Point2<f64>]) -> Vec<Wall> {
    let mut by_cell: BTreeMap<(i32, i32), (Vector2<f64>, f64)> = BTreeMap::new();
    for point in points {
        let cell = ground.info.frame.cell_at(*point);
        let sum = by_cell.entry((cell.y, cell.x)).or_insert((Vector2::zeros(), 0.0));
        sum.0 += point.coords;
        sum.1 += 1.0;
    }
    by_cell.retain(|&(y, x), _| !is_inside(ground, Cell { x, y }));
    let at: BTreeMap<(i32, i32), Point2<f64>> =
        by_cell.into_iter().map(|(cell, (sum, n))| (cell, Point2::from(sum / n))).collect();
    at.iter().map(|(&cell, &point)| wall(ground, &at, (cell, point))).collect()
}

/// True if all eight neighbours are walls.
fn is_inside(ground: &Ground, cell: Cell) -> bool {
    let around = (-1..=1).flat_map(|y| (-1..=1).map(move |x| (x, y)));
    around
        .map(|(x, y)| Cell { x: cell.x + x, y: cell.y + y })
        .all(|near| ground.cell(near) == Known::Wall)
}

fn wall(
    ground: &Ground,
    all: &BTreeMap<(i32, i32), Point2<f64>>,
    ((row, column), at): ((i32, i32), Point2<f64>),
) -> Wall {
    #[expect(clippy::cast_possible_truncation, reason = "a few cells")]
    let reach = (NORMAL_RADIUS_M / ground.edge_m()).ceil() as i32;
    let (mut n, mut sum) = (0_usize, Vector2::zeros());
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for y in row - reach..=row + reach {
        for (_, other) in all.range((y, column - reach)..=(y, column + reach)) {
            let away = other - at;
            if away.norm() <= NORMAL_RADIUS_M {
                n += 1;
                sum += away;
                xx += away.x * away.x;
                xy += away.x * away.y;
                yy += away.y * away.y;
            }
        }
    }
    let count = n as f64;
    (xx, xy, yy) =
        (xx - sum.x * sum.x / count, xy - sum.x * sum.y / count, yy - sum.y * sum.y / count);
    let spread = (0.25 * (xx - yy) * (xx - yy) + xy * xy).sqrt();
    let (most, least) = (0.5 * (xx + yy) + spread, 0.5 * (xx + yy) - spread);
    if n < N_AROUND_MIN || STRAIGHT_SHARE_MAX * most < least {
        return Wall { at, normal: None, is_one_sided: false };
    }
    let along_rad = 0.5 * (2.0 * xy).atan2(xx - yy);
    let normal = Vector2::new(-along_rad.sin(), along_rad.cos());
    faced(ground, at, normal)
}

/// Turns a wall towards free space.
fn faced(ground: &Ground, at: Point2<f64>, normal: Vector2<f64>) -> Wall {
    let is_free = |side: f64| {
        FACING_M.iter().any(|distance_m| ground.at(at + normal * side * *distance_m) == Known::Free)
    };
    match (is_free(1.0), is_free(-1.0)) {
        (true, false) => Wall { at, normal: Some(normal), is_one_sided: true },
        (false, true) => Wall { at, normal: Some(-normal), is_one_sided: true },
        _ => Wall { at, normal: Some(normal), is_one_sided: false },
    }
}

/// Direction of most walls modulo a quarter turn, in radians, and how many say so, in 0..=1: the mean
/// of the unit vectors of four times the angle.
pub(crate) fn main_direction(walls: &[Wall]) -> (f64, f64) {
    let (mut sum, mut n) = (Vector2::zeros(), 0.0);
    for normal in walls.iter().filter_map(|wall| wall.normal) {
        let (sin, cos) = (4.0 * normal.y.atan2(normal.x)).sin_cos();
        sum += Vector2::new(cos, sin);
        n += 1.0;
    }
    (sum.y.atan2(sum.x) / 4.0, sum.norm() / f64::max(n, 1.0))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use meetpoint_geometry::{GridFrame, GridInfo};
    use meetpoint_occupancy::{Grid, Raster};
    use proptest::prelude::*;

    use super::*;

    /// The map of a half plane: free on the side to which a direction points, a wall 0.1 m deep at its
    /// edge, unknown behind.
    fn half_plane(direction_rad: f64) -> Vec<Wall> {
        let frame = GridFrame::new(0.05).expect("a length");
        let info = GridInfo { frame, first: Cell { x: -60, y: -60 }, width: 120, height: 120 };
        let (sin, cos) = direction_rad.sin_cos();
        let cells = (-60..60).flat_map(|y| (-60..60).map(move |x| Cell { x, y }));
        let log_odds = cells.map(|cell| {
            let point = frame.center_of(cell);
            match cos * point.x + sin * point.y {
                across_m if 0.0 <= across_m => -3.0,
                across_m if -0.1 < across_m => 3.0,
                _ => f32::NAN,
            }
        });
        let raster = Raster { info, log_odds: log_odds.collect() };
        let (ground, points) = Ground::of_grid(&Grid::from_raster(&raster));
        walls(&ground, &points)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(16))]

        #[test]
        fn a_wall_faces_free_space(direction_rad in -PI..PI) {
            let walls = half_plane(direction_rad);
            let (sin, cos) = direction_rad.sin_cos();
            let inner = walls.iter().filter(|wall| wall.at.coords.norm() < 2.0);
            for wall in inner {
                let normal = wall.normal.expect("a straight wall");
                prop_assert!(wall.is_one_sided, "{wall:?}");
                prop_assert!(0.95 < normal.x * cos + normal.y * sin, "{wall:?} of {direction_rad}");
            }
            let (found_rad, share) = main_direction(&walls);
            let quarters = (found_rad - direction_rad) / (0.5 * PI);
            prop_assert!((quarters - quarters.round()).abs() < 0.05, "{found_rad} of {direction_rad}");
            prop_assert!(0.8 < share, "{share}");
        }
    }
}
