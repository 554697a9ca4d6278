//! Random pairs of maps: two robots that share a part of a world, two worlds, worlds that repeat
//! themselves.

use std::f64::consts::PI;
use std::time::Instant;

use meetpoint_geometry::{Point2, Pose};
use meetpoint_relaxation::{
    AlignmentParams, Calibration, Constellation, Coverage, Detector, LandmarkAlignments,
    LandmarkKind, Motion, Star, Step, Travel, aligned,
};
use nalgebra::Matrix2;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// What a robot sees of a world: a square of this side, in metres.
const SIDE_M: f64 = 30.0;
/// Landmarks in a square metre.
const DENSITY_PER_M2: f64 = 0.03;
/// Of a landmark in a map, in metres.
const STD_M: f64 = 0.08;
/// Landmarks that a map misses, and others for each true one that are none.
const MISSED_SHARE: f64 = 0.1;
const SPURIOUS_SHARE: f64 = 0.05;
/// Odds from which an alignment would be believed, as a logarithm: a thousand to one.
const LOG_ODDS_SURE: f64 = 6.9;
/// A placement is right within so much, in metres and radians.
const RIGHT_M: f64 = 0.5;
const RIGHT_RAD: f64 = 0.05;
const N_PAIRS: u64 = 100;

/// How a world is made.
#[derive(Clone, Copy)]
enum Kind {
    Strewn,
    Doors,
    BothWings,
    Wings,
    Square,
}

/// Prints a row for each sort of pair.
pub(crate) fn print() {
    println!(
        "| pair of maps | sure and right | sure and wrong | best right, not sure | ms a pair |"
    );
    println!("|---|---|---|---|---|");
    for percent in [100.0, 60.0, 40.0, 30.0, 20.0, 10.0] {
        row(&format!("strewn, {percent} % in common"), Kind::Strewn, Some(percent / 100.0));
    }
    row("two strewn worlds", Kind::Strewn, None);
    for percent in [100.0, 50.0, 20.0] {
        row(&format!("doors along corridors, {percent} %"), Kind::Doors, Some(percent / 100.0));
    }
    row("two buildings with the same doors", Kind::Doors, None);
    row("two identical wings, both in the map", Kind::BothWings, Some(1.0));
    row("the other of two identical wings", Kind::Wings, None);
    row("a square of landmarks", Kind::Square, Some(1.0));
}

fn row(name: &str, kind: Kind, share: Option<f64>) {
    let (mut n_right, mut n_wrong, mut n_unsure) = (0, 0, 0);
    let mut taken_s = 0.0;
    for seed in 0..N_PAIRS {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (site, other, truth) = pair(kind, share, &mut rng);
        let begun = Instant::now();
        let found = aligned(&site, &other, &AlignmentParams::CAMERA);
        taken_s += begun.elapsed().as_secs_f64();
        let is_sure = is_sure(&found);
        let is_right = found.ranked.first().zip(truth).is_some_and(|(best, truth)| {
            // Where the newcomer was, which may be far from where its frame begins.
            let middle = truth.inverse() * Point2::new(SIDE_M, SIDE_M / 2.0);
            let off_m = (truth * middle - best.site_from_other * middle).norm();
            let turn_rad = truth.step_to(best.site_from_other).theta_rad;
            off_m < RIGHT_M && turn_rad.abs() < RIGHT_RAD
        });
        n_right += u32::from(is_sure && is_right);
        n_wrong += u32::from(is_sure && !is_right);
        n_unsure += u32::from(!is_sure && is_right);
    }
    let ms = 1e3 * taken_s / N_PAIRS as f64;
    println!("| {name} | {n_right} | {n_wrong} | {n_unsure} | {ms:.1} |");
}

fn is_sure(found: &LandmarkAlignments) -> bool {
    let best = found.ranked.first();
    found.is_enough && best.is_some_and(|best| LOG_ODDS_SURE <= best.log_odds)
}

/// Two maps, and where the second lies in the first; `None` if nowhere.
fn pair(
    kind: Kind,
    share: Option<f64>,
    rng: &mut ChaCha8Rng,
) -> (Constellation, Constellation, Option<Pose>) {
    let world = world(kind, rng);
    let mut site = seen(&world, Point2::origin(), Pose::IDENTITY, rng);
    if matches!(kind, Kind::BothWings) {
        let wing = seen(&world, Point2::new(100.0, 0.0), Pose::IDENTITY, rng);
        site.stars.extend(wing.stars);
        site.coverage.join(&wing.coverage, Pose::IDENTITY);
    }
    let other_from_world = Pose::new(
        rng.random_range(-50.0..50.0),
        rng.random_range(-50.0..50.0),
        rng.random_range(-PI..PI),
    );
    let Some(share) = share else {
        let (other, corner) = match kind {
            // The same building; the wing that the first robot was not in.
            Kind::Wings => (world, Point2::new(100.0, 0.0)),
            _ => (self::world(kind, rng), Point2::origin()),
        };
        return (site, seen(&other, corner, other_from_world, rng), None);
    };
    let corner = Point2::new(SIDE_M * (1.0 - share), 0.0);
    let other = seen(&world, corner, other_from_world, rng);
    (site, other, Some(other_from_world.inverse()))
}

/// Landmarks of a world, in metres.
fn world(kind: Kind, rng: &mut impl Rng) -> Vec<Point2<f64>> {
    let strewn = |rng: &mut dyn FnMut() -> Point2<f64>, n: usize| (0..n).map(|_| rng()).collect();
    let area_m2 = 2.0 * SIDE_M * SIDE_M;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "dozens")]
    let n = (area_m2 * DENSITY_PER_M2) as usize;
    let mut anywhere =
        || Point2::new(rng.random_range(0.0..2.0 * SIDE_M), rng.random_range(0.0..SIDE_M));
    match kind {
        Kind::Strewn => strewn(&mut anywhere, n),
        Kind::Doors => doors(rng),
        Kind::Wings | Kind::BothWings => {
            let wing: Vec<Point2<f64>> = strewn(&mut anywhere, n);
            let moved = wing.iter().map(|at| at + nalgebra::Vector2::new(100.0, 0.0));
            wing.iter().copied().chain(moved).collect()
        }
        Kind::Square => {
            let corners = [(5.0, 5.0), (25.0, 5.0), (25.0, 25.0), (5.0, 25.0)];
            corners.iter().map(|&(x, y)| Point2::new(x, y)).collect()
        }
    }
}

/// Doors at equal distances on both sides of three corridors, as one architect draws them: only where the
/// first door stands, and which is missing, differs.
fn doors(rng: &mut impl Rng) -> Vec<Point2<f64>> {
    let mut doors = Vec::new();
    let first_m = rng.random_range(0.0..4.0);
    for y_m in [5.0, 15.0, 25.0] {
        let mut x_m = first_m;
        while x_m < 2.0 * SIDE_M {
            for side_m in [-1.0, 1.0] {
                if rng.random_bool(0.9) {
                    doors.push(Point2::new(x_m, y_m + side_m));
                }
            }
            x_m += 4.0;
        }
    }
    doors
}

/// A robot's map of the square from a corner on, in its own frame.
fn seen(
    world: &[Point2<f64>],
    corner: Point2<f64>,
    robot_from_world: Pose,
    rng: &mut ChaCha8Rng,
) -> Constellation {
    let is_inside = |at: &&Point2<f64>| {
        let off = **at - corner;
        (0.0..SIDE_M).contains(&off.x) && (0.0..SIDE_M).contains(&off.y)
    };
    let mut stars = Vec::new();
    let mut noise = || {
        // The sum of twelve even numbers is about normal.
        let sum: f64 = (0..12).map(|_| rng.random_range(-0.5..0.5)).sum();
        STD_M * sum
    };
    let inside: Vec<_> = world.iter().filter(is_inside).collect();
    let off: Vec<_> = inside.iter().map(|_| nalgebra::Vector2::new(noise(), noise())).collect();
    for (at, off) in inside.into_iter().zip(off) {
        if !rng.random_bool(MISSED_SHARE) {
            stars.push(star(robot_from_world * (at + off)));
        }
        if rng.random_bool(SPURIOUS_SHARE) {
            let at = corner
                + nalgebra::Vector2::new(
                    rng.random_range(0.0..SIDE_M),
                    rng.random_range(0.0..SIDE_M),
                );
            stars.push(star(robot_from_world * at));
        }
    }
    Constellation { stars, coverage: coverage(corner, robot_from_world) }
}

fn star(position: Point2<f64>) -> Star {
    let covariance_m2 = Matrix2::identity() * (STD_M * STD_M);
    Star { position, covariance_m2, kind: LandmarkKind::Type(0), exists: 0.98 }
}

/// What a robot looked at that went through the whole square, in lanes.
fn coverage(corner: Point2<f64>, robot_from_world: Pose) -> Coverage {
    let detector = Detector { range_max_m: 4.0, half_field_of_view_rad: PI };
    let (mut steps, mut poses) = (Vec::new(), Vec::new());
    let mut x_m = 2.0;
    while x_m < SIDE_M - 1.0 {
        let mut y_m = 2.0;
        while y_m < SIDE_M - 1.0 {
            poses.push(robot_from_world * Pose::new(corner.x + x_m, corner.y + y_m, 0.0));
            steps.push(Step { motion: Motion::NONE, sightings: Vec::new() });
            y_m += 2.0;
        }
        x_m += 2.0;
    }
    Coverage::of(&Travel { detector, steps }, &poses, &Calibration::NONE)
}
