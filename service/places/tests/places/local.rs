//! Rooms and corridors, drawn, and the stars of their places.

use std::fmt::Write;

use expect_test::{Expect, expect};
use meetpoint_geometry::{Cell, GridFrame, GridInfo, Point2, Pose};
use meetpoint_occupancy::Raster;
use meetpoint_places::{
    Gateway, GatewayCriterion, LargeScaleStar, LocalParams, LocalPerceptualMap, LocalPlace,
    ParsedMap, PlaceId, parsed_map,
};

/// A character of a drawing, in cells and in metres.
const CHARACTER: usize = 10;
const CHARACTER_M: f64 = 0.5;

/// Cells of 0.05 m: `.` is free, `?` was never observed, all else is wall. The lower left corner of
/// the drawing is the origin.
fn drawn(drawing: &str) -> Raster {
    let rows: Vec<&[u8]> = drawing.trim().lines().map(|row| row.trim().as_bytes()).collect();
    let (width, height) = (rows[0].len() * CHARACTER, rows.len() * CHARACTER);
    let sign = |index: usize| {
        let (x, y) = (index % width / CHARACTER, index / width / CHARACTER);
        rows[rows.len() - 1 - y][x]
    };
    let log_odds = (0..width * height).map(|index| match sign(index) {
        b'.' => -2.0,
        b'?' => f32::NAN,
        _ => 2.0_f32,
    });
    let frame = GridFrame::new(0.05).expect("a length");
    let [width, height] = [width, height].map(|n| u32::try_from(n).expect("small"));
    let info = GridInfo { frame, first: Cell { x: 0, y: 0 }, width, height };
    Raster { info, log_odds: log_odds.collect() }
}

/// The drawing turned left by a quarter of a circle.
fn turned(drawing: &str) -> String {
    let rows: Vec<Vec<char>> =
        drawing.trim().lines().map(|row| row.trim().chars().collect()).collect();
    let column = |x: usize| rows.iter().map(|row| row[x]).collect::<String>();
    let columns: Vec<String> = (0..rows[0].len()).rev().map(column).collect();
    columns.join("\n")
}

fn parsed(drawing: &str) -> ParsedMap {
    parsed_map(&drawn(drawing), &LocalParams::INDOOR)
}

/// Stars of the places and where they are, in metres; what lies on a path in parentheses.
fn told(parsed: &ParsedMap) -> String {
    let mut told = String::new();
    for LocalPlace { core, star, place, gateways, .. } in &parsed.neighborhoods {
        let core = format!("({:.1}, {:.1})", core.x, core.y);
        let centers: Vec<String> = gateways
            .iter()
            .map(|gateway| {
                let (center, heading_deg) = (gateway.center(), gateway.heading_rad.to_degrees());
                let width_m = gateway.width_m();
                format!("({:.1}, {:.1}) {heading_deg:.0}° {width_m:.1} m", center.x, center.y)
            })
            .collect();
        let star = if place.is_some() { star.to_string() } else { format!("({star})") };
        writeln!(told, "{star} at {core}: {}", centers.join(", ")).expect("a string");
    }
    told
}

fn check(drawing: &str, expected: &Expect) {
    expected.assert_eq(&told(&parsed(drawing)));
}

const CROSSING: &str = "
    ########....########
    ########....########
    ########....########
    ########....########
    ########....########
    ########....########
    ....................
    ....................
    ....................
    ....................
    ########....########
    ########....########
    ########....########
    ########....########
    ########....########
    ########....########";

const JUNCTION: &str = "
    ....................
    ....................
    ....................
    ....................
    ########....########
    ########....########
    ########....########
    ########....########
    ########....########
    ########....########";

const FIGURE_3: &str = "
    ############....############
    ############....############
    ############....############
    ############....############
    ############....############
    ############....############
    ############................
    ############................
    ............................
    ................############
    ................############
    ............................
    ############................
    ############................
    ############....############
    ############....############
    ############....############
    ############....############
    ############....############
    ############....############";

#[test]
fn corridors_that_cross() {
    check(
        CROSSING,
        &expect![[r"
        abab at (5.0, 4.0): (5.0, 5.0) 90° 2.1 m, (6.0, 4.0) 0° 2.1 m, (5.0, 3.0) -90° 2.1 m, (4.0, 4.0) 180° 2.1 m
    "]],
    );
    check(
        JUNCTION,
        &expect![[r"
        aba at (5.0, 3.7): (6.0, 4.0) 0° 2.1 m, (5.0, 3.0) -90° 2.1 m, (4.0, 4.0) 180° 2.1 m
    "]],
    );
}

#[test]
fn a_dead_end_is_a_place_and_a_corner_is_not() {
    check(
        "####################
         ####................
         ####................
         ####................
         ####................
         ####################",
        &expect![[r"
            a at (3.0, 1.5): (3.0, 1.5) 0° 2.1 m
        "]],
    );
    check(
        "####################....
         ####################....
         ####################....
         ####################....
         ####################....
         ####################....
         ........................
         ........................
         ........................
         ........................",
        &expect![[""]],
    );
}

#[test]
fn rooms_with_two_doors() {
    // One opposite the other: the path passes. Around a corner: two paths end.
    check(
        "####..########
         ####..########
         ####..########
         ####..########
         #............#
         #............#
         #............#
         #............#
         #............#
         #............#
         #............#
         #............#
         ####..########
         ####..########
         ####..########
         ####..########",
        &expect![[r"
            (aa) at (2.5, 4.0): (2.5, 2.0) -90° 1.1 m, (2.5, 6.0) 90° 1.1 m
        "]],
    );
    check(
        "####..##########
         ####..##########
         #............###
         #............###
         #............###
         #...............
         #...............
         #............###
         #............###
         #............###
         ################",
        &expect![[r"
            ab at (2.6, 2.5): (6.5, 2.5) 0° 1.1 m, (2.5, 4.5) 90° 1.1 m
        "]],
    );
}

fn only_place(drawing: &str) -> LocalPlace {
    let parsed = parsed(drawing);
    let widest = parsed.places().max_by_key(|(_, place)| place.gateways.len());
    widest.expect("a place").1.clone()
}

#[test]
fn figure_3_of_the_paper() {
    let place = only_place(FIGURE_3);
    expect![[r"
        (PF1+, gw1 out & gw4 in, MIDLINE)
        (PF2+, gw2 out, MIDLINE)
        (PF3+, gw5 in, DEADEND)
        (PF4+, gw3 out, MIDLINE)
        (PF1-, gw4 out & gw1 in, MIDLINE)
        (PF4-, gw3 in, DEADEND)
        (PF3-, gw5 out, MIDLINE)
        (PF2-, gw2 in, DEADEND)"]]
    .assert_eq(&place.small_scale_star.to_string());
    let star = LargeScaleStar::from(place.small_scale_star);
    expect![[r"
        (ds1, Pa1+)
        (ds2, Pa2+)
        (ds3, (Pa3+))
        (ds4, Pa4+)
        (ds5, Pa1-)
        (ds6, (Pa4-))
        (ds7, Pa3-)
        (ds8, (Pa2-))"]]
    .assert_eq(&star.to_string());
    // Arriving by gateway 5, one faces (Pa3+): right are the ways down to Pa3-, which is back.
    let names = |states: Vec<usize>| {
        states.iter().map(|state| format!("ds{}", state + 1)).collect::<Vec<_>>().join(" ")
    };
    assert_eq!(names(star.turns_right(2)), "ds4 ds5 ds6", "gateways 3 and 4, and 3's other side");
    assert_eq!(names(star.turns_left(2)), "ds2 ds1 ds8", "gateways 2 and 1, and 2's other side");
    assert_eq!(star.turned_around(2), 6, "back");
}

#[test]
fn the_criteria_agree_on_stars_and_nearly_on_where_gateways_are() {
    for drawing in [CROSSING, JUNCTION, FIGURE_3] {
        let widest = |criterion: GatewayCriterion| {
            let parsed = parsed_map(&drawn(drawing), &LocalParams::INDOOR.by(criterion));
            let places = parsed.places().map(|(_, place)| place.clone());
            places.max_by_key(|place| place.gateways.len()).expect("a place")
        };
        let [by_constriction, others @ ..] = GatewayCriterion::ALL.map(widest);
        for other in others {
            assert_eq!(other.star, by_constriction.star, "{drawing}");
            for (a, b) in other.gateways.iter().zip(&by_constriction.gateways) {
                let apart_m = (a.center() - b.center()).norm();
                assert!(apart_m < 0.7, "{apart_m} m apart in{drawing}");
            }
        }
    }
}

#[test]
fn a_map_that_is_not_finished_has_gateways_that_lead_nowhere_yet() {
    let parsed = parsed(
        "##########################
         #.....................????
         #.....................????
         #.....................????
         #.....................????
         ##############....########
         ##############....########
         ##############....########
         ##############....########
         ##############????########",
    );
    expect![[r"
        aba at (8.0, 3.2): (9.0, 3.5) 0° 2.1 m, (8.0, 2.5) -90° 2.0 m, (7.0, 3.5) 180° 2.1 m
        a at (1.5, 3.5): (1.5, 3.5) 0° 2.1 m
    "]]
    .assert_eq(&told(&parsed));
    let (_, junction) = parsed.places().find(|(_, place)| place.gateways.len() == 3).expect("one");
    let id = junction.place.expect("a place");
    let leads: Vec<Option<PlaceId>> = (0..3)
        .map(|index| parsed.map.leads_to(Gateway { place: id, index }).map(|to| to.place))
        .collect();
    let dead_end = parsed.places().find(|(_, place)| place.gateways.len() == 1).map(|(id, _)| id);
    assert_eq!(leads, [None, None, dead_end], "east and south are not known");
}

#[test]
fn what_lies_behind_walls_is_cut_away() {
    let raster = drawn(
        "##############
         #......#.....#
         #......#.....#
         #......#.....#
         #......#.....#
         ##############",
    );
    let local = LocalPerceptualMap::cut(&raster, Point2::new(1.01, 1.01), 5.0).expect("free");
    let at = |x_m: f64, y_m: f64| {
        let map = Point2::new(x_m, y_m);
        let cell = raster.info.frame.cell_at(local.map_from_local.inverse() * map);
        local.raster.info.index_of(cell).map(|index| local.raster.log_odds[index])
    };
    assert_eq!(at(3.4, 2.4), Some(-2.0), "the room");
    assert_eq!(at(3.51, 2.4), Some(2.0), "its wall");
    assert!(at(4.2, 2.4).is_none_or(f32::is_nan), "the next room");
    assert!(LocalPerceptualMap::cut(&raster, Point2::new(3.7, 1.0), 5.0).is_none(), "in a wall");
    let near = LocalPerceptualMap::cut(&raster, Point2::new(1.0, 1.0), 1.0).expect("free");
    assert!(near.raster.info.width <= 41, "no farther than a metre");
}

#[test]
fn a_map_cut_around_a_place_has_the_star_of_the_place() {
    for drawing in [CROSSING, JUNCTION, FIGURE_3] {
        let raster = drawn(drawing);
        let whole = only_place(drawing);
        let local = LocalPerceptualMap::cut(&raster, whole.core, 5.0).expect("free");
        let core = local.map_from_local.inverse() * whole.core;
        let place = local.place_at(core, &LocalParams::INDOOR).expect("a place");
        assert_eq!(place.star, whole.star, "{drawing}");
    }
}

#[test]
fn the_place_at_a_point_is_that_of_the_whole_map() {
    let params = LocalParams::INDOOR;
    for drawing in [CROSSING, JUNCTION, FIGURE_3] {
        let raster = drawn(drawing);
        let parsed = parsed_map(&raster, &params);
        let local = LocalPerceptualMap { raster, map_from_local: Pose::IDENTITY };
        for at in 0..200 {
            let point = Point2::new(f64::from(at % 14), f64::from(at / 14));
            let plain = |place: LocalPlace| (place.core, place.gateways, place.small_scale_star);
            let expected = parsed.at(point, &params).cloned().map(plain);
            assert_eq!(local.place_at(point, &params).map(plain), expected, "{point} in{drawing}");
        }
    }
}

/// A drawing, 20 characters a side, of corridors of one width that meet in its middle: of each of
/// four whether it is there.
fn arms(width: usize, arms: [bool; 4]) -> String {
    let side = 20;
    let mut signs = vec![vec!['#'; side]; side];
    for (arm, _) in arms.iter().enumerate().filter(|(_, is_open)| **is_open) {
        for (along, across) in (0..10).flat_map(|along| (8..8 + width).map(move |at| (along, at))) {
            let (x, y) = match arm {
                0 => (across, along),
                1 => (side - 1 - along, across),
                2 => (across, side - 1 - along),
                _ => (along, across),
            };
            signs[y][x] = '.';
        }
    }
    let rows: Vec<String> = signs.iter().map(|row| row.iter().collect()).collect();
    rows.join("\n")
}

#[test]
fn a_turned_drawing_has_turned_stars() {
    let height_m = 20.0 * CHARACTER_M;
    for (width, open) in (2..5).flat_map(|width| (0..16).map(move |open| (width, open))) {
        let drawing = arms(width, [0, 1, 2, 3].map(|arm| open >> arm & 1 == 1));
        let (plain, left) = (parsed(&drawing), parsed(&turned(&drawing)));
        assert_eq!(plain.map.n_places(), left.map.n_places(), "{drawing}");
        for (_, place) in plain.places() {
            let is_same = |other: &LocalPlace| {
                let core = Point2::new(height_m - place.core.y, place.core.x);
                let mut gateways = 0..place.star.n_gateways();
                (other.core - core).norm() < 0.2
                    && gateways.any(|at| other.star.looks_from(at, &place.star))
            };
            let is_there = left.places().any(|(_, other)| is_same(other));
            assert!(is_there, "{} in\n{drawing}", place.star);
        }
    }
}

#[test]
fn a_building_is_the_map_of_its_places() {
    // A corridor around a block with a door on each side, a way out, and a room behind a door.
    let parsed = parsed(
        "############################
         #......................#####
         #......................#####
         #......................#####
         #...################...#####
         #...################...#####
         #...################...#####
         #...#.......########........
         #...........########........
         #...........########........
         #...#.......########...#####
         #...#.......########...#####
         #...#.......########...#####
         #...################...#####
         #...################...#####
         #......................#####
         #......................#####
         #......................#####
         ############################",
    );
    expect![[r"
        a at (4.5, 4.5): (2.5, 5.0) 180° 1.0 m
        abb at (11.0, 5.2): (11.5, 5.2) 0° 1.5 m, (10.8, 4.5) -90° 1.5 m, (10.8, 6.0) 90° 1.5 m
        abb at (1.4, 5.0): (2.0, 5.0) 0° 1.0 m, (1.2, 4.5) -90° 1.5 m, (1.2, 5.5) 90° 1.5 m
    "]]
    .assert_eq(&told(&parsed));
    let links = parsed.map.gateways().filter_map(|gateway| {
        let to = parsed.map.leads_to(gateway)?;
        (gateway < to).then(|| {
            let name = |Gateway { place, index }: Gateway| format!("{}.{index}", place.0);
            format!("{}-{}", name(gateway), name(to))
        })
    });
    expect!["0.0-2.0 1.1-2.1 1.2-2.2"].assert_eq(&links.collect::<Vec<_>>().join(" "));
}
