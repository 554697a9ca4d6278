//! How many of a hundred random buildings come out right.
//!
//! ```text
//! cargo run --release -p meetpoint-relaxation --example worlds -- [N_SEEDS]
//! ```

mod travel;

use std::time::Instant;

use meetpoint_relaxation::{ErrorModel, SearchParams, hypotheses};
use meetpoint_sim::{BenchmarkKind, benchmark_travel};

fn main() {
    let n: u64 = std::env::args().nth(1).and_then(|word| word.parse().ok()).unwrap_or(10);
    let only: Option<u64> = std::env::args().nth(2).and_then(|word| word.parse().ok());
    for kind in [BenchmarkKind::RandomError, BenchmarkKind::SteadyDrift] {
        let mut n_right = 0;
        for seed in (0..n).filter(|seed| only.is_none_or(|only| only == *seed)) {
            let simulated = benchmark_travel(kind, seed);
            let (travel, truth) = travel::travel(&simulated);
            let start = Instant::now();
            let found = hypotheses(&travel, &ErrorModel::BUTTON, &SearchParams::BUTTON);
            let seconds = start.elapsed().as_secs_f64();
            let wrong = |index: usize| {
                found.get(index).map(|found| n_wrong_pairs(&found.association, &truth))
            };
            let n_wrong = wrong(0);
            let rank = (0..found.len()).find(|&index| wrong(index) == Some(0));
            n_right += u32::from(n_wrong == Some(0));
            let margin = rank.map(|rank| {
                found[rank].log_evidence
                    - found[usize::from(rank == 0).min(found.len() - 1)].log_evidence
            });
            println!(
                "{kind:?} {seed}: {} sightings, off {:.1} m; wrong {n_wrong:?}, true at {rank:?} of {} ({margin:.1?}), {seconds:.2} s, {:?}",
                truth.len(),
                simulated.final_error_m(),
                found.len(),
                found.first().map(|f| f.log_evidence),
            );
        }
        println!("{kind:?}: {n_right} of {n}");
    }
}

/// Pairs of sightings that are told to be of one landmark and are not, or the other way round.
fn n_wrong_pairs(found: &[Option<u32>], truth: &[usize]) -> usize {
    let mut n = 0;
    for a in 0..truth.len() {
        for b in 0..a {
            let same = found[a].is_some() && found[a] == found[b];
            n += usize::from(same != (truth[a] == truth[b]));
        }
    }
    n
}
