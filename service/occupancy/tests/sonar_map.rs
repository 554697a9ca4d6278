//! A map drawn from sonar alone, by the network that ships, against the building.

use meetpoint_geometry::{Cell, GridFrame, Pose};
use meetpoint_occupancy::{
    BeamModel, Grid, Interpretation, LaserGeometry, Network, ScanMarks, SonarModel, SonarRing,
};
use meetpoint_sim::{Building, ChaCha8Rng, route};
use rand::SeedableRng;

/// Two rooms and a corridor; a character is half a metre.
const FLOOR: &str = "
    ########################
    #.........#............#
    #.A.......#.........D..#
    #.........#............#
    #.........#............#
    #.........#............#
    ####...########...######
    #......................#
    #.E.B...........C....F.#
    #......................#
    ########################";

/// Sonar fires every so many points of the path, which are 0.05 m apart.
const N_POINTS_PER_SCAN: usize = 4;

fn sonar_map(building: &Building) -> Grid {
    let sonars = meetpoint_sim::SonarRing::RING_24;
    let ring = SonarRing {
        robot_from_transducer: (0..sonars.n_sonars).map(|at| sonars.robot_from_sonar(at)).collect(),
        cone_rad: sonars.cone_rad,
        range_min_m: sonars.range_min_m,
        range_max_m: sonars.range_max_m,
    };
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let places = building.places("EABFCDCB").expect("places of the drawing");
    let path = route(building, &places, 0.35).expect("a way through both doors");
    let mut grid = Grid::new(GridFrame::new(0.1).expect("a length"));
    for pair in path.windows(2).step_by(N_POINTS_PER_SCAN) {
        let step = pair[1] - pair[0];
        let robot = Pose::new(pair[0].x, pair[0].y, step.y.atan2(step.x));
        let scan = ring.scan(&sonars.scan(building, robot, &mut rng));
        let heard = Interpretation::new(&scan, &Network::shipped(), &SonarModel::INDOOR);
        grid.insert_sonar(robot, &heard, &BeamModel::INDOOR);
    }
    grid
}

/// Distance within which a cone tells nothing about where a wall's face is, in metres.
const BLUR_M: f64 = 0.2;
/// Log-odds of the paper's 0.7: what is beyond, or below their negative, is decided.
const DECIDED: f32 = 0.847;

#[test]
fn walls_and_free_space_are_where_they_are() {
    let building = Building::from_drawing(FLOOR, 0.5).expect("a drawing");
    let grid = sonar_map(&building);
    let frame = grid.frame();
    let is_wall = |cell| building.is_wall(building.info().frame.cell_at(frame.center_of(cell)));
    let log_odds = |cell| grid.log_odds(cell).unwrap_or(0.0);
    let about = |cell: Cell| {
        (-2..=2).flat_map(move |dy| (-2..=2).map(move |dx| Cell { x: cell.x + dx, y: cell.y + dy }))
    };
    let (mut n_open, mut n_free, mut n_blocked) = (0, 0, 0);
    let (mut n_faces, mut n_found) = (0, 0);
    for cell in (0..55).flat_map(|y| (0..120).map(move |x| Cell { x, y })) {
        let has_wall_near = building.clearance_m(frame.center_of(cell), BLUR_M) < BLUR_M;
        if !has_wall_near {
            n_open += 1;
            n_free += i32::from(log_odds(cell) < -DECIDED);
            n_blocked += i32::from(DECIDED < log_odds(cell));
        } else if is_wall(cell) && about(cell).any(|near| !is_wall(near)) {
            n_faces += 1;
            n_found += i32::from(about(cell).any(|near| DECIDED < log_odds(near)));
        }
    }
    let share = |n: i32, of: i32| f64::from(n) / f64::from(of);
    assert!(0.9 < share(n_free, n_open), "{n_free} of {n_open} free cells are free on the map");
    assert!(
        share(n_blocked, n_open) < 0.05,
        "{n_blocked} of {n_open} free cells are walls on the map"
    );
    assert!(
        0.85 < share(n_found, n_faces),
        "{n_found} of {n_faces} cells of walls' faces are found"
    );
}

#[test]
fn absurd_poses_draw_nothing() {
    let mut grid = Grid::new(GridFrame::new(0.1).expect("a length"));
    let ring = SonarRing {
        robot_from_transducer: vec![Pose::IDENTITY, Pose::new(0.0, 0.0, 0.3)],
        cone_rad: 0.26,
        range_min_m: 0.1,
        range_max_m: 6.0,
    };
    let scan = ring.scan(&[1.0, 1.0]);
    let heard = Interpretation::new(&scan, &Network::shipped(), &SonarModel::INDOOR);
    for pose in [Pose::new(f64::NAN, 0.0, 0.0), Pose::new(1e300, 0.0, 0.0)] {
        grid.insert_sonar(pose, &heard, &BeamModel::INDOOR);
    }
    assert_eq!(grid.bounds(), None, "nothing was drawn");
    let nothing = Interpretation::new(&ring.scan(&[]), &Network::shipped(), &SonarModel::INDOOR);
    grid.insert_sonar(Pose::IDENTITY, &nothing, &BeamModel::INDOOR);
    assert_eq!(grid.bounds(), None, "nothing was heard");
}

/// Two readings of the same firings side by side: neither sees the other, and what a laser looks at counts for both.
#[test]
fn what_robots_are_followed_by_is_another_map() {
    let building = Building::from_drawing(FLOOR, 0.5).expect("a drawing");
    let drawn = sonar_map(&building);
    let ring = SonarRing {
        robot_from_transducer: (0..8_u8)
            .map(|at| Pose::new(0.0, 0.0, f64::from(at) * std::f64::consts::FRAC_PI_4))
            .collect(),
        cone_rad: 0.26,
        range_min_m: 0.1,
        range_max_m: 6.0,
    };
    let robot = Pose::new(3.0, 4.0, 0.3);
    let scan = ring.scan(&[1.0, 1.1, 1.2, 1.1, 1.0, 0.9, 0.8, 0.9]);
    let heard = Interpretation::new(&scan, &Network::shipped(), &SonarModel::INDOOR);
    let mut both = drawn.clone();
    both.insert_followed(robot, &heard, &BeamModel::INDOOR);
    let cells = || (0..100).flat_map(|y| (0..100).map(move |x| Cell { x, y }));
    let mut n_followed = 0;
    for cell in cells() {
        assert_eq!(both.log_odds(cell), drawn.log_odds(cell), "nothing is drawn");
        assert_eq!(drawn.followed_log_odds(cell), None, "nothing that is drawn is followed");
        n_followed += usize::from(both.followed_log_odds(cell).is_some());
    }
    assert!(100 < n_followed, "{n_followed} cells are there to be followed by");
    let laser = LaserGeometry {
        angle_min_rad: -3.0,
        angle_increment_rad: 0.01,
        n_beams: 600,
        range_min_m: 0.0,
        range_max_m: 9.0,
    };
    let (model, mut marks) = (BeamModel::INDOOR, ScanMarks::new());
    let before = both.clone();
    both.insert_scan(robot, &laser, &[2.0; 600], &model, &mut marks);
    both.insert_followed(robot, &heard, &model);
    for cell in cells() {
        let is_looked_at = both.log_odds(cell) != before.log_odds(cell);
        let same = both.followed_log_odds(cell) == both.log_odds(cell);
        assert!(!is_looked_at || same, "a laser tells those who follow, too: {cell:?}");
    }
}
