//! Euclidean shortest paths of a disc among squares: the truth that smooth paths are measured by.
//!
//! The centre of a disc of radius r moves outside of all obstacle squares grown by r. We grow them
//! by the polygon *inscribed* in the disc instead, with n chords a quarter turn: a smaller
//! obstacle, so that the length found is never more than the truth, and less by at most the share
//! 1 - cos(pi / (4 n)) of what goes around corners, 0.5 % of it at n = 8.
//!
//! A shortest path among polygons is straight between their vertices and turns around each
//! (T. Lozano-Pérez and M. Wesley, "An algorithm for planning collision-free paths among polyhedral
//! obstacles", Communications of the ACM 22 (1979)): A* over the vertices, where only lines are
//! followed that are tangent at both ends. Whether a line is clear is asked when it is the next
//! best. All lengths in cells.

use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

use meetpoint_geometry::{Point2, Vector2};
use meetpoint_planning::Obstacles;
use meetpoint_topology::FreeSpace;

/// Radius of a point robot: it passes between no squares that touch.
const POINT_RADIUS: f64 = 5e-4;

/// Lengths differ by so much through rounding.
const ROUNDING: f64 = 1e-9;

/// Vertices of the grown obstacles.
pub(crate) struct Visibility {
    obstacles: Obstacles,
    /// Of the disc inscribed in the polygon.
    radius: f64,
    vertices: Vec<Vertex>,
}

struct Vertex {
    point: Point2<f64>,
    /// To the vertices before and after it on its polygon.
    beside: [Vector2<f64>; 2],
}

/// A line to be followed: bound of the whole path, length up to its end, its start and its end with
/// the side on which the end's polygon lies.
#[derive(PartialEq)]
struct Line {
    bound: f64,
    length: f64,
    from: usize,
    to: usize,
    side: usize,
}

impl Eq for Line {}

impl PartialOrd for Line {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Line {
    fn cmp(&self, other: &Self) -> Ordering {
        self.bound.total_cmp(&other.bound)
    }
}

impl Visibility {
    /// Obstacles of `space` grown by `radius` cells, with `n_chords` a quarter turn.
    pub(crate) fn new(space: &FreeSpace, radius: f64, n_chords: usize) -> Self {
        let obstacles = Obstacles::new(space);
        let outer = radius.max(POINT_RADIUS);
        let inner = outer * (std::f64::consts::FRAC_PI_4 / n_chords as f64).cos() - ROUNDING;
        let mut vertices = vec![];
        for (corner, outward) in convex_corners(space) {
            grow(corner, outward, outer, n_chords, &mut vertices);
        }
        vertices.retain(|vertex| obstacles.is_clear(vertex.point, vertex.point, inner));
        Self { obstacles, radius: inner, vertices }
    }

    /// Length of the shortest path between two points, in cells; `None` if it is longer than
    /// `length_max`.
    pub(crate) fn length(&self, a: Point2<f64>, b: Point2<f64>, length_max: f64) -> Option<f64> {
        let n = self.vertices.len();
        let (start, goal) = (n, n + 1);
        let point = |at: usize| match at {
            at if at == start => a,
            at if at == goal => b,
            at => self.vertices[at].point,
        };
        let mut is_settled = vec![[false; 2]; n + 2];
        let mut lines = BinaryHeap::new();
        let bound = (b - a).norm();
        lines.push(Reverse(Line { bound, length: 0.0, from: start, to: start, side: 0 }));
        while let Some(Reverse(line)) = lines.pop() {
            let Line { length, from, to, side, .. } = line;
            if is_settled[to][side] || !self.obstacles.is_clear(point(from), point(to), self.radius)
            {
                continue;
            }
            if to == goal {
                return Some(length);
            }
            is_settled[to][side] = true;
            let here = point(to);
            for next in (0..n).chain([goal]) {
                let there = point(next);
                let length = length + (there - here).norm();
                let bound = length + (b - there).norm();
                if length_max < bound || next == to || to != start && !self.leaves(to, there, side)
                {
                    continue;
                }
                let sides = if next == goal { [true, false] } else { self.sides(next, here) };
                for side in (0..2).filter(|&side| sides[side] && !is_settled[next][side]) {
                    lines.push(Reverse(Line { bound, length, from: to, to: next, side }));
                }
            }
        }
        None
    }

    /// Whether a line from `vertex` on leaves its polygon on that side.
    fn leaves(&self, vertex: usize, to: Point2<f64>, side: usize) -> bool {
        let Vertex { point, beside } = &self.vertices[vertex];
        is_tangent(beside, to - point, side)
    }

    /// On which sides, left and right, of a line to `vertex` its polygon may lie.
    fn sides(&self, vertex: usize, from: Point2<f64>) -> [bool; 2] {
        let Vertex { point, beside } = &self.vertices[vertex];
        [0, 1].map(|side| is_tangent(beside, point - from, side))
    }
}

/// Whether a polygon lies on that side of a line through its vertex.
fn is_tangent(beside: &[Vector2<f64>; 2], along: Vector2<f64>, side: usize) -> bool {
    let sign = if side == 0 { 1.0 } else { -1.0 };
    let tolerance = ROUNDING * along.norm();
    beside.iter().all(|beside| -tolerance <= sign * along.perp(beside))
}

/// Corners of obstacle cells around which something can go, with the quadrant that they point to.
fn convex_corners(space: &FreeSpace) -> Vec<(Point2<f64>, Vector2<f64>)> {
    let (width, height) = (space.info().width as usize, space.info().height as usize);
    let is_free = |x: usize, y: usize| space.is_free()[y * width + x];
    let mut corners = vec![];
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        if is_free(x, y) {
            continue;
        }
        for (right, up) in [(false, false), (false, true), (true, false), (true, true)] {
            let beside = if right { x + 1 } else { x.wrapping_sub(1) };
            let above = if up { y + 1 } else { y.wrapping_sub(1) };
            if beside < width && above < height && is_free(beside, y) && is_free(x, above) {
                let corner =
                    Point2::new((x + usize::from(right)) as f64, (y + usize::from(up)) as f64);
                let sign = |is: bool| if is { 1.0 } else { -1.0 };
                corners.push((corner, Vector2::new(sign(right), sign(up))));
            }
        }
    }
    corners
}

/// The vertices around a grown corner.
fn grow(
    corner: Point2<f64>,
    outward: Vector2<f64>,
    radius: f64,
    n_chords: usize,
    vertices: &mut Vec<Vertex>,
) {
    let at = |j: usize| {
        let turn = j as f64 / n_chords as f64 * std::f64::consts::FRAC_PI_2;
        outward.component_mul(&Vector2::new(turn.cos(), turn.sin())) * radius
    };
    for j in 0..=n_chords {
        let here = at(j);
        // The straight edges that the arc goes over into.
        let before = if j == 0 { Vector2::new(0.0, -outward.y) * radius } else { at(j - 1) - here };
        let after =
            if j == n_chords { Vector2::new(-outward.x, 0.0) * radius } else { at(j + 1) - here };
        vertices.push(Vertex { point: corner + here, beside: [before, after] });
    }
}
