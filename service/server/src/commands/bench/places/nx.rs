//! Tables: explored completely, the true graph, rehearsals, steps.

use meetpoint_places::qualitative::ExplorerParams;
use meetpoint_sim::{NxDrive, NxExplored, NxWorld, nx_worlds, nx_worlds_of};

/// Standard deviations of readings, as shares of the distances.
const RANGE_ERRORS: [f64; 3] = [0.0, 0.05, 0.1];
const COLUMNS: &str =
    "complete | isomorphic | rehearsals | of these refuted | steps | firings | way |";

/// A row an environment, compass and error; means over the seeds.
pub(super) fn of_errors(n_seeds: u64) {
    println!("| environment | compass | error | {COLUMNS}");
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for (compass, params) in
        [("yes", ExplorerParams::NX), ("no", ExplorerParams::NX_WITHOUT_COMPASS)]
    {
        for range_error in RANGE_ERRORS {
            let drive = NxDrive { params, range_error, has_home: false, seed: 0 };
            let mut all = Vec::new();
            for (name, runs) in runs(drive, n_seeds) {
                println!("| {name} | {compass} | {:.0} % {}", range_error * 100.0, row(&runs));
                all.extend(runs);
            }
            println!("| **all** | {compass} | {:.0} % {}", range_error * 100.0, row(&all));
        }
    }
}

/// A row for each error and number of firings that are averaged: where it ends. All environments, with
/// a compass.
pub(super) fn of_noise(n_seeds: u64) {
    println!("| error | firings averaged | {COLUMNS}");
    println!("|---|---|---|---|---|---|---|---|---|");
    for range_error in [0.1, 0.15, 0.2, 0.3] {
        for share in [1, 2, 4] {
            let mut params = ExplorerParams::NX;
            let pilot = &mut params.pilot;
            pilot.n_firings_under_way /= share;
            pilot.n_firings_climb /= share;
            pilot.n_firings_survey /= share;
            let drive = NxDrive { params, range_error, has_home: false, seed: 0 };
            let all: Vec<NxExplored> =
                runs(drive, n_seeds).into_iter().flat_map(|(_, runs)| runs).collect();
            println!(
                "| {:.0} % | {} on the way, {} at places {}",
                range_error * 100.0,
                params.pilot.n_firings_under_way,
                2 * params.pilot.n_firings_survey,
                row(&all)
            );
        }
    }
}

/// A row for each width of corridors, where the robot expects 2 m; at 5 and 10 %, with a compass.
pub(super) fn of_widths(n_seeds: u64) -> anyhow::Result<()> {
    println!("| corridors | error | {COLUMNS}");
    println!("|---|---|---|---|---|---|---|---|---|");
    for width_m in [1.4, 1.7, 2.0, 2.3, 2.6, 3.0] {
        let worlds = nx_worlds_of(width_m)?;
        for range_error in [0.05, 0.1] {
            let params = ExplorerParams::NX;
            let drive = NxDrive { params, range_error, has_home: false, seed: 0 };
            let runs = runs_in(&worlds, drive, n_seeds);
            let all: Vec<NxExplored> = runs.into_iter().flat_map(|(_, runs)| runs).collect();
            println!("| {width_m:.1} m | {:.0} % {}", range_error * 100.0, row(&all));
        }
    }
    Ok(())
}

/// A row for each of the things that tell places apart or not: dead reckoning, how far rehearsals lead,
/// home. All environments at 5 % error, with a compass.
pub(super) fn of_matching(n_seeds: u64) {
    println!("| dead reckoning | rehearsals lead | home | {COLUMNS}");
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for has_position in [true, false] {
        for n_rehearsal_edges_max in [0, 1, 2, 3] {
            for has_home in [false, true] {
                let drift_share =
                    if has_position { ExplorerParams::NX.drift_share } else { f64::INFINITY };
                let params =
                    ExplorerParams { drift_share, n_rehearsal_edges_max, ..ExplorerParams::NX };
                let drive = NxDrive { params, range_error: 0.05, has_home, seed: 0 };
                let all: Vec<NxExplored> =
                    runs(drive, n_seeds).into_iter().flat_map(|(_, runs)| runs).collect();
                println!(
                    "| {} | {n_rehearsal_edges_max} edges | {} {}",
                    if has_position { "yes" } else { "no" },
                    if has_home { "marked" } else { "no" },
                    row(&all)
                );
            }
        }
    }
}

/// Every environment with that many seeds.
fn runs(drive: NxDrive, n_seeds: u64) -> Vec<(&'static str, Vec<NxExplored>)> {
    runs_in(&nx_worlds(), drive, n_seeds)
}

fn runs_in(
    worlds: &[NxWorld],
    drive: NxDrive,
    n_seeds: u64,
) -> Vec<(&'static str, Vec<NxExplored>)> {
    let of_world = |world: &NxWorld| {
        let run = |seed| NxDrive { seed, ..drive }.explore(world, |_, _, _| {});
        (world.name, (0..n_seeds).map(run).collect())
    };
    worlds.iter().map(of_world).collect()
}

fn row(runs: &[NxExplored]) -> String {
    let count = |of: &dyn Fn(&NxExplored) -> bool| runs.iter().filter(|run| of(run)).count();
    let mean =
        |of: &dyn Fn(&NxExplored) -> f64| runs.iter().map(of).sum::<f64>() / runs.len() as f64;
    format!(
        "| {} of {} | {} | {:.1} | {:.1} | {:.0} | {:.0} | {:.0} m |",
        count(&|run| run.explored.is_complete),
        runs.len(),
        count(&|run| run.is_true),
        mean(&|run| f64::from(run.explored.explorer.n_rehearsals())),
        mean(&|run| f64::from(run.explored.explorer.n_refuted())),
        mean(&|run| f64::from(run.explored.n_steps)),
        mean(&|run| f64::from(run.explored.n_firings)),
        mean(&|run| run.way_m),
    )
}
