//! Shapes that people draw on a map, as cells.
//!
//! An obstacle takes all cells that it touches, so that nothing slips through it between two
//! centres; a zone those whose centres it holds. A polygon's inside is that of the even-odd rule,
//! found row by row between crossings (J. Foley, A. van Dam, S. Feiner and J. Hughes, "Computer
//! graphics: principles and practice", section 3.6); an edge is followed row by row. Time O(rows ·
//! edges + cells touched): what lies outside of the rectangle costs nothing.

use meetpoint_geometry::{GridInfo, Point2, Vector2};

/// Something drawn, in metres in the map's frame. Coordinates must be finite.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// A closed line and all inside.
    Polygon(Vec<Point2<f64>>),
    /// An open line and all that is nearer than half its width.
    Polyline {
        /// From one end to the other.
        points: Vec<Point2<f64>>,
        /// In metres, at least 0.
        width_m: f64,
    },
}

impl Shape {
    /// The cells of `info` that the shape touches, by index, some more than once.
    pub fn touched(&self, info: GridInfo) -> Vec<usize> {
        let lattice = Lattice::new(info);
        let mut cells = vec![];
        match self {
            Self::Polygon(points) => {
                lattice.inside(points, &mut cells);
                for edge in edges(points) {
                    lattice.along(edge, 0.0, &mut cells);
                }
            }
            Self::Polyline { points, width_m } => {
                let alone = (points.len() == 1).then(|| [points[0]; 2]);
                let edges = points.windows(2).map(|ends| [ends[0], ends[1]]).chain(alone);
                for edge in edges {
                    lattice.along(edge, width_m / 2.0, &mut cells);
                }
            }
        }
        cells
    }
}

/// The cells of `info` whose centres lie inside of a polygon, by index.
pub fn cells_inside(polygon: &[Point2<f64>], info: GridInfo) -> Vec<usize> {
    let mut cells = vec![];
    Lattice::new(info).inside(polygon, &mut cells);
    cells
}

/// The edges of a polygon, the closing one included.
fn edges(points: &[Point2<f64>]) -> impl Iterator<Item = [Point2<f64>; 2]> + '_ {
    points.iter().zip(points.iter().cycle().skip(1)).map(|(&a, &b)| [a, b])
}

/// Cells as unit squares: the one in column x and row y covers x..x+1 and y..y+1.
struct Lattice {
    origin: Point2<f64>,
    side_m: f64,
    width: usize,
    height: usize,
}

impl Lattice {
    fn new(info: GridInfo) -> Self {
        Self {
            origin: info.origin(),
            side_m: info.frame.resolution_m(),
            width: info.width as usize,
            height: info.height as usize,
        }
    }

    fn place(&self, point: Point2<f64>) -> Point2<f64> {
        ((point - self.origin) / self.side_m).into()
    }

    /// Cells whose centres lie inside, by the even-odd rule, appended.
    fn inside(&self, points: &[Point2<f64>], cells: &mut Vec<usize>) {
        let places: Vec<Point2<f64>> = points.iter().map(|&point| self.place(point)).collect();
        let heights = places.iter().map(|place| place.y);
        let [low, high] = extent(heights);
        for row in clipped(low - 1.0, high, self.height) {
            let y = row as f64 + 0.5;
            let mut crossings: Vec<f64> = edges(&places)
                .filter(|[a, b]| (a.y <= y) != (b.y <= y))
                .map(|[a, b]| a.x + (y - a.y) / (b.y - a.y) * (b.x - a.x))
                .collect();
            crossings.sort_unstable_by(f64::total_cmp);
            for pair in crossings.chunks_exact(2) {
                // Centres at x + 1/2, from the first crossing to before the second.
                let columns = clipped(pair[0] - 0.5, pair[1] - 0.5, self.width);
                let within = columns.filter(|&x| (pair[0]..pair[1]).contains(&(x as f64 + 0.5)));
                cells.extend(within.map(|x| row * self.width + x));
            }
        }
    }

    /// Cells no farther than `reach_m` from a segment, appended.
    fn along(&self, [a, b]: [Point2<f64>; 2], reach_m: f64, cells: &mut Vec<usize>) {
        let (a, b, reach) = (self.place(a), self.place(b), reach_m / self.side_m);
        let [low, high] = extent([a.y, b.y].into_iter());
        for row in clipped(low - reach - 1.0, high + reach, self.height) {
            let y = row as f64;
            let [left, right] = between([a, b], y - reach, y + 1.0 + reach);
            for x in clipped(left - reach - 1.0, right + reach, self.width) {
                if distance([a, b], Point2::new(x as f64 + 0.5, y + 0.5)) <= reach {
                    cells.push(row * self.width + x);
                }
            }
        }
    }
}

fn extent(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
        [low.min(value), high.max(value)]
    })
}

/// Whole numbers from `low` to `high`, a little more at either end, within 0..n.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to 0..=n")]
fn clipped(low: f64, high: f64, n: usize) -> std::ops::Range<usize> {
    let at = |value: f64| value.clamp(0.0, n as f64) as usize;
    at(low.floor())..at(high.floor() + 1.0)
}

/// The columns of the part of a segment that lies between two heights.
fn between([a, b]: [Point2<f64>; 2], low: f64, high: f64) -> [f64; 2] {
    let rise = b.y - a.y;
    let at = |y: f64| {
        let share = if rise == 0.0 { 0.0 } else { ((y - a.y) / rise).clamp(0.0, 1.0) };
        a.x + share * (b.x - a.x)
    };
    if rise == 0.0 {
        extent([a.x, b.x].into_iter())
    } else {
        extent([at(low), at(high)].into_iter())
    }
}

/// From a segment to the unit square around `center`.
fn distance([a, b]: [Point2<f64>; 2], center: Point2<f64>) -> f64 {
    let [a, b] = [a - center, b - center];
    let outside = |x: f64| (x.abs() - 0.5).max(0.0);
    let of_end = |p: Vector2<f64>| outside(p.x).hypot(outside(p.y));
    let along = b - a;
    let of_corner = |x: f64, y: f64| {
        let from_a = Vector2::new(x, y) - a;
        let share = from_a.dot(&along) / along.norm_squared();
        let share = if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) };
        (from_a - along * share).norm()
    };
    if crosses(a, b) {
        return 0.0;
    }
    let corners = [(-0.5, -0.5), (-0.5, 0.5), (0.5, -0.5), (0.5, 0.5)];
    let nearest = corners.into_iter().map(|(x, y)| of_corner(x, y));
    nearest.fold(of_end(a).min(of_end(b)), f64::min)
}

/// Whether a segment has a point in the unit square around the origin (Liang and Barsky).
fn crosses(a: Vector2<f64>, b: Vector2<f64>) -> bool {
    let mut share = [0.0_f64, 1.0_f64];
    for (from, to) in [(a.x, b.x), (a.y, b.y)] {
        let along = to - from;
        if along == 0.0 {
            if 0.5 < from.abs() {
                return false;
            }
            continue;
        }
        let [enter, leave] = extent([(-0.5 - from) / along, (0.5 - from) / along].into_iter());
        share = [share[0].max(enter), share[1].min(leave)];
    }
    share[0] <= share[1]
}
