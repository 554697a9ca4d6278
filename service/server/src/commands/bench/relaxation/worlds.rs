//! A hundred random buildings of each kind, two at a time: how many come out right, and whether
//! confidence tells which.

use std::num::NonZero;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

use meetpoint_sim::{BenchmarkKind, benchmark_travel};

use super::judgement::Judgement;
use super::plain_em::{paper_params, plain_em};
use super::relaxed::Relaxed;
use super::simulated::Simulated;

/// Seeds that plain EM is run on for comparison.
const N_PLAIN: u64 = 10;
/// Quantiles of confidence that are told.
const QUANTILES: [f64; 5] = [0.0, 0.1, 0.5, 0.9, 1.0];
/// Both kinds, and what they are called.
const KINDS: [(BenchmarkKind, &str); 2] = [
    (BenchmarkKind::RandomError, "random errors, 4 to 15 m off"),
    (BenchmarkKind::SteadyDrift, "steady drift, 10 to 35 m off"),
];

/// What came of a world.
struct World {
    seed: u64,
    n_sightings: usize,
    reckoned_off_m: f64,
    seconds: f64,
    /// Judgement and confidence; `None` if nothing was found.
    found: Option<(Judgement, f64)>,
    /// Wrong pairs of plain EM, where it was run.
    plain_wrong: Option<usize>,
}

impl World {
    fn of(kind: BenchmarkKind, seed: u64, is_compared: bool) -> Self {
        let simulated = Simulated::of(&benchmark_travel(kind, seed));
        let relaxed = Relaxed::of(&simulated.travel, NonZero::<usize>::MIN);
        let outcome = relaxed.outcome.as_ref();
        let plain = || plain_em(&simulated, &paper_params(&simulated)).n_wrong_pairs;
        Self {
            seed,
            n_sightings: simulated.truth.len(),
            reckoned_off_m: simulated.reckoned_off_m,
            seconds: relaxed.took().as_secs_f64(),
            found: outcome.map(|found| (Judgement::of(found, &simulated), found.confidence)),
            plain_wrong: is_compared.then(plain),
        }
    }

    fn is_right(&self) -> bool {
        self.found.is_some_and(|(judged, _)| judged.n_wrong_pairs == 0)
    }

    fn confidence(&self) -> f64 {
        self.found.map_or(0.0, |(_, confidence)| confidence)
    }
}

/// Relaxes worlds of both kinds and prints what came of them.
pub(super) fn print(first_seed: u64, n_seeds: u64) {
    let of_kinds = KINDS.map(|(kind, name)| (name, worlds(kind, first_seed, n_seeds)));
    println!(
        "| worlds | right, of all | plain EM | landmarks off: p50, worst of right ones | path off: p50, worst | s: p50, worst |"
    );
    println!("|---|---|---|---|---|---|");
    for (name, worlds) in &of_kinds {
        print_kind(name, worlds);
    }
    println!(
        "\n| not right, seed | sightings | dead reckoning off | pairs wrong | landmarks off | path off | confidence |"
    );
    println!("|---|---|---|---|---|---|---|");
    for (name, worlds) in &of_kinds {
        worlds
            .iter()
            .filter(|world| !world.is_right())
            .for_each(|world| print_failure(name, world));
    }
    println!("\n| confidence | worlds | least | p10 | p50 | p90 | most |");
    println!("|---|---|---|---|---|---|---|");
    for (name, worlds) in &of_kinds {
        for (what, is_right) in [("right", true), ("not right", false)] {
            let of_them = worlds.iter().filter(|world| world.is_right() == is_right);
            print_confidence(&format!("{name}: {what}"), of_them.map(World::confidence));
        }
    }
    print_separation(of_kinds.iter().flat_map(|(_, worlds)| worlds));
}

/// The worlds of a kind, in the order of their seeds.
fn worlds(kind: BenchmarkKind, first_seed: u64, n_seeds: u64) -> Vec<World> {
    two_at_a_time(n_seeds, |place| World::of(kind, first_seed + place, place < N_PLAIN))
}

/// What comes of so many pieces of work, in order; each on one thread, two at a time.
fn two_at_a_time<T: Send>(n: u64, work: impl Fn(u64) -> T + Sync) -> Vec<T> {
    let next = AtomicU64::new(0);
    let done = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..super::TWO.get() {
            scope.spawn(|| {
                loop {
                    let place = next.fetch_add(1, Ordering::Relaxed);
                    if n <= place {
                        break;
                    }
                    let result = work(place);
                    done.lock().unwrap_or_else(PoisonError::into_inner).push((place, result));
                }
            });
        }
    });
    let mut done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    done.sort_by_key(|(place, _)| *place);
    done.into_iter().map(|(_, result)| result).collect()
}

fn print_kind(name: &str, worlds: &[World]) {
    let n_right = worlds.iter().filter(|world| world.is_right()).count();
    let plain: Vec<usize> = worlds.iter().filter_map(|world| world.plain_wrong).collect();
    let n_plain_right = plain.iter().filter(|&&wrong| wrong == 0).count();
    let right = || worlds.iter().filter(|world| world.is_right());
    let of_right = |value: fn(&Judgement) -> f64| {
        ascending(right().filter_map(|world| world.found.as_ref().map(|(judged, _)| value(judged))))
    };
    let landmarks_m = of_right(|judged| judged.landmark_off_m);
    let paths_m = of_right(|judged| judged.path_off_m);
    let seconds = ascending(worlds.iter().map(|world| world.seconds));
    println!(
        "| {name} | {n_right} of {} | {n_plain_right} of {} | {:.2} m, {:.2} m | {:.2} m, {:.2} m | {:.2}, {:.2} |",
        worlds.len(),
        plain.len(),
        quantile(&landmarks_m, 0.5),
        quantile(&landmarks_m, 1.0),
        quantile(&paths_m, 0.5),
        quantile(&paths_m, 1.0),
        quantile(&seconds, 0.5),
        quantile(&seconds, 1.0),
    );
}

fn print_failure(name: &str, world: &World) {
    let n = world.n_sightings;
    let judged = match &world.found {
        Some((judged, confidence)) => format!(
            "{} of {} | {:.2} m | {:.2} m | {confidence:.3}",
            judged.n_wrong_pairs,
            n * n.saturating_sub(1) / 2,
            judged.landmark_off_m,
            judged.path_off_m,
        ),
        None => "nothing found | | | ".to_owned(),
    };
    println!("| {name}, {} | {n} | {:.1} m | {judged} |", world.seed, world.reckoned_off_m);
}

fn print_confidence(name: &str, confidences: impl Iterator<Item = f64>) {
    let confidences = ascending(confidences);
    if confidences.is_empty() {
        return;
    }
    let told = QUANTILES.map(|share| format!("{:.3}", quantile(&confidences, share)));
    println!("| {name} | {} | {} |", confidences.len(), told.join(" | "));
}

/// How well confidence tells right worlds from others: the share of pairs of one and another in
/// which the right one is surer, and what the surest wrong one lies above of.
fn print_separation<'a>(worlds: impl Iterator<Item = &'a World>) {
    let (right, wrong): (Vec<&World>, Vec<&World>) = worlds.partition(|world| world.is_right());
    if right.is_empty() || wrong.is_empty() {
        println!("\nNothing for confidence to tell apart.");
        return;
    }
    let surer = |of_right: &&World| {
        wrong.iter().filter(|of_wrong| of_wrong.confidence() < of_right.confidence()).count()
    };
    let n_surer: usize = right.iter().map(surer).sum();
    let surest_wrong = wrong.iter().map(|world| world.confidence()).fold(0.0, f64::max);
    let n_above = right.iter().filter(|world| surest_wrong < world.confidence()).count();
    println!(
        "\nOf a right world and one that is not, the right one is surer in {:.1} % of all pairs; {n_above} of {} right ones lie above all others.",
        100.0 * n_surer as f64 / (right.len() * wrong.len()) as f64,
        right.len(),
    );
}

fn ascending(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values
}

/// The value that a share of the ascending ones does not exceed; NaN of none.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a place in a list, cut to its length"
)]
fn quantile(ascending: &[f64], share: f64) -> f64 {
    let place = (share * ascending.len() as f64).ceil() as usize;
    let index = place.clamp(1, ascending.len().max(1)) - 1;
    ascending.get(index).copied().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_values_that_were_measured() {
        let values: Vec<f64> = (1..=10).map(f64::from).collect();
        let told = QUANTILES.map(|share| quantile(&values, share));
        assert_eq!(told, [1.0, 1.0, 5.0, 9.0, 10.0], "of ten");
        assert!(quantile(&[], 0.5).is_nan(), "of none");
    }

    #[test]
    fn all_work_is_done_and_comes_in_order() {
        assert_eq!(two_at_a_time(100, |place| place), (0..100).collect::<Vec<_>>(), "each once");
        assert!(two_at_a_time(0, |place| place).is_empty(), "nothing to do");
    }
}
