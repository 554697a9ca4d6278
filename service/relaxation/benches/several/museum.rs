//! The paper's second museum run (TBF98 section 8, Fig. 18) in kind: localised on the map of the first.

use std::f64::consts::PI;
use std::num::NonZero;
use std::time::Instant;

use meetpoint_geometry::{Point2, Pose};
use meetpoint_relaxation::{
    Detector, Landmark, LandmarkKind, Localization, LocalizationParams, Motion, PerceptionParams,
    Relaxation, RelaxationParams, Sighting, Step, Travel,
};
use meetpoint_sim::{LandmarkTravel, Stage, museum, museum_again};

/// "A step per landmark or every 20 m."
const STEP_M: f64 = 20.0;
/// A pose is found if it has this probability, within two metres and twenty degrees...
const SURE: f64 = 0.8;
/// ...and is no farther off than this, in metres and radians.
const RIGHT_M: f64 = 2.0;
const RIGHT_RAD: f64 = 0.35;
const N_RUNS: u64 = 20;

/// Sightings that no map explains, a square metre, that are tried: how soon a robot is found depends on
/// little else.
const FALSE_PER_M2: [f64; 3] = [1e-2, 1e-3, 1e-4];

/// Prints a row a pair of runs, and how long the longest step took; then how soon the same robots are found
/// by others' belief in false sightings.
pub(crate) fn print() {
    println!(
        "| run | markers found | sightings until found | at the end | ms a step, most | s in all |"
    );
    println!("|---|---|---|---|---|---|");
    let mut known = Vec::new();
    for seed in 0..N_RUNS {
        let (first, second) = (cut(&museum(seed)), cut(&museum_again(seed)));
        let n_threads = NonZero::new(2).expect("not zero");
        let params = RelaxationParams { n_threads, ..RelaxationParams::of(&first.0) };
        let mut relaxation = Relaxation::new(&first.0, params);
        while !relaxation.advance().is_done {}
        let Some(outcome) = relaxation.outcome() else { continue };
        let map = outcome.known_map();
        row(seed, &map, (&second.0, &second.1), first.1[0]);
        known.push((map, second, first.1[0]));
    }
    println!("\n| false sightings a m2 | found | of these wrong | after so many sightings |");
    println!("|---|---|---|---|");
    for false_per_m2 in FALSE_PER_M2 {
        for (means, is_exact) in [("", false), (", the exact posterior", true)] {
            let button = LocalizationParams::BUTTON;
            let perception = PerceptionParams { false_per_m2, ..button.perception };
            let n_threads = NonZero::new(2).expect("not zero");
            let params = LocalizationParams { perception, n_threads, ..button };
            // What equals the definition, pose by pose (tests/several/localization.rs): nothing is pooled.
            let exact = LocalizationParams { selection_share: 0.0, mean_share: 0.0, ..params };
            let params = if is_exact { exact } else { params };
            let found =
                known.iter().filter_map(|(map, second, first)| found(map, second, *first, params));
            let found: Vec<(usize, bool)> = found.collect();
            let n_wrong = found.iter().filter(|(_, is_right)| !is_right).count();
            let mut after: Vec<usize> = found.iter().map(|(n_seen, _)| *n_seen).collect();
            after.sort_unstable();
            let n_found = found.len();
            println!("| {false_per_m2}{means} | {n_found} of {N_RUNS} | {n_wrong} | {after:?} |");
        }
    }
}

/// Sightings until a robot is told where it is, and whether that is right; `None` if it never is.
fn found(
    map: &[Landmark],
    (travel, truth): &(Travel, Vec<Pose>),
    first: Pose,
    params: LocalizationParams,
) -> Option<(usize, bool)> {
    let mut localization = Localization::new(map, travel.detector, params).expect("a grid");
    let mut n_seen = 0;
    travel.steps.iter().zip(truth).find_map(|(step, truth)| {
        let told = localization.advance(step);
        n_seen += step.sightings.len();
        let best = told.peaks.first().filter(|best| SURE <= best.around)?;
        Some((n_seen, is_right(first.step_to(*truth).step_to(best.pose))))
    })
}

fn is_right(off: Pose) -> bool {
    off.distance_m() < RIGHT_M && off.theta_rad.abs() < RIGHT_RAD
}

fn row(seed: u64, map: &[Landmark], (travel, truth): (&Travel, &[Pose]), first: Pose) {
    let begun = Instant::now();
    let params = LocalizationParams {
        n_threads: NonZero::new(2).expect("not zero"),
        ..LocalizationParams::BUTTON
    };
    let mut localization = Localization::new(map, travel.detector, params).expect("a grid");
    let (mut n_seen, mut found_after, mut most_s) = (0, None, 0.0_f64);
    let mut last = String::new();
    for (step, truth) in travel.steps.iter().zip(truth) {
        let step_begun = Instant::now();
        let told = localization.advance(step);
        most_s = most_s.max(step_begun.elapsed().as_secs_f64());
        n_seen += step.sightings.len();
        let Some(best) = told.peaks.first() else { continue };
        let off = first.step_to(*truth).step_to(best.pose);
        if SURE <= best.around && found_after.is_none() {
            let right = if is_right(off) { "right" } else { "WRONG" };
            found_after = Some(format!("{n_seen}, {right}"));
        }
        last = format!(
            "{:.2} m, {:.1} deg off, {:.2} near, {:.2} around",
            off.distance_m(),
            off.theta_rad.to_degrees(),
            best.probability,
            best.around
        );
    }
    println!(
        "| {seed} | {} | {} | {last} | {:.0} | {:.2} |",
        map.len(),
        found_after.unwrap_or_else(|| "never".to_owned()),
        1e3 * most_s,
        begun.elapsed().as_secs_f64(),
    );
}

/// A step for every sighting and after 20 m without one, and where the robot truly was.
pub(crate) fn cut(simulated: &LandmarkTravel) -> (Travel, Vec<Pose>) {
    let (mut steps, mut truth) = (Vec::new(), Vec::new());
    for Stage { legs, end } in simulated.stages(STEP_M) {
        let sightings = end.sightings.iter().map(|seen| Sighting {
            identity: None,
            landmark_type: seen.landmark_type,
            range_m: seen.range_m,
            bearing_rad: seen.bearing_rad,
        });
        steps.push(Step { motion: Motion::new(legs), sightings: sightings.collect() });
        truth.push(end.truth);
    }
    let detector = Detector { range_max_m: 0.0, half_field_of_view_rad: PI };
    (Travel { detector, steps }, truth)
}

/// The paper's area, 90 by 90 m on its grid: what one step costs there at most.
pub(crate) fn print_largest() {
    let map: Vec<Landmark> = (0..40_u32)
        .map(|index| Landmark {
            position: Point2::new(
                f64::from(index % 8) * 10.0 - 5.0,
                f64::from(index * 7 % 10) * 9.0 - 10.0,
            ),
            covariance_m2: nalgebra::Matrix2::identity() * 0.1,
            kind: LandmarkKind::Type(0),
            certainty: 0.95,
        })
        .collect();
    let detector = Detector { range_max_m: 0.0, half_field_of_view_rad: PI };
    let params = LocalizationParams { margin_m: 5.0, ..LocalizationParams::BUTTON };
    let mut localization = Localization::new(&map, detector, params).expect("a grid");
    let button = Sighting { identity: None, landmark_type: 0, range_m: 0.0, bearing_rad: 0.0 };
    let motion = Motion::new(vec![Pose::new(0.5, 0.0, 0.02); 24]);
    println!(
        "\n{} poses, one thread; a step each, with a sighting:",
        localization.grid().n_cells()
    );
    for _ in 0..5 {
        let begun = Instant::now();
        let told = localization.advance(&Step { motion: motion.clone(), sightings: vec![button] });
        println!(
            "{:.0} ms, entropy {:.1}, elsewhere {:.3}",
            1e3 * begun.elapsed().as_secs_f64(),
            told.entropy,
            told.elsewhere
        );
    }
}
