//! The scrolling map against its definition.

use std::f64::consts::PI;

use meetpoint_geometry::{Cell, GridFrame, Pose};
use meetpoint_occupancy::{BeamModel, Grid, LaserGeometry, ScanMarks};
use meetpoint_places::ScrollingMap;
use proptest::prelude::*;

const LASER: LaserGeometry = LaserGeometry {
    angle_min_rad: -PI,
    angle_increment_rad: PI / 8.0,
    n_beams: 16,
    range_min_m: 0.0,
    range_max_m: 9.0,
};

type Scan = (Pose, Vec<f32>);

fn frame() -> GridFrame {
    GridFrame::new(0.1).expect("a length")
}

/// What scans draw where nothing is forgotten.
fn drawn(scans: &[Scan]) -> Grid {
    let mut grid = Grid::new(frame());
    for (pose, ranges_m) in scans {
        grid.insert_scan(*pose, &LASER, ranges_m, &BeamModel::INDOOR, &mut ScanMarks::new());
    }
    grid
}

proptest! {
    /// A cell is what those scans say of it that came since it was outside of the window.
    #[test]
    fn a_cell_is_what_was_seen_since_it_came_into_the_window(
        steps in prop::collection::vec((-0.8_f64..0.8, -0.8_f64..0.8, -3.0_f64..3.0), 1..8),
        ranges_m in prop::collection::vec(0.3_f32..4.0, 16),
        slack_m in 0.0_f64..0.6,
    ) {
        let mut map = ScrollingMap::new(frame(), 3.0, slack_m);
        let (mut scans, mut windows) = (vec![], vec![]);
        let (mut x, mut y) = (0.0, 0.0);
        for (dx, dy, theta) in steps {
            (x, y) = (x + dx, y + dy);
            let pose = Pose::new(x, y, theta);
            let scan = (&LASER, ranges_m.as_slice());
            map.insert_scan(pose, Pose::IDENTITY, scan, &BeamModel::INDOOR);
            scans.push((pose, ranges_m.clone()));
            windows.push(map.window());
            let robot = frame().cell_at(pose.position());
            prop_assert!(map.window().index_of(robot).is_some(), "the robot is in its window");
        }
        let local = map.local_map().raster;
        prop_assert_eq!(local.info, map.window());
        let since: Vec<Grid> = (0..=scans.len()).map(|from| drawn(&scans[from..])).collect();
        for (index, cell) in local.info.cells().enumerate() {
            let is_in = |at: &usize| windows[*at].index_of(cell).is_some();
            let first = (0..windows.len()).rev().take_while(is_in).last().unwrap_or(windows.len());
            let expected = since[first].log_odds(cell);
            let found = Some(local.log_odds[index]).filter(|odds| !odds.is_nan());
            prop_assert_eq!(found, expected, "{:?} since scan {}", cell, first);
        }
    }
}

#[test]
fn lengths_that_are_none_give_the_least_window() {
    for side_m in [f64::NAN, -1.0, 0.0] {
        let map = ScrollingMap::new(frame(), side_m, side_m);
        assert_eq!(map.window().n_cells(), 1, "{side_m} m");
        assert_eq!(map.window().first, Cell { x: 0, y: 0 }, "{side_m} m");
    }
    let side = ScrollingMap::new(frame(), f64::INFINITY, 0.0).window().width;
    assert!(side < 10_000, "{side} cells are bounded");
}
