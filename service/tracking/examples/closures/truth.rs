//! Outcomes held against the truth.

use std::collections::{BTreeMap, BTreeSet};

use meetpoint_geometry::{Pose, wrap_angle};
use meetpoint_tracking::{Closure, LaserOutcome, LaserTravel, Verdict};
use nalgebra::{Matrix3, Vector3};

/// A closure that is farther from the truth is false, in metres and radians.
const FALSE_M: f64 = 0.3;
const FALSE_RAD: f64 = 0.1;

/// A robot is back where it was if it is as near, in metres: half the way between submaps, and a
/// corridor's width...
const BACK_M: f64 = 3.0;
/// ...and was there as much of way before, in metres: less is the same pass.
const AGO_M: f64 = 10.0;
/// The way is closed as far as a submap reaches from one that is, in metres.
const SUBMAP_M: f64 = 4.0;

/// Square of its error, in units of its covariance, from which a closure is false: a corridor says
/// nothing of where along it one is, and does not claim to.
const CHI2_FALSE: f64 = 25.0;

/// What was found on a drive.
#[derive(Clone, Copy, Default)]
pub(crate) struct Found {
    pub(crate) n_false: u32,
    pub(crate) back_m: f64,
    pub(crate) closed_m: f64,
}

/// Prints how many closures are true and false, and how far poses are from the truth.
pub(crate) fn print(travel: &LaserTravel, truths: &[Pose], outcome: &LaserOutcome) -> Found {
    let poses = outcome.travels[0].poses.iter().copied();
    let by_stamp: BTreeMap<i64, Pose> =
        travel.scans.iter().map(|scan| scan.stamp_ns).zip(truths.iter().copied()).collect();
    let (mut verdicts, mut n_false, mut worst_m) =
        (BTreeMap::<String, [u32; 2]>::new(), 0, 0.0_f64);
    for closure in &outcome.closures {
        let truth =
            by_stamp[&closure.key.from.stamp_ns].step_to(by_stamp[&closure.key.to.stamp_ns]);
        let error = truth.step_to(closure.from_to);
        let far = FALSE_M < error.distance_m() || FALSE_RAD < error.theta_rad.abs();
        let is_false = far && CHI2_FALSE < chi2(truth, closure);
        verdicts.entry(format!("{:?}", closure.verdict)).or_default()[usize::from(is_false)] += 1;
        if closure.verdict == Verdict::Accepted {
            n_false += u32::from(is_false);
            if is_false {
                println!("  false: {error:?} from the truth: {closure:?}");
            }
            worst_m = worst_m.max(if is_false { error.distance_m() } else { 0.0 });
        }
    }
    println!(
        "  {n_false} false closures accepted, the worst {worst_m:.3} m off; true and false: {verdicts:?}"
    );
    let stamps: Vec<i64> = travel.scans.iter().map(|scan| scan.stamp_ns).collect();
    let accepted = outcome.closures.iter().filter(|closure| closure.verdict == Verdict::Accepted);
    let closed = accepted.map(|closure| stamps.partition_point(|at| *at < closure.key.to.stamp_ns));
    let [back_m, closed_m] = returns_m(truths, &closed.collect());
    println!("  {back_m:.0} m led where it had been, {closed_m:.0} m of them closed");
    let live = travel.scans.iter().map(|scan| scan.map_from_robot);
    println!("  live    {}", errors(live, truths));
    println!("  relaxed {}", errors(poses, truths));
    Found { n_false, back_m, closed_m }
}

/// Of the way that was driven, in metres, how much led where the robot had been, and how much of that has
/// an accepted closure.
fn returns_m(truths: &[Pose], closed: &BTreeSet<usize>) -> [f64; 2] {
    let steps = truths.windows(2).map(|pair| pair[0].step_to(pair[1]).distance_m());
    let way_m: Vec<f64> = std::iter::once(0.0)
        .chain(steps.scan(0.0, |sum, step| {
            *sum += step;
            Some(*sum)
        }))
        .collect();
    let is_back = |scan: usize| {
        let before = truths.iter().zip(&way_m).take_while(|(_, at)| **at + AGO_M <= way_m[scan]);
        before.into_iter().any(|(pose, _)| pose.step_to(truths[scan]).distance_m() < BACK_M)
    };
    let is_closed =
        |scan: usize| closed.iter().any(|&other| (way_m[other] - way_m[scan]).abs() <= SUBMAP_M);
    let (mut back_m, mut closed_m) = (0.0, 0.0);
    for scan in (1..truths.len()).filter(|&scan| is_back(scan)) {
        let step_m = way_m[scan] - way_m[scan - 1];
        back_m += step_m;
        closed_m += if is_closed(scan) { step_m } else { 0.0 };
    }
    [back_m, closed_m]
}

/// Square of what a closure is off the truth by, in units of its covariance.
fn chi2(truth: Pose, closure: &Closure) -> f64 {
    let error = Vector3::new(
        closure.from_to.x_m - truth.x_m,
        closure.from_to.y_m - truth.y_m,
        wrap_angle(closure.from_to.theta_rad - truth.theta_rad),
    );
    let covariance = Matrix3::from_fn(|row, column| closure.covariance[row][column]);
    covariance.try_inverse().map_or(0.0, |information| error.dot(&(information * error)))
}

/// Mean and largest distance between poses and truth, in metres, both begun at the same pose.
fn errors(poses: impl Iterator<Item = Pose>, truths: &[Pose]) -> String {
    let mut start: Option<Pose> = None;
    let (mut sum_m, mut most_m) = (0.0, 0.0_f64);
    for (pose, truth) in poses.zip(truths) {
        let first = *start.get_or_insert(*truth * pose.inverse());
        let error_m = truth.step_to(first * pose).distance_m();
        sum_m += error_m;
        most_m = most_m.max(error_m);
    }
    format!("{:.3} m off in the mean, {most_m:.3} m at most", sum_m / truths.len().max(1) as f64)
}
