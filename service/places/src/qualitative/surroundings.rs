//! Near objects and open directions, read from a ring.
//!
//! A reading above `open_m` is open. Runs of open readings are ways to go: one of up to `wide_rad` is
//! the mouth of a corridor, with one direction along its middle; a wider one, where most readings are
//! far, is open space, into which nothing leads, but along each of the two objects beside it (KB 1988,
//! section 2.3). One that is wide and not far is a junction, to be seen from nearer. Runs of
//! closed readings are near objects: one, or several walls by the angle that they take, as a wall
//! never takes up more than some 140 degrees.

use std::f64::consts::{FRAC_PI_2, PI};

use meetpoint_geometry::{angle_between, wrap_angle};

use super::ring::Ring;
use crate::star::ControlLaw;

/// Lengths by which surroundings are read: how large corridors are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// Readings above this are open, in metres.
    pub open_m: f64,
    /// At this distance an object is walked along, in metres.
    pub wall_m: f64,
    /// Farther readings count as this far, in metres.
    pub range_max_m: f64,
    /// Open runs above this angle may be open space.
    pub wide_rad: f64,
    /// They are, where most of their readings are above this, in metres.
    pub far_m: f64,
}

impl Scale {
    /// Corridors of 2 m; sonars that hear 6 m.
    pub const CORRIDORS_OF_2_M: Self = Self::of_corridors(2.0, 6.0);

    /// Corridors of that width. From their middle a sonar 45 degrees aslant reads 0.71 of it, one 22.5
    /// degrees aslant 1.31; walked along at 0.65, a wall reads 0.92 at 45 degrees.
    pub const fn of_corridors(width_m: f64, range_max_m: f64) -> Self {
        Self {
            open_m: 1.05 * width_m,
            wall_m: 0.65 * width_m,
            range_max_m,
            wide_rad: 2.2,
            far_m: 1.6 * width_m,
        }
    }
}

/// A direction in which a robot can travel away.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OpenDirection {
    /// Where to, in the frame of headings.
    pub heading_rad: f64,
    /// By which law one travels there.
    pub control_law: ControlLaw,
}

/// A wall or a corner nearby.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NearObject {
    /// Where it is nearest, in the frame of headings.
    pub heading_rad: f64,
    /// How far it is there, in metres.
    pub distance_m: f64,
}

/// What stands around, and where one can go.
#[derive(Clone, Debug, PartialEq)]
pub struct Surroundings {
    /// Clockwise.
    pub directions: Vec<OpenDirection>,
    /// Counter-clockwise.
    pub objects: Vec<NearObject>,
    /// Middle of the widest open space, if there is one.
    pub open_space_rad: Option<f64>,
}

/// Neighbouring readings that are all open, or all closed.
#[derive(Clone, Copy, Debug)]
struct Run {
    is_open: bool,
    /// Index of its first reading; the others follow counter-clockwise.
    first: usize,
    n: usize,
}

/// Reads a ring.
pub fn surroundings(ring: &Ring, scale: &Scale) -> Surroundings {
    let runs = runs(ring, scale.open_m);
    let angle_rad = |run: &Run| ring.step_rad() * run.n as f64;
    let middle_rad = |run: &Run| {
        wrap_angle(ring.heading_rad(run.first) + (angle_rad(run) - ring.step_rad()) / 2.0)
    };
    let mut found =
        Surroundings { directions: Vec::new(), objects: Vec::new(), open_space_rad: None };
    let objects: Vec<Vec<NearObject>> = runs
        .iter()
        .map(|run| if run.is_open { Vec::new() } else { near_objects(ring, run) })
        .collect();
    let mut widest_rad = 0.0;
    for (index, run) in runs.iter().enumerate().filter(|(_, run)| run.is_open) {
        let direction = |heading_rad, control_law| OpenDirection {
            heading_rad: wrap_angle(heading_rad),
            control_law,
        };
        if angle_rad(run) <= scale.wide_rad || !is_far(ring, run, scale.far_m) {
            found.directions.push(direction(middle_rad(run), ControlLaw::Midline));
            continue;
        }
        if widest_rad < angle_rad(run) {
            widest_rad = angle_rad(run);
            found.open_space_rad = Some(middle_rad(run));
        }
        // Runs alternate, so those beside an open one are closed, if there are any.
        let n_runs = runs.len();
        if let Some(right) = objects[(index + n_runs - 1) % n_runs].last() {
            found.directions.push(direction(right.heading_rad + FRAC_PI_2, ControlLaw::RightWall));
        }
        if let Some(left) = objects[(index + 1) % n_runs].first() {
            found.directions.push(direction(left.heading_rad - FRAC_PI_2, ControlLaw::LeftWall));
        }
    }
    found.objects = objects.concat();
    // Clockwise, from just beyond backwards.
    found.directions.sort_by(|a, b| b.heading_rad.total_cmp(&a.heading_rad));
    found
}

impl Surroundings {
    /// Whether a robot is on its way here and nothing else: between two walls that lead on, or
    /// along one object beside open space.
    pub fn is_passage(&self) -> bool {
        const OPPOSITE_RAD: f64 = 0.8 * PI;
        match (self.open_space_rad, &self.directions[..]) {
            (Some(_), _) => self.objects.len() == 1,
            (None, [a, b]) => {
                self.objects.len() == 2
                    && OPPOSITE_RAD < angle_between(a.heading_rad, b.heading_rad).abs()
            }
            (None, _) => false,
        }
    }

    /// Index and direction nearest to a heading, and the angle to it; `None` if nothing is open.
    pub fn direction_towards(&self, heading_rad: f64) -> Option<(usize, f64)> {
        let off_rad =
            |direction: &OpenDirection| angle_between(heading_rad, direction.heading_rad).abs();
        let off = self.directions.iter().map(off_rad).enumerate();
        off.min_by(|a, b| a.1.total_cmp(&b.1))
    }
}

/// Runs around the ring, counter-clockwise; open and closed ones alternate, unless all is one.
fn runs(ring: &Ring, open_m: f64) -> Vec<Run> {
    let n = ring.n();
    let is_open: Vec<bool> = ring.ranges_m().iter().map(|&range_m| open_m < range_m).collect();
    let begins: Vec<usize> =
        (0..n).filter(|&index| is_open[index] != is_open[(index + n - 1) % n]).collect();
    let Some(&first) = begins.first() else {
        return vec![Run { is_open: is_open[0], first: 0, n }];
    };
    let ends = begins[1..].iter().copied().chain([first + n]);
    let run =
        |(&first, end): (&usize, usize)| Run { is_open: is_open[first], first, n: end - first };
    begins.iter().zip(ends).map(run).collect()
}

/// Whether most readings of a run are far.
fn is_far(ring: &Ring, run: &Run, far_m: f64) -> bool {
    let is_far = |&index: &usize| far_m < ring.ranges_m()[index % ring.n()];
    let n_far = (run.first..run.first + run.n).filter(is_far).count();
    0.75 * run.n as f64 <= n_far as f64
}

/// The walls of a closed run: it is cut into as many equal parts as walls are needed to fill it.
fn near_objects(ring: &Ring, run: &Run) -> Vec<NearObject> {
    let angle_rad = ring.step_rad() * run.n as f64;
    let n_objects = match angle_rad {
        angle_rad if angle_rad <= 140_f64.to_radians() => 1,
        angle_rad if angle_rad <= 250_f64.to_radians() => 2,
        angle_rad if angle_rad <= 345_f64.to_radians() => 3,
        _ => 4,
    };
    let n_objects = n_objects.min(run.n);
    let part = |index: usize| {
        let from = run.first + run.n * index / n_objects;
        let to = run.first + run.n * (index + 1) / n_objects;
        nearest(ring, from, to)
    };
    (0..n_objects).map(part).collect()
}

/// Where the readings of these indices are shortest. Readings count the more the nearer they are to
/// the shortest, so that an error of one of them moves the result little.
fn nearest(ring: &Ring, from: usize, to: usize) -> NearObject {
    let range_m = |index: usize| ring.ranges_m()[index % ring.n()];
    let least_m = (from..to).map(range_m).fold(f64::INFINITY, f64::min).max(1e-6);
    let weight = |index: usize| (-8.0 * (range_m(index) / least_m - 1.0)).exp();
    let sum: f64 = (from..to).map(weight).sum();
    let mean = |of: &dyn Fn(usize) -> f64| {
        (from..to).map(|index| weight(index) * of(index)).sum::<f64>() / sum
    };
    let steps = mean(&|index| (index - from) as f64);
    let heading_rad = wrap_angle(ring.heading_rad(from) + steps * ring.step_rad());
    let off_rad = |index| angle_between(heading_rad, ring.heading_rad(index));
    let distance_m = mean(&|index| range_m(index) * off_rad(index).cos());
    NearObject { heading_rad, distance_m }
}
