//! Exploration in drawings of rooms.

use expect_test::{Expect, expect};
use meetpoint_geometry::{Cell, GridFrame, GridInfo, Point2};
use meetpoint_planning::{
    Errand, Exploration, ExplorationParams, Explored, Known, Way, exploration_rectangle,
};

/// Edge of a cell, in metres: a power of two, so that nothing is rounded.
const SIDE_M: f64 = 0.25;
/// A robot that is a point, and every cell counts.
const POINT: ExplorationParams =
    ExplorationParams { radius_m: 0.0, unexplored_min_m: 0.0, ..ExplorationParams::INDOOR };

fn info(width: u32, height: u32) -> GridInfo {
    let frame = GridFrame::new(SIDE_M).expect("a length");
    GridInfo { frame, first: Cell { x: -3, y: 5 }, width, height }
}

/// A drawn map: `#` occupied, blank never observed, anything else free; letters are robots.
struct Drawing {
    info: GridInfo,
    log_odds: Vec<f32>,
    robots: Vec<Point2<f64>>,
    symbols: Vec<Vec<char>>,
}

impl Drawing {
    fn new(text: &str) -> Self {
        let lines = text.lines().map(|line| line.trim().trim_matches('|').chars().collect());
        let symbols: Vec<Vec<char>> = lines.rev().collect();
        let side = |n: usize| u32::try_from(n).expect("a small drawing");
        let info = info(side(symbols[0].len()), side(symbols.len()));
        let log_odds = symbols.iter().flatten().map(|symbol| match symbol {
            '#' => 3.0,
            ' ' => f32::NAN,
            _ => -3.0,
        });
        let log_odds = log_odds.collect();
        let mut robots: Vec<(char, Point2<f64>)> = vec![];
        for (y, line) in (0..).zip(&symbols) {
            for (x, &symbol) in (0..).zip(line).filter(|(_, symbol)| symbol.is_ascii_uppercase()) {
                let cell = Cell { x: info.first.x + x, y: info.first.y + y };
                robots.push((symbol, info.frame.center_of(cell)));
            }
        }
        robots.sort_by_key(|&(name, _)| name);
        let robots = robots.into_iter().map(|(_, point)| point).collect();
        Self { info, log_odds, robots, symbols }
    }

    fn explored(&self, params: ExplorationParams) -> Explored {
        let known = Known { info: self.info, log_odds: &self.log_odds, closed: &[] };
        Exploration::new(params).explore(&known, &self.robots).expect("fits")
    }

    /// The drawing with the goal of each robot in its small letter, and what is left below.
    fn check(&self, params: ExplorationParams, expected: &Expect) {
        let explored = self.explored(params);
        let mut symbols = self.symbols.clone();
        let mut told = vec![];
        for (name, errand) in ('a'..).zip(&explored.errands) {
            if let Errand::Go(Way { goal, .. }) = errand {
                let at = self.info.index_of(self.info.frame.cell_at(*goal)).expect("inside");
                let width = self.info.width as usize;
                symbols[at / width][at % width] = name;
            } else {
                told.push(format!("{name}: {errand:?}"));
            }
        }
        let rows = symbols.iter().rev().map(|line| format!("|{}|", String::from_iter(line)));
        let frontiers =
            format!("{} frontiers, {} m", explored.frontiers.len(), explored.frontier_m());
        let lines: Vec<_> = rows.chain(told).chain([frontiers]).collect();
        expected.assert_eq(&lines.join("\n"));
    }
}

#[test]
fn the_nearest_first_and_no_two_into_the_same_room() {
    let rooms = Drawing::new(
        "|###############|
         |#    #   #    #|
         |#    #   #    #|
         |#    #   #    #|
         |##.#########.##|
         |#....A...B....#|
         |#.............#|
         |###############|",
    );
    rooms.check(
        POINT,
        &expect![[r"
            |###############|
            |#    #   #    #|
            |#    #   #    #|
            |# a  #   #  b #|
            |##.#########.##|
            |#....A...B....#|
            |#.............#|
            |###############|
            2 frontiers, 0.5 m"]],
    );
}

#[test]
fn what_is_in_doubt_is_dear_and_closes_nothing_that_is_heard() {
    // A door with a wrong patch in it: likelier occupied than not, and not decided.
    let mut rooms = Drawing::new(
        "|#######|
         |#  #  #|
         |#??#  #|
         |#..#..#|
         |#.A...#|
         |#.....#|
         |#######|",
    );
    for (log_odds, symbol) in rooms.log_odds.iter_mut().zip(rooms.symbols.iter().flatten()) {
        if *symbol == '?' {
            *log_odds = 0.4;
        }
    }
    let nearest = |params| match &rooms.explored(params).errands[0] {
        Errand::Go(way) => way.cost,
        errand => panic!("{errand:?}"),
    };
    let heard =
        ExplorationParams { radius_m: 0.0, unexplored_min_m: 0.0, ..ExplorationParams::HEARD };
    let closed = rooms.explored(POINT);
    assert_eq!(closed.frontiers.len(), 1, "one patch closes a room");
    assert_eq!(rooms.explored(heard).frontiers.len(), 2, "the patch is a way, too");
    assert!((nearest(heard) - nearest(POINT)).abs() < 1e-6, "a dear one: the other comes first");
    let cheap = ExplorationParams { doubt_cost: 0.0, ..heard };
    assert!(nearest(cheap) < nearest(heard), "were it not dear, it would be the nearest");
}

#[test]
fn what_another_robot_will_see_is_left_to_it() {
    let room = Drawing::new(
        "|###########|
         |#         #|
         |#         #|
         |#....A....#|
         |#..B......#|
         |###########|",
    );
    room.check(
        POINT,
        &expect![[r"
            |###########|
            |#         #|
            |#    a    #|
            |#....A....#|
            |#..B......#|
            |###########|
            b: LeftToOthers
            1 frontiers, 2.25 m"]],
    );
}

#[test]
fn nothing_behind_walls_and_no_specks() {
    let room = Drawing::new(
        "|              |
         | ########     |
         | #......#     |
         | #.. ...#     |
         | #....A.#     |
         | ########     |
         |              |",
    );
    let specks = ExplorationParams { unexplored_min_m: 0.3, ..POINT };
    room.check(
        specks,
        &expect![[r"
            |              |
            | ########     |
            | #......#     |
            | #.. ...#     |
            | #....A.#     |
            | ########     |
            |              |
            a: Explored
            0 frontiers, 0 m"]],
    );
    room.check(
        POINT,
        &expect![[r"
            |              |
            | ########     |
            | #......#     |
            | #..a...#     |
            | #....A.#     |
            | ########     |
            |              |
            1 frontiers, 0.25 m"]],
    );
}

#[test]
fn no_way_through_chinks_that_are_narrower_than_the_robot() {
    let wall = Drawing::new(
        "|                  |
         |                  |
         |####.#########...#|
         |#................#|
         |#................#|
         |#....A...........#|
         |#................#|
         |#................#|
         |##################|",
    );
    wall.check(
        POINT,
        &expect![[r"
            |                  |
            |    a             |
            |####.#########...#|
            |#................#|
            |#................#|
            |#....A...........#|
            |#................#|
            |#................#|
            |##################|
            2 frontiers, 1 m"]],
    );
    wall.check(
        ExplorationParams { radius_m: 0.3, ..POINT },
        &expect![[r"
            |                  |
            |               a  |
            |####.#########...#|
            |#................#|
            |#................#|
            |#....A...........#|
            |#................#|
            |#................#|
            |##################|
            1 frontiers, 0.25 m"]],
    );
}

#[test]
fn where_a_robot_stands_is_free_and_what_is_behind_it_unexplored() {
    let behind = Drawing::new(
        "|########|
         |   .....|
         |   A....|
         |   .....|
         |########|",
    );
    behind.check(
        POINT,
        &expect![[r"
            |########|
            |   .....|
            |  aA....|
            |   .....|
            |########|
            1 frontiers, 0.75 m"]],
    );
    let mut unseen = Drawing::new(
        "|########|
         |   .....|
         |   .A...|
         |   .....|
         |########|",
    );
    unseen.robots = vec![unseen.robots[0] - along_x(2.0)];
    unseen.check(
        POINT,
        &expect![[r"
            |########|
            |  a.....|
            |   .A...|
            |   .....|
            |########|
            1 frontiers, 1.25 m"]],
    );
}

/// So many cells along x.
fn along_x(n_cells: f64) -> meetpoint_geometry::Vector2<f64> {
    meetpoint_geometry::Vector2::new(n_cells * SIDE_M, 0.0)
}

#[test]
fn robots_that_are_nowhere_do_not_disturb_the_others() {
    let mut room = Drawing::new(
        "|######|
         |#..  #|
         |#A.  #|
         |######|",
    );
    let wall = room.robots[0] - along_x(1.0);
    let far = room.robots[0] + along_x(1e9);
    room.robots.extend([wall, far, Point2::new(f64::NAN, 0.0)]);
    room.check(
        ExplorationParams { tolerance_m: 0.1, ..POINT },
        &expect![[r"
            |######|
            |#..  #|
            |#A.a #|
            |######|
            b: Occupied
            c: Outside
            d: Outside
            1 frontiers, 0.5 m"]],
    );
}

#[test]
fn rectangles_hold_what_is_known_and_seldom_change() {
    let bounds = GridInfo { first: Cell { x: -70, y: 3 }, ..info(100, 10) };
    let rectangle = exploration_rectangle(bounds, 0.2);
    assert_eq!((rectangle.first, rectangle.width), (Cell { x: -128, y: -64 }, 192), "in blocks");
    let grown = GridInfo { width: 110, height: 20, ..bounds };
    assert_eq!(exploration_rectangle(grown, 0.2), rectangle, "the same a little later");
    let edge = GridInfo { first: Cell { x: i32::MIN, y: i32::MAX - 2 }, ..info(u32::MAX, 2) };
    let rectangle = exploration_rectangle(edge, 0.2);
    assert!(u32::MAX / 2 < rectangle.width, "saturates: {}", rectangle.width);
}

#[test]
fn refuses_what_does_not_fit() {
    let known = Known { info: info(2, 2), log_odds: &[0.0; 3], closed: &[] };
    let refused = Exploration::new(POINT).explore(&known, &[]);
    assert_eq!(refused.expect_err("short").to_string(), "3 pieces of ground for 4 cells", "short");
    let nothing = Known { info: info(0, 0), log_odds: &[], closed: &[7] };
    let explored = Exploration::new(POINT).explore(&nothing, &[Point2::origin()]).expect("fits");
    assert_eq!(explored.errands, [Errand::Outside], "a map of nothing");
}
