//! Drawn shapes as cells, against their definitions.

use meetpoint_geometry::{Cell, GridFrame, GridInfo, Point2};
use meetpoint_planning::{Shape, cells_inside};
use proptest::prelude::*;

const SIDE_M: f64 = 0.25;

fn info() -> GridInfo {
    let frame = GridFrame::new(SIDE_M).expect("a length");
    GridInfo { frame, first: Cell { x: -7, y: 4 }, width: 19, height: 13 }
}

/// Points around the rectangle of [`info`], many on corners of cells.
fn point() -> impl Strategy<Value = Point2<f64>> {
    let any = (-4.0..6.0, -1.0..6.0).prop_map(|(x, y)| Point2::new(x, y));
    let corner = (-16..24_i32, -4..24_i32)
        .prop_map(|(x, y)| Point2::new(f64::from(x) * SIDE_M, f64::from(y) * SIDE_M));
    prop_oneof![3 => any, 1 => corner]
}

fn points(n: std::ops::Range<usize>) -> impl Strategy<Value = Vec<Point2<f64>>> {
    proptest::collection::vec(point(), n)
}

/// Centre of a cell, by index.
fn center(index: usize) -> Point2<f64> {
    let (x, y) = (index % info().width as usize, index / info().width as usize);
    let at = |first: i32, along: usize| (f64::from(first) + along as f64 + 0.5) * SIDE_M;
    Point2::new(at(info().first.x, x), at(info().first.y, y))
}

/// From a segment to a square: by many points of both, so that no true distance is larger.
fn distance(a: Point2<f64>, b: Point2<f64>, center: Point2<f64>) -> f64 {
    const N: u32 = 400;
    let to_square = |p: Point2<f64>| {
        let outside = |d: f64| (d.abs() - SIDE_M / 2.0).max(0.0);
        outside(p.x - center.x).hypot(outside(p.y - center.y))
    };
    let along = |n: u32| a + (b - a) * (f64::from(n) / f64::from(N));
    (0..=N).map(|n| to_square(along(n))).fold(f64::INFINITY, f64::min)
}

/// How far the sampled distance may be above the true one, in metres.
fn slack(a: Point2<f64>, b: Point2<f64>) -> f64 {
    (b - a).norm() / 800.0 + 1e-9
}

/// Winding by angles: around a point that is inside, the turns of a polygon without crossings add up.
fn is_inside(polygon: &[Point2<f64>], p: Point2<f64>) -> bool {
    let turn = |a: Point2<f64>, b: Point2<f64>| {
        let (a, b) = (a - p, b - p);
        (a.x * b.y - a.y * b.x).atan2(a.dot(&b))
    };
    let next = polygon.iter().cycle().skip(1);
    let turns: f64 = polygon.iter().zip(next).map(|(&a, &b)| turn(a, b)).sum();
    std::f64::consts::PI < turns.abs()
}

fn flags(cells: &[usize]) -> Vec<bool> {
    let mut flags = vec![false; info().n_cells()];
    for &cell in cells {
        flags[cell] = true;
    }
    flags
}

proptest! {
    #[test]
    fn lines_touch_what_is_near(points in points(1..4), width_m in 0.0..1.5) {
        let touched = flags(&Shape::Polyline { points: points.clone(), width_m }.touched(info()));
        for (cell, &is_touched) in touched.iter().enumerate() {
            let (mut is_near, mut is_far) = (false, true);
            let ends = if points.len() == 1 { vec![[points[0]; 2]] } else {
                points.windows(2).map(|ends| [ends[0], ends[1]]).collect()
            };
            for [a, b] in ends {
                let found = distance(a, b, center(cell));
                is_near |= found <= width_m / 2.0 - 1e-9;
                is_far &= width_m / 2.0 + slack(a, b) < found;
            }
            prop_assert!(!is_near || is_touched, "{} is near", center(cell));
            prop_assert!(!is_far || !is_touched, "{} is far", center(cell));
        }
    }

    #[test]
    fn triangles_hold_what_is_inside(points in points(3..4)) {
        let inside = flags(&cells_inside(&points, info()));
        let touched = flags(&Shape::Polygon(points.clone()).touched(info()));
        for cell in 0..inside.len() {
            let p = center(cell);
            let edges = || points.iter().zip(points.iter().cycle().skip(1));
            // On an edge either answer is right.
            let to_edge = |a: &Point2<f64>, b: &Point2<f64>| {
                let along = b - a;
                let share = ((p - a).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
                (a + along * if share.is_nan() { 0.0 } else { share } - p).norm()
            };
            let nearest = edges().map(|(a, b)| to_edge(a, b)).fold(f64::INFINITY, f64::min);
            if 1e-9 < nearest {
                prop_assert_eq!(inside[cell], is_inside(&points, p), "{}", p);
            }
            let is_near = edges().any(|(a, b)| distance(*a, *b, p) <= 0.0);
            let is_far = edges().all(|(a, b)| slack(*a, *b) < distance(*a, *b, p));
            prop_assert!(touched[cell] || !(is_near || inside[cell]), "{} is touched", p);
            prop_assert!(!touched[cell] || !is_far || inside[cell], "{} is not touched", p);
        }
    }
}

#[test]
fn what_lies_outside_is_clipped() {
    let far = [(-1e5, -1e5), (1e5, -1e5), (0.0, 1e5)].map(|(x, y)| Point2::new(x, y)).to_vec();
    assert_eq!(cells_inside(&far, info()).len(), info().n_cells(), "all of it lies inside");
    let beside = Shape::Polyline { points: far[..2].to_vec(), width_m: 100.0 };
    assert_eq!(beside.touched(info()), [], "nothing is near");
    assert_eq!(cells_inside(&far[..1], info()), [], "a point has no inside");
    assert_eq!(cells_inside(&[], info()), [], "nor has nothing");
}
