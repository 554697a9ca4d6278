//! Drawn rooms, and their regions drawn back.

#![expect(clippy::needless_raw_string_hashes, reason = "so writes expect-test its updates")]

use expect_test::{Expect, expect};
use meetpoint_topology::{MeetPointParams, TopologyParams, meet_points, segmentation};

use crate::building::{drawn, redrawn};

/// A character is 0.3 m.
const N_CELLS: usize = 6;

fn check(drawing: &str, expected: &Expect) {
    let found = segmentation(&drawn(drawing, N_CELLS), &TopologyParams::INDOOR);
    expected.assert_eq(&redrawn(&found.partition, N_CELLS));
}

#[test]
fn two_rooms_and_a_door() {
    check(
        "#####################
         #.........#.........#
         #.........#.........#
         #.........#.........#
         #...................#
         #...................#
         #...................#
         #.........#.........#
         #.........#.........#
         #####################",
        &expect![[r#"
            #####################
            #aaaaaaaaa#bbbbbbbbb#
            #aaaaaaaaa#bbbbbbbbb#
            #aaaaaaaaa#bbbbbbbbb#
            #aaaaaaaaaabbbbbbbbb#
            #aaaaaaaaaabbbbbbbbb#
            #aaaaaaaaaabbbbbbbbb#
            #aaaaaaaaa#bbbbbbbbb#
            #aaaaaaaaa#bbbbbbbbb#
            #####################"#]],
    );
}

#[test]
fn a_corridor_stays_whole() {
    check(
        "##############################
         #.........#........#.........#
         #.........#........#.........#
         #.........#........#.........#
         #.........#........#.........#
         #.........#........#.........#
         ###...######...########...####
         #............................#
         #............................#
         #............................#
         #............................#
         #............................#
         #####...##############...#####
         #...............#............#
         #...............#............#
         #...............#............#
         #...............#............#
         ##############################",
        &expect![[r#"
            ##############################
            #ddddddddd#eeeeeeee#fffffffff#
            #ddddddddd#eeeeeeee#fffffffff#
            #ddddddddd#eeeeeeee#fffffffff#
            #ddddddddd#eeeeeeee#fffffffff#
            #ddddddddd#eeeeeeee#fffffffff#
            ###ddd######eee########fff####
            #cccccccccccccccccccccccccccc#
            #cccccccccccccccccccccccccccc#
            #cccccccccccccccccccccccccccc#
            #cccccccccccccccccccccccccccc#
            #cccccccccccccccccccccccccccc#
            #####ccc##############ccc#####
            #aaaaaaaaaaaaaaa#bbbbbbbbbbbb#
            #aaaaaaaaaaaaaaa#bbbbbbbbbbbb#
            #aaaaaaaaaaaaaaa#bbbbbbbbbbbb#
            #aaaaaaaaaaaaaaa#bbbbbbbbbbbb#
            ##############################"#]],
    );
}

#[test]
fn furniture_makes_no_rooms() {
    check(
        "##############################
         #............................#
         #..#...#......##.............#
         #.............##........#.#..#
         #..#...#.....................#
         #.......................#.#..#
         #............................#
         #............................#
         #######...####################
         #............................#
         #......#.....................#
         #............................#
         #............................#
         ##############################",
        &expect![[r#"
            ##############################
            #bbbbbbbbbbbbbbbbbbbbbbbbbbbb#
            #bb#bbb#bbbbbb##bbbbbbbbbbbbb#
            #bbbbbbbbbbbbb##bbbbbbbb#b#bb#
            #bb#bbb#bbbbbbbbbbbbbbbbbbbbb#
            #bbbbbbbbbbbbbbbbbbbbbbb#b#bb#
            #bbbbbbbbbbbbbbbbbbbbbbbbbbbb#
            #bbbbbbbbbbbbbbbbbbbbbbbbbbbb#
            #######bbb####################
            #aaaaaaaaaaaaaaaaaaaaaaaaaaaa#
            #aaaaaa#aaaaaaaaaaaaaaaaaaaaa#
            #aaaaaaaaaaaaaaaaaaaaaaaaaaaa#
            #aaaaaaaaaaaaaaaaaaaaaaaaaaaa#
            ##############################"#]],
    );
}

#[test]
fn what_cannot_be_reached_is_a_region_of_its_own() {
    check(
        "##############
         #......#.....#
         #......#.....#
         #......#.....#
         ########.....#
         #..#..##.....#
         ##############",
        &expect![[r#"
            ##############
            #dddddd#ccccc#
            #dddddd#ccccc#
            #dddddd#ccccc#
            ########ccccc#
            #aa#bb##ccccc#
            ##############"#]],
    );
}

#[test]
fn a_fork_has_a_junction_a_bend_a_corner_and_ends() {
    let space = drawn(
        "##############################
         #............................#
         #............................#
         #............................#
         #............................#
         ############....##########...#
         ############....##########...#
         ############....##########...#
         ############....##########...#
         ############....##########...#
         ############....##########...#
         ##############################",
        N_CELLS,
    );
    let found = segmentation(&space, &TopologyParams::INDOOR);
    let points = meet_points(&found.voronoi, &found.clearance, &MeetPointParams::INDOOR);
    let drawn_back: Vec<String> = points
        .iter()
        .map(|point| {
            let (x_m, y_m) = (point.position.x, point.position.y);
            format!("{:?} {x_m:.1} {y_m:.1} {:.2}", point.kind, point.clearance_m)
        })
        .collect();
    let expected = expect![[r#"
        Junction 4.2 2.5 0.75
        Corner 8.1 2.7 0.65
        DeadEnd 8.2 0.7 0.45
        DeadEnd 4.2 0.9 0.60
        DeadEnd 0.9 2.7 0.60"#]];
    expected.assert_eq(&drawn_back.join("\n"));
}

#[test]
fn nothing_free_is_nothing_found() {
    let found = segmentation(&drawn("###\n###", 1), &TopologyParams::INDOOR);
    assert_eq!(found.partition.n_regions(), 0, "no region");
    assert_eq!((found.points.len(), found.lines.len()), (0, 0), "no points, no lines");
}
