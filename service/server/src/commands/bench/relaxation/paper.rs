//! The paper's data sets in kind: after how many plain iterations they are right, and what the whole
//! relaxation makes of them.

use meetpoint_relaxation::Stage;
use meetpoint_sim::{LandmarkTravel, first_data_set, museum, second_data_set};

use super::iterations::Iterations;
use super::judgement::Judgement;
use super::plain_em::{paper_params, plain_em};
use super::relaxed::Relaxed;
use super::simulated::Simulated;

/// Prefixes of the first data set by sightings, and where the paper shows them.
const PREFIXES: [(usize, &str); 5] = [
    (5, "the small loop alone (Fig. 7)"),
    (15, "15 sightings (Fig. 8)"),
    (16, "16 sightings (Fig. 9)"),
    (17, "17 sightings (Fig. 10)"),
    (20, "20 sightings (Fig. 11)"),
];
/// Draws a data set from a seed.
type Drawn = fn(u64) -> LandmarkTravel;
/// Seeds of whole data sets, from the first on.
const N_SEEDS: u64 = 5;

/// Prints a row for every data set.
pub(super) fn print(first_seed: u64) {
    println!(
        "| data, seed | controls | sightings of landmarks | dead reckoning off | plain EM: right after | certain after | the job's EM: right after | certain after | relaxation: pairs wrong | landmarks off | path off | s | EM, MB |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    let first = first_data_set(first_seed);
    for (n_sightings, name) in PREFIXES {
        print_row(
            &format!("first data set, {name}, {first_seed}"),
            &first.until_sighting(n_sightings),
        );
    }
    let whole: [(&str, Drawn); 3] = [
        ("first data set", first_data_set),
        ("second data set", second_data_set),
        ("museum", museum),
    ];
    for (name, drawn) in whole {
        for seed in first_seed..first_seed.saturating_add(N_SEEDS) {
            print_row(&format!("{name}, {seed}"), &drawn(seed));
        }
    }
}

fn print_row(name: &str, travel: &LandmarkTravel) {
    let simulated = Simulated::of(travel);
    let plain = plain_em(&simulated, &paper_params(&simulated));
    // The job's EM begins at the map that the search found.
    let mut of_job = Iterations::default();
    let relaxed = Relaxed::watched(&simulated.travel, super::TWO, |stage, relaxation| {
        if let (Stage::FromHypothesis, Some(em)) = (stage, relaxation.em()) {
            of_job.note(em, &simulated);
        }
    });
    let judged = match &relaxed.outcome {
        Some(outcome) => {
            let Judgement { n_wrong_pairs, landmark_off_m, path_off_m } =
                Judgement::of(outcome, &simulated);
            format!("{n_wrong_pairs} | {landmark_off_m:.2} m | {path_off_m:.2} m")
        }
        None => "nothing found | | ".to_owned(),
    };
    println!(
        "| {name} | {} | {} of {} | {:.1} m | {} | {} | {} | {} | {judged} | {:.2} | {:.0} |",
        simulated.n_controls,
        simulated.truth.len(),
        simulated.n_landmarks_seen(),
        simulated.reckoned_off_m,
        plain.right_after(),
        plain.certain_after(),
        of_job.right_after(),
        of_job.certain_after(),
        relaxed.took().as_secs_f64(),
        super::megabytes(relaxed.n_bytes),
    );
}
