//! Five real robots as five travels of unknown start, with identities and without.

use std::num::NonZero;
use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;

use meetpoint_geometry::{Point2, Pose};
use meetpoint_relaxation::{
    AlignmentParams, Constellation, Coverage, JointOutcome, LandmarkKind, Outcome, Placed,
    Relaxation, RelaxationParams, Star, StartBelief, Started, Travel, aligned, joint, one_em,
};
use nalgebra::Matrix2;

use crate::mrclam_folder::{Folder, Robot};

/// Prints how the robots are found, and what is off.
pub(crate) fn print(path: &Path) {
    for (name, is_anonymous) in [("identities", false), ("anonymous", true)] {
        let folder = Folder::read(path, is_anonymous);
        let begun = Instant::now();
        let outcomes: Vec<Outcome> =
            folder.robots.iter().map(|robot| relaxed(&robot.travel)).collect();
        println!("\n{name}: each relaxed by itself in {:.1} s", begun.elapsed().as_secs_f64());
        let travels: Vec<&Travel> = folder.robots.iter().map(|robot| &robot.travel).collect();
        let found = together(&travels, &outcomes);
        for (index, robot) in folder.robots.iter().enumerate().skip(1) {
            let Some(at) = found.order.iter().position(|&it| it == index) else {
                println!("robot {} was not found", index + 1);
                continue;
            };
            let first = &folder.robots[0];
            let (ours, others) = (&found.outcome.poses[0], &found.outcome.poses[at]);
            let off = first.start.step_to(robot.start).step_to(ours[0].step_to(others[0]));
            let between = frame_off(first, ours).inverse() * frame_off(robot, others);
            println!(
                "robot {} seen from robot 1: {:.3} m, {:.2} deg off by all of their ways; {:.3} m, \
                 {:.2} deg where odometry begins",
                index + 1,
                between.distance_m(),
                between.theta_rad.to_degrees(),
                off.distance_m(),
                off.theta_rad.to_degrees()
            );
        }
        let truth = true_landmarks(&folder);
        print_landmarks(&found.outcome, &truth, folder.robots[0].start);
        let begun = Instant::now();
        let started: Vec<Started<'_>> = found
            .order
            .iter()
            .zip(&found.outcome.poses)
            .map(|(&index, poses)| {
                let site_from_travel = poses[0];
                let (travel, outcome) = (travels[index], &outcomes[index]);
                let placed = Placed { travel, outcome, site_from_travel };
                Started { placed, start: StartBelief::At(site_from_travel) }
            })
            .collect();
        let ControlFlow::Continue(Some(after)) =
            one_em(&started, found.outcome, |_| ControlFlow::Continue(()))
        else {
            panic!("it fitted before")
        };
        println!(
            "one EM over all: {} sightings told otherwise, log-odds {:.1}, {:.2} s",
            after.n_told_otherwise,
            after.log_odds,
            begun.elapsed().as_secs_f64()
        );
        print_landmarks(&after.outcome, &truth, folder.robots[0].start);
    }
}

/// The rigid motion that takes what was found of a robot's way nearest to the truth.
fn frame_off(robot: &Robot, found: &[Pose]) -> Pose {
    let n = robot.truth.len() as f64;
    let sum = |values: &dyn Fn(&(usize, Pose)) -> nalgebra::Vector2<f64>| {
        robot.truth.iter().map(values).sum::<nalgebra::Vector2<f64>>() / n
    };
    let of_truth = sum(&|(_, truth)| truth.position().coords);
    let of_found = sum(&|(step, _)| found[*step].position().coords);
    let turned = sum(&|(step, truth)| {
        let (sin, cos) = (truth.theta_rad - found[*step].theta_rad).sin_cos();
        nalgebra::Vector2::new(cos, sin)
    });
    let turn = Pose::new(0.0, 0.0, turned.y.atan2(turned.x));
    let shift = of_truth - (turn * Point2::from(of_found)).coords;
    Pose::new(shift.x, shift.y, turn.theta_rad)
}

fn relaxed(travel: &Travel) -> Outcome {
    let n_threads = NonZero::new(2).expect("not zero");
    let params = RelaxationParams { n_threads, ..RelaxationParams::of(travel) };
    let mut relaxation = Relaxation::new(travel, params);
    while !relaxation.advance().is_done {}
    relaxation.outcome().cloned().expect("landmarks were seen")
}

struct Found {
    /// Indices of the robots, in the order in which they were found.
    order: Vec<usize>,
    outcome: JointOutcome,
}

/// The first robot, then whichever is surest.
fn together(travels: &[&Travel], outcomes: &[Outcome]) -> Found {
    let params = AlignmentParams::CAMERA;
    let place = |index: usize, site_from_travel: Pose| Placed {
        travel: travels[index],
        outcome: &outcomes[index],
        site_from_travel,
    };
    let mut placed = vec![place(0, Pose::IDENTITY)];
    let mut order = vec![0];
    let begun = Instant::now();
    let mut outcome = joint(&placed, &params).expect("it was relaxed");
    while order.len() < travels.len() {
        let known: Vec<&Travel> = order.iter().map(|&index| travels[index]).collect();
        let site = Constellation::of_joint(&known, &outcome);
        let rest = (0..travels.len()).filter(|index| !order.contains(index));
        let all = rest.filter_map(|index| {
            let other = Constellation::of(travels[index], &outcomes[index]);
            let found = aligned(&site, &other, &params);
            found.ranked.into_iter().next().map(|best| (index, best))
        });
        let best = all.max_by(|a, b| a.1.log_odds.total_cmp(&b.1.log_odds));
        let Some((index, best)) = best else { break };
        println!(
            "robot {} lies in the map with log-odds {:.1}, {} landmarks matched, {} contradicted",
            index + 1,
            best.log_odds,
            best.n_matched,
            best.n_contradicted
        );
        placed.push(place(index, best.site_from_other));
        order.push(index);
        outcome = joint(&placed, &params).expect("it can be solved");
    }
    println!("found and fitted in {:.2} s", begun.elapsed().as_secs_f64());
    Found { order, outcome }
}

fn true_landmarks(folder: &Folder) -> Constellation {
    let star = |(_, &position): (&u32, &Point2<f64>)| Star {
        position,
        covariance_m2: Matrix2::zeros(),
        kind: LandmarkKind::Type(0),
        exists: 1.0,
    };
    let stars = folder.landmarks.iter().map(star).collect();
    Constellation { stars, coverage: Coverage::default() }
}

/// How far landmarks are from true ones: of the whole map laid over the truth, and seen from where the
/// first robot truly started.
fn print_landmarks(outcome: &JointOutcome, truth: &Constellation, start: Pose) {
    let stars = outcome.landmarks.iter().map(|landmark| Star {
        position: landmark.position,
        covariance_m2: landmark.shape_covariance_m2,
        kind: LandmarkKind::Type(0),
        exists: 0.9,
    });
    let found = Constellation { stars: stars.collect(), coverage: Coverage::default() };
    let laid = aligned(truth, &found, &AlignmentParams::CAMERA);
    let Some(best) = laid.ranked.first() else {
        println!("no landmark is near a true one");
        return;
    };
    for (index, landmark) in outcome.landmarks.iter().enumerate() {
        let is_true = best.matches.iter().any(|it| it.1 == index);
        if !is_true {
            let n = landmark.sightings.len();
            let mut who: Vec<_> = landmark.sightings.iter().map(|it| it.0).collect();
            who.dedup();
            println!(
                "not a true one: {n} sightings by {who:?} at {}",
                best.site_from_other * landmark.position
            );
        }
    }
    let off_m = |frame: Pose| {
        let off = best.matches.iter().map(|&(is, found_as)| {
            (truth.stars[is].position - frame * found.stars[found_as].position).norm()
        });
        let off: Vec<f64> = off.collect();
        (off.iter().sum::<f64>() / off.len() as f64, off.iter().copied().fold(0.0, f64::max))
    };
    let (laid_over, from_start) = (off_m(best.site_from_other), off_m(start));
    println!(
        "{} landmarks, {} of {} true ones; mean, most off: {:.3} m, {:.3} m laid over the truth; \
         {:.3} m, {:.3} m seen from the first robot's start",
        outcome.landmarks.len(),
        best.n_matched,
        truth.stars.len(),
        laid_over.0,
        laid_over.1,
        from_start.0,
        from_start.1
    );
}
