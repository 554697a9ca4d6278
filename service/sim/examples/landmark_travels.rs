//! A table of the travels that relaxation is judged by: `cargo run -p meetpoint-sim --example
//! landmark_travels`.

use meetpoint_sim::{
    BenchmarkKind, LandmarkTravel, benchmark_travel, first_data_set, museum, museum_again,
    second_data_set,
};

fn main() {
    println!(
        "{:<14}{:>5}{:>11}{:>11}{:>10}{:>9}{:>9}{:>8}",
        "travel", "seed", "landmarks", "sightings", "controls", "m", "m off", "° off"
    );
    for seed in 0..5 {
        row("first 1998", seed, &first_data_set(seed));
        row("second 1998", seed, &second_data_set(seed));
        row("museum", seed, &museum(seed));
        row("museum again", seed, &museum_again(seed));
    }
    for seed in 0..100 {
        row("random error", seed, &benchmark_travel(BenchmarkKind::RandomError, seed));
    }
    for seed in 0..100 {
        row("steady drift", seed, &benchmark_travel(BenchmarkKind::SteadyDrift, seed));
    }
}

fn row(name: &str, seed: u64, travel: &LandmarkTravel) {
    println!(
        "{name:<14}{seed:>5}{:>11}{:>11}{:>10}{:>9.1}{:>9.1}{:>8.1}",
        travel.landmarks.len(),
        travel.n_sightings(),
        travel.n_controls(),
        travel.length_m(),
        travel.final_error_m(),
        travel.dead_reckoning_error(travel.n_controls()).theta_rad.to_degrees(),
    );
}
