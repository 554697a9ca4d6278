//! What makes a place distinctive, and what is to be maximised near it (KB 1988, section 2.2).

use std::f64::consts::FRAC_PI_2;

use super::ring::Ring;
use super::surroundings::{Scale, Surroundings, surroundings};

/// The measures of the paper, where a robot stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distinctiveness {
    /// Extent of the differences of distances to near objects: the largest less the smallest, in
    /// metres; 0 with fewer than two.
    pub distance_difference_m: f64,
    /// How little the ring differs from itself turned by half: 1 is the same, 0 as unlike as can be.
    pub symmetry_about_center: f64,
    /// The same, mirrored at the best of all lines through the robot.
    pub symmetry_about_line: f64,
    /// Largest change of a reading since one small step ago, as a share of the smaller of both.
    pub discontinuity: f64,
    /// Directions in which one can go.
    pub n_open_directions: usize,
    /// How many more there are than one small step ago.
    pub n_open_directions_gained: isize,
    /// Distance from left to right across the heading, in metres: a place on a path where this
    /// is least or largest is distinctive along that path.
    pub lateral_m: f64,
}

/// What is to be maximised near a robot: the decision of the rules ("is proper to maximise").
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Goal {
    /// Nothing: a robot passes here.
    Passage,
    /// Equal distances to all near objects; the paper's `DP-symm-equal`.
    EqualDistances,
    /// Two near objects beside open space, both at the distance at which walls are walked along:
    /// where one of them begins or ends.
    WallDistances,
    /// Something is there, to be seen from nearer.
    ComeCloser,
}

/// The measures at `now`, one small step after `before`. Both rings look the same way.
pub fn distinctiveness(
    before: &Ring,
    now: &Ring,
    heading_rad: f64,
    scale: &Scale,
) -> Distinctiveness {
    let around = surroundings(now, scale);
    let n_open_directions = around.directions.len();
    let n_before = surroundings(before, scale).directions.len();
    let distances = around.objects.iter().map(|object| object.distance_m);
    let (least_m, most_m) =
        distances.fold((f64::INFINITY, 0.0_f64), |(least, most), at| (least.min(at), most.max(at)));
    let pairs = before.ranges_m().iter().zip(now.ranges_m());
    let change = |(&a, &b): (&f64, &f64)| (a - b).abs() / a.min(b).max(1e-6);
    let n = now.n();
    Distinctiveness {
        distance_difference_m: (most_m - least_m).max(0.0),
        symmetry_about_center: likeness(now, |index| index + n / 2),
        symmetry_about_line: (0..n)
            .map(|line| likeness(now, |index| line + n - index))
            .fold(0.0, f64::max),
        discontinuity: pairs.map(change).fold(0.0, f64::max),
        n_open_directions,
        n_open_directions_gained: n_open_directions.cast_signed() - n_before.cast_signed(),
        lateral_m: now.wall_m(heading_rad + FRAC_PI_2) + now.wall_m(heading_rad - FRAC_PI_2),
    }
}

/// The rules: what to maximise here. The first is the paper's `DP-R10`, its far-away objects being those
/// that are not near at all.
pub fn goal(around: &Surroundings) -> Goal {
    let n_objects = around.objects.len();
    match around.open_space_rad {
        _ if around.is_passage() => Goal::Passage,
        None if 3 <= n_objects => Goal::EqualDistances,
        Some(_) if 2 <= n_objects => Goal::WallDistances,
        _ => Goal::ComeCloser,
    }
}

/// 1 less the mean difference of readings from those that `image` takes them to, as a share of both.
fn likeness(ring: &Ring, image: impl Fn(usize) -> usize) -> f64 {
    let range_m = |index: usize| ring.ranges_m()[index % ring.n()];
    let unlike = |index: usize| {
        let (a, b) = (range_m(index), range_m(image(index)));
        (a - b).abs() / (a + b).max(1e-6)
    };
    1.0 - (0..ring.n()).map(unlike).sum::<f64>() / ring.n() as f64
}
