//! What the paper's largest run costs: the whole relaxation of the first data set, stage by stage,
//! and plain iterations on the paper's grid.

use std::time::{Duration, Instant};

use meetpoint_relaxation::{Em, Stage, Start};
use meetpoint_sim::first_data_set;

use super::super::child::peak_memory_mb;
use super::judgement::Judgement;
use super::plain_em::paper_params;
use super::relaxed::Relaxed;
use super::simulated::Simulated;

/// Prints both tables.
pub(super) fn print(seed: u64) {
    let simulated = Simulated::of(&first_data_set(seed));
    println!(
        "First data set, seed {seed}: {} controls, {} steps, two threads.\n",
        simulated.n_controls,
        simulated.travel.steps.len()
    );
    print_whole(&simulated);
    print_iterations(&simulated);
}

fn print_whole(simulated: &Simulated) {
    let before_mb = peak_memory_mb(std::process::id());
    let relaxed = Relaxed::of(&simulated.travel, super::TWO);
    let after_mb = peak_memory_mb(std::process::id());
    let n_wrong =
        relaxed.outcome.as_ref().map(|found| Judgement::of(found, simulated).n_wrong_pairs);
    let told = n_wrong.map_or("nothing found".to_owned(), |n| format!("{n} pairs wrong"));
    println!("| whole relaxation: {told} | pieces | s | longest, s |");
    println!("|---|---|---|---|");
    for timed in &relaxed.stages {
        let (took, longest) = (timed.took.as_secs_f64(), timed.longest.as_secs_f64());
        println!("| {} | {} | {took:.2} | {longest:.3} |", name(timed.stage), timed.n_pieces);
    }
    println!("| all | | {:.2} | |", relaxed.took().as_secs_f64());
    if let Some((before_mb, after_mb)) = before_mb.zip(after_mb) {
        println!("\nPeak memory of the process: {after_mb:.0} MB, {before_mb:.0} MB of it before.");
    }
}

fn name(stage: Stage) -> &'static str {
    match stage {
        Stage::Search => "search over associations, EM's tables",
        Stage::FromControls => "EM from the controls",
        Stage::FromHypothesis => "EM from the search's map",
        Stage::Refinement => "least squares",
    }
}

fn print_iterations(simulated: &Simulated) {
    let params = paper_params(simulated);
    let begun = Instant::now();
    let mut em = Em::new(&simulated.travel, params, Start::Controls);
    let tables = begun.elapsed();
    let (mut taken, mut n_bytes, mut n_products) = (Vec::new(), 0, 0);
    while !em.has_converged() {
        let begun = Instant::now();
        let figures = em.iterate();
        taken.push(begun.elapsed());
        n_bytes = n_bytes.max(figures.n_bytes);
        n_products += figures.n_products;
    }
    let all: Duration = taken.iter().sum();
    taken.sort_unstable();
    let n = taken.len().max(1) as f64;
    let n_steps = simulated.travel.steps.len() as f64;
    println!(
        "\n| plain EM, 90 by 90 m, 1 m, 5° | tables, s | iteration: p50, longest, s | a step, ms | ns a cell times entry of its kernel | MB |"
    );
    println!("|---|---|---|---|---|---|");
    println!(
        "| {} iterations | {:.2} | {:.3}, {:.3} | {:.2} | {:.2} | {:.0} |",
        taken.len(),
        tables.as_secs_f64(),
        taken.get(taken.len() / 2).map_or(f64::NAN, Duration::as_secs_f64),
        taken.last().map_or(f64::NAN, Duration::as_secs_f64),
        1e3 * all.as_secs_f64() / n / n_steps,
        1e9 * all.as_secs_f64() / n_products as f64,
        super::megabytes(n_bytes),
    );
}
