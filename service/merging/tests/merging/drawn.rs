//! Worlds as drawings, and what a robot's map of them looks like.

use meetpoint_geometry::{Cell, GridFrame, GridInfo, Point2, Pose};
use meetpoint_occupancy::{Grid, Raster};

/// Edge of a character, in metres.
pub(crate) const CHARACTER_M: f64 = 0.5;

/// A drawing: `#` is wall, `.` is free, everything else is never seen.
pub(crate) struct World {
    /// The lowest first.
    rows: Vec<Vec<u8>>,
}

impl World {
    pub(crate) fn new(drawing: &str) -> Self {
        let rows = drawing.lines().map(str::trim).filter(|row| !row.is_empty());
        let mut rows: Vec<Vec<u8>> = rows.map(|row| row.as_bytes().to_vec()).collect();
        rows.reverse();
        Self { rows }
    }

    /// Width and height, in metres.
    fn size_m(&self) -> (f64, f64) {
        let width = self.rows.iter().map(Vec::len).max().unwrap_or(0);
        (width as f64 * CHARACTER_M, self.rows.len() as f64 * CHARACTER_M)
    }

    fn symbol(&self, point: Point2<f64>) -> u8 {
        if point.x < 0.0 || point.y < 0.0 {
            return b' ';
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "not negative")]
        let (x, y) = ((point.x / CHARACTER_M) as usize, (point.y / CHARACTER_M) as usize);
        self.rows.get(y).and_then(|row| row.get(x)).copied().unwrap_or(b' ')
    }

    /// Log-odds at a point: of walls only a skin of `skin_m` that faces free space is seen.
    fn log_odds(&self, point: Point2<f64>, skin_m: f64) -> f32 {
        match self.symbol(point) {
            b'.' => -3.0,
            b'#' => {
                let sides = [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)];
                let near =
                    sides.map(|(x, y)| Point2::new(point.x + x * skin_m, point.y + y * skin_m));
                if near.iter().any(|&near| self.symbol(near) == b'.') { 3.0 } else { f32::NAN }
            }
            _ => f32::NAN,
        }
    }

    /// The map of a robot that has seen what lies between two x, in its own frame.
    pub(crate) fn grid(
        &self,
        resolution_m: f64,
        map_from_world: Pose,
        seen_x_m: std::ops::Range<f64>,
    ) -> Grid {
        let (width_m, height_m) = self.size_m();
        let corners = [(0.0, 0.0), (width_m, 0.0), (0.0, height_m), (width_m, height_m)]
            .map(|(x, y)| map_from_world * Point2::new(x, y));
        let least =
            |of: fn(&Point2<f64>) -> f64| corners.iter().map(of).fold(f64::INFINITY, f64::min);
        let most =
            |of: fn(&Point2<f64>) -> f64| corners.iter().map(of).fold(f64::NEG_INFINITY, f64::max);
        let frame = GridFrame::new(resolution_m).expect("a length");
        let first = frame.cell_at(Point2::new(least(|at| at.x), least(|at| at.y)));
        let last = frame.cell_at(Point2::new(most(|at| at.x), most(|at| at.y)));
        let (width, height) = (last.x.abs_diff(first.x) + 1, last.y.abs_diff(first.y) + 1);
        let info = GridInfo { frame, first, width, height };
        let world_from_map = map_from_world.inverse();
        let cells = (first.y..=last.y).flat_map(|y| (first.x..=last.x).map(move |x| Cell { x, y }));
        let log_odds = cells.map(|cell| {
            let point = world_from_map * frame.center_of(cell);
            if seen_x_m.contains(&point.x) {
                self.log_odds(point, 1.1 * resolution_m.max(0.1))
            } else {
                f32::NAN
            }
        });
        Grid::from_raster(&Raster { info, log_odds: log_odds.collect() })
    }
}

/// Offices and a hall, no two alike: 30 m by 15 m.
pub(crate) const FLOOR: &str = "
    ############################################################
    #.........#......#..............#.......##..........#......#
    #.........#......#..............#.......##..........#......#
    #..##.....#......#....###.......#..#....##....#.....#......#
    #..##.....#..#...#....###.......#..#................#.##...#
    #.........#......#..............#.......##..........#.##...#
    #.........#......#..............#.......##..........#......#
    ####..#######..####..########..#####..########..######..####
    #..........................................................#
    #..........................................................#
    #...........................##.............................#
    #..........................................................#
    ######..#######..#####..####..############..####..##########
    #.............#.....#........#...........#......#..........#
    #.............#.....#........#...........#......#..........#
    #....#........#.....##.......#....##.....#......#...###....#
    #....#........#.....##.......#....##.....#..##..#...###....#
    #.............#.....#........#...........#..##..#..........#
    #.............#.....#........#...........#......#..........#
    ############################################################";

/// The same room four times.
pub(crate) const ROOMS_ALIKE: &str = "
    #####################################################
    #............#............#............#............#
    #............#............#............#............#
    #..##........#..##........#..##........#..##........#
    #..##........#..##........#..##........#..##........#
    #............#............#............#............#
    #........##..#........##..#........##..#........##..#
    #............#............#............#............#
    #####################################################";

/// One of these rooms.
pub(crate) const ROOM: &str = "
    ##############
    #............#
    #............#
    #..##........#
    #..##........#
    #............#
    #........##..#
    #............#
    ##############";
