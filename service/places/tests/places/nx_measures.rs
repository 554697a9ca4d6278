//! Measures, rules, hill-climb and strategies on readings of drawn walls.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use meetpoint_geometry::{Point2, Vector2, angle_between};
use meetpoint_places::qualitative::{
    Goal, Ring, Scale, Strategy, Surroundings, climb, distinctiveness, fitting, goal, steering_rad,
    surroundings,
};
use meetpoint_sim::Building;

const SCALE: Scale = Scale::CORRIDORS_OF_2_M;

/// A corridor that ends in another: characters of 1 m, so that corridors are two wide.
const T_JUNCTION: &str = "
    ####################
    ....................
    ....................
    #########..#########
    #########..#########
    #########..#########
    #########..#########";
const DEAD_END: &str = "
    ##############
    #.............
    #.............
    ##############";
/// A hall of which the wall below has a corridor's mouth.
const HALL: &str = "
    ....................
    ....................
    ....................
    ....................
    ....................
    #########..#########
    #########..#########
    #########..#########
    #########..#########";

fn building(drawing: &str) -> Building {
    Building::from_drawing(drawing, 1.0).expect("a drawing")
}

/// What sixteen sonars that never err hear, the first of which looks along `heading_rad`.
fn ring(building: &Building, at: Point2<f64>, heading_rad: f64) -> Ring {
    let range_m = |index: u32| {
        let bearing_rad = heading_rad + TAU * f64::from(index) / 16.0;
        building.range_m(at, bearing_rad, SCALE.range_max_m).unwrap_or(f64::INFINITY)
    };
    let ranges_m: Vec<f64> = (0..16).map(range_m).collect();
    Ring::mean_of([&ranges_m[..]], heading_rad, SCALE.range_max_m).expect("readings")
}

fn around(building: &Building, x_m: f64, y_m: f64) -> Surroundings {
    surroundings(&ring(building, Point2::new(x_m, y_m), 0.0), &SCALE)
}

#[test]
fn rules_say_what_is_to_be_maximised() {
    let (junction, end, hall) = (building(T_JUNCTION), building(DEAD_END), building(HALL));
    let goal = |building: &Building, x_m, y_m| goal(&around(building, x_m, y_m));
    assert_eq!(goal(&junction, 10.0, 4.75), Goal::EqualDistances, "three ways and three walls");
    assert_eq!(goal(&junction, 4.0, 5.0), Goal::Passage, "far along the corridor");
    assert_eq!(goal(&end, 2.0, 2.0), Goal::EqualDistances, "walls on three sides");
    assert_eq!(goal(&end, 8.0, 2.0), Goal::Passage, "between two walls");
    assert_eq!(goal(&hall, 10.0, 4.9), Goal::WallDistances, "two corners beside open space");
    assert_eq!(goal(&hall, 4.0, 5.3), Goal::Passage, "along one wall");
    assert_eq!(goal(&hall, 10.0, 7.5), Goal::ComeCloser, "nothing near but the far-off wall");
}

#[test]
fn measures_of_drawn_places() {
    let end = building(DEAD_END);
    let at = |x_m: f64| ring(&end, Point2::new(x_m, 2.0), 0.0);
    let measured = distinctiveness(&at(2.1), &at(2.0), PI, &SCALE);
    assert!(measured.distance_difference_m < 0.1, "a metre from three walls");
    assert!((measured.lateral_m - 2.0).abs() < 1e-9, "across the corridor");
    assert!(measured.symmetry_about_line > 1.0 - 1e-9, "left as right");
    assert!(measured.symmetry_about_center < 0.9, "ahead not as behind");
    assert_eq!(measured.n_open_directions, 1, "back");
    let far = distinctiveness(&at(8.0), &at(7.9), PI, &SCALE);
    assert!(far.symmetry_about_center > 1.0 - 1e-9, "ahead as behind");
    assert!(far.discontinuity < 0.01, "nothing changes");

    let junction = building(T_JUNCTION);
    let at = |x_m: f64| ring(&junction, Point2::new(x_m, 5.0), 0.0);
    let before = distinctiveness(&at(5.0), &at(5.15), 0.0, &SCALE);
    let opens = distinctiveness(&at(7.9), &at(8.05), 0.0, &SCALE);
    assert!(before.discontinuity < 0.1, "{} along smooth walls", before.discontinuity);
    assert!(0.5 < opens.discontinuity, "{} where a sonar looks into it", opens.discontinuity);
    let there = distinctiveness(&at(6.5), &at(9.7), 0.0, &SCALE);
    assert_eq!(there.n_open_directions_gained, 1, "the third way opens");
    assert!(opens.lateral_m <= there.lateral_m, "and it becomes wide");
}

#[test]
fn the_climb_ends_where_three_walls_are_equally_far() {
    let junction = building(T_JUNCTION);
    for (x_m, y_m) in [(9.7, 5.2), (10.0, 3.9), (10.4, 4.6), (10.2, 5.3)] {
        let mut at = Point2::new(x_m, y_m);
        for _ in 0..30 {
            let around = around(&junction, at.x, at.y);
            at += climb(&around, goal(&around), &SCALE).unwrap_or_else(Vector2::zeros);
        }
        // 1 m above the middle of the stem's mouth is the wall; equally far from it and from both
        // corners is a quarter of a metre below the middle of the corridor.
        let off_m = (at - Point2::new(10.0, 4.75)).norm();
        assert!(off_m < 0.25, "from ({x_m}, {y_m}) it ends at {at}");
    }
}

#[test]
fn the_climb_at_a_mouth_ends_beside_both_corners() {
    let hall = building(HALL);
    let mut at = Point2::new(10.1, 4.2);
    for _ in 0..30 {
        let around = around(&hall, at.x, at.y);
        at += climb(&around, goal(&around), &SCALE).unwrap_or_else(Vector2::zeros);
    }
    // The corners are at (9, 4) and (11, 4). 1.3 m from both would be 0.83 m beyond the wall; between
    // two sonars corners seem farther than they are.
    assert!((at.x - 10.0).abs() < 0.1, "{at}: in the middle");
    assert!((0.3..1.0).contains(&(at.y - 4.0)), "{at}: before the mouth");
    let directions = around(&hall, 10.0, 4.83).directions;
    assert_eq!(directions.len(), 3, "into the corridor and along both walls: {directions:?}");
}

/// Where a robot ends that follows a strategy for 10 m.
fn follow(
    building: &Building,
    from: Point2<f64>,
    heading_rad: f64,
) -> (Point2<f64>, f64, Strategy) {
    let (mut at, mut heading_rad) = (from, heading_rad);
    let mut strategy = Strategy::BlindStep;
    for _ in 0..66 {
        let ring = ring(building, at, heading_rad);
        strategy = fitting(&ring, heading_rad, &SCALE);
        heading_rad += steering_rad(strategy, &ring, heading_rad, &SCALE);
        at += Vector2::new(heading_rad.cos(), heading_rad.sin()) * 0.15;
    }
    (at, heading_rad, strategy)
}

#[test]
fn strategies_keep_to_their_lines() {
    let wall = "#".repeat(40);
    let free = ".".repeat(40);
    let corridor = building(&[&*wall, &free, &free, &wall].join("\n"));
    let (at, heading_rad, strategy) = follow(&corridor, Point2::new(5.0, 1.6), 0.3);
    assert_eq!(strategy, Strategy::FollowMidline, "walls on both sides");
    assert!((at.y - 2.0).abs() < 0.05, "{at}: the middle is at 2 m");
    assert!(heading_rad.abs() < 0.05, "{heading_rad} rad");

    let hall = building(&[&*free, &free, &free, &free, &free, &free, &wall].join("\n"));
    let (at, heading_rad, strategy) = follow(&hall, Point2::new(5.0, 2.8), -0.3);
    assert_eq!(strategy, Strategy::WalkAlongRight, "a wall on the right");
    assert!((at.y - 1.0 - SCALE.wall_m).abs() < 0.1, "{at}: the wall ends at 1 m");
    assert!(heading_rad.abs() < 0.05, "{heading_rad} rad");
    let (at, heading_rad, strategy) = follow(&hall, Point2::new(35.0, 2.0), PI + 0.2);
    assert_eq!(strategy, Strategy::WalkAlongLeft, "on the left, who goes the other way");
    assert!((at.y - 1.0 - SCALE.wall_m).abs() < 0.1, "{at}");
    assert!(angle_between(heading_rad, PI).abs() < 0.05, "{heading_rad} rad");

    let (at, _, strategy) = follow(&hall, Point2::new(5.0, 5.0), FRAC_PI_2 - 1.0);
    assert_eq!(strategy, Strategy::BlindStep, "nothing near");
    assert!(9.0 < (at - Point2::new(5.0, 5.0)).norm(), "{at}: straight on");
}
