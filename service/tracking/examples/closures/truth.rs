//! Outcomes held against the truth.

use std::collections::BTreeMap;

use meetpoint_geometry::{Pose, wrap_angle};
use meetpoint_tracking::{Closure, LaserOutcome, LaserTravel, Verdict};
use nalgebra::{Matrix3, Vector3};

/// A closure that is farther from the truth is false, in metres and radians.
const FALSE_M: f64 = 0.3;
const FALSE_RAD: f64 = 0.1;

/// Square of its error, in units of its covariance, from which a closure is false: a corridor says
/// nothing of where along it one is, and does not claim to.
const CHI2_FALSE: f64 = 25.0;

/// Prints how many closures are true and false, and how far poses are from the truth.
pub(crate) fn print(travel: &LaserTravel, truths: &[Pose], outcome: &LaserOutcome) {
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
    let live = travel.scans.iter().map(|scan| scan.map_from_robot);
    println!("  live    {}", errors(live, truths));
    println!("  relaxed {}", errors(poses, truths));
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
