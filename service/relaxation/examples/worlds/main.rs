//! How many of a hundred random buildings come out right.
//!
//! ```text
//! cargo run --release -p meetpoint-relaxation --example worlds -- [--seeds N] [--first SEED]
//! ```

mod judge;
mod travel;

use std::time::Instant;

use meetpoint_relaxation::{Relaxation, RelaxationParams};
use meetpoint_sim::{BenchmarkKind, benchmark_travel};

use crate::judge::Judgement;

fn main() {
    let words: Vec<String> = std::env::args().collect();
    let number = |name: &str, otherwise: u64| {
        let place = words.iter().position(|word| word == name);
        place.and_then(|place| words.get(place + 1)?.parse().ok()).unwrap_or(otherwise)
    };
    let (first, n) = (number("--first", 0), number("--seeds", 100));
    let runs_em = !words.iter().any(|word| word == "--search-only");
    for kind in [BenchmarkKind::RandomError, BenchmarkKind::SteadyDrift] {
        println!(
            "\n| {kind:?}, seed | sightings | off (m) | pairs wrong | landmarks off (m) | path off (m) | confidence | s |"
        );
        println!("|---|---|---|---|---|---|---|---|");
        let mut n_right = 0;
        for seed in first..first + n {
            let simulated = benchmark_travel(kind, seed);
            let (travel, truth) = travel::travel(&simulated);
            let start = Instant::now();
            let mut relaxation = Relaxation::new(
                &travel,
                RelaxationParams { runs_em, ..RelaxationParams::of(&travel) },
            );
            while !relaxation.advance().is_done {}
            let seconds = start.elapsed().as_secs_f64();
            let Some(outcome) = relaxation.outcome() else {
                println!("| {seed} | nothing found |");
                continue;
            };
            let judged = Judgement::of(outcome, &simulated, &truth);
            n_right += u32::from(judged.n_wrong_pairs == 0);
            println!(
                "| {seed} | {} | {:.1} | {} | {:.2} | {:.2} | {:.3} | {seconds:.2} |",
                truth.len(),
                simulated.final_error_m(),
                judged.n_wrong_pairs,
                judged.landmark_error_m,
                judged.path_error_m,
                outcome.confidence,
            );
        }
        println!("\n{kind:?}: {n_right} of {n} right");
    }
}
