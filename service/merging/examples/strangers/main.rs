//! Maps that must not be merged, and how often those are that must: `strangers KIND [N_TRIALS] [LOG...]`.
//!
//! * `architect`: two buildings of one architect, rooms of three widths along corridors that are alike
//! * `wings`: one building with two wings alike; the site has seen both, the newcomer one
//! * `offices`: forty offices alike along a corridor, each robot in some of them
//! * `logs`: stretches of the logs given, each against stretches of the next
//! * `overlap`: one building, the newcomer's rooms in the site's by 10, 20, 40 and 60 %
//!
//! What is merged more than a metre from the truth, or where there is none, is `FALSE`.

mod cpu;
mod drive;
mod log;
mod plan;
mod trial;

use std::collections::BTreeMap;
use std::error::Error;
use std::f64::consts::PI;
use std::path::Path;

use meetpoint_geometry::Pose;
use meetpoint_merging::{Verdict, preview};
use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use plan::{Plan, way};
use trial::{Driven, aligned, driven, error, told};

/// What is merged farther from the truth than this is merged wrongly, in metres.
const FALSE_M: f64 = 1.0;
/// Squares of a wing: 50 m.
const LENGTH: usize = 200;
/// Squares across a wing.
const ACROSS: usize = 50;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [kind, rest @ ..] = arguments.as_slice() else {
        return Err("usage: strangers KIND [N_TRIALS] [LOG...]".into());
    };
    let n_trials: u64 = rest.first().map_or(Ok(10), |n| n.parse())?;
    if kind == "logs" {
        return logs(n_trials, rest.get(1..).unwrap_or_default());
    }
    let mut counts = BTreeMap::<String, usize>::new();
    for seed in 1..=n_trials {
        let trials = match kind.as_str() {
            "architect" => vec![architect(seed)?],
            "wings" => vec![wings(seed)?],
            "offices" => vec![offices(seed)?],
            "overlap" => overlaps(seed)?,
            other => return Err(format!("no trials `{other}`").into()),
        };
        for Trial { name, site, newcomer, is_true } in trials {
            let (alignments, took_s) = aligned(&site.grid, &newcomer.grid);
            let off = error(&alignments, &newcomer).filter(|_| is_true);
            let is_right = off.is_some_and(|(off_m, _)| off_m < FALSE_M);
            let is_false = alignments.verdict == Verdict::Merged && !is_right;
            println!(
                "{name} {seed}: {:.0} m and {:.0} m driven, {took_s:.2} s, off {off:.2?}; {}{}",
                site.way_m,
                newcomer.way_m,
                if is_false { "FALSE " } else { "" },
                told(&alignments),
            );
            draw(&format!("{name}-{seed}"), (&site, &newcomer), &alignments)?;
            let right = if is_right { "right" } else { "wrong" };
            *counts.entry(format!("{name} {:?} {right}", alignments.verdict)).or_default() += 1;
        }
    }
    for (told, n) in counts {
        println!("{n:4} {told}");
    }
    Ok(())
}

/// Two drives; whether they were in one building.
struct Trial {
    name: String,
    site: Driven,
    newcomer: Driven,
    is_true: bool,
}

fn draw(
    name: &str,
    (site, newcomer): (&Driven, &Driven),
    alignments: &meetpoint_merging::Alignments,
) -> Result<(), Box<dyn Error>> {
    let Ok(folder) = std::env::var("IMAGES") else { return Ok(()) };
    let pose = alignments.ranked.first().map_or(Pose::IDENTITY, |best| best.site_from_newcomer);
    std::fs::write(
        format!("{folder}/{name}.png"),
        preview(&site.grid, &newcomer.grid, pose, 1000),
    )?;
    Ok(())
}

fn turned(rng: &mut ChaCha8Rng) -> Pose {
    Pose::new(0.0, 0.0, rng.random_range(-PI..PI))
}

/// A building of one wing.
fn building(width: Option<usize>, rng: &mut ChaCha8Rng) -> Plan {
    let mut plan = Plan::solid(LENGTH + 2, ACROSS + 2);
    plan.wing((1, 1), (LENGTH, false), width, rng);
    plan
}

/// Rooms between two shares of a wing's length, in the order of the corridor.
fn rooms_between(plan: &Plan, from: f64, to: f64) -> Vec<usize> {
    let length_m = LENGTH as f64 * plan::SQUARE_M;
    let along = |room: usize| plan.rooms[room].before.x;
    let mut rooms: Vec<usize> = (0..plan.rooms.len())
        .filter(|&room| (from * length_m..to * length_m).contains(&along(room)))
        .collect();
    rooms.sort_by(|&a, &b| along(a).total_cmp(&along(b)));
    rooms
}

fn architect(seed: u64) -> Result<Trial, Box<dyn Error>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let plans = [building(None, &mut rng), building(None, &mut rng)];
    let rooms = plans.each_ref().map(|plan| rooms_between(plan, 0.0, rng.random_range(0.4..1.0)));
    let site = driven(&plans[0], &way(&plans[0], &rooms[0]), None, seed)?;
    let start = turned(&mut rng);
    let newcomer = driven(&plans[1], &way(&plans[1], &rooms[1]), Some(start), seed + 1000)?;
    Ok(Trial { name: "architect".into(), site, newcomer, is_true: false })
}

fn wings(seed: u64) -> Result<Trial, Box<dyn Error>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let hall = 26;
    let mut plan = Plan::solid(2 * ACROSS + 20, LENGTH / 2 + hall);
    plan.carve([1, 1, 2 * ACROSS + 18, hall - 6]);
    let alike = rng.clone();
    let corners = [(1, hall), (ACROSS + 12, hall)];
    for corner in corners {
        plan.wing(corner, (LENGTH / 2 - 2, true), None, &mut alike.clone());
        plan.carve([corner.0 + 21, hall - 6, corner.0 + 29, hall]);
    }
    let n = plan.rooms.len() / 2;
    let all: Vec<usize> = (0..2 * n).collect();
    let site = driven(&plan, &way(&plan, &all), None, seed)?;
    let wing = if rng.random_bool(0.5) { 0..n } else { n..2 * n };
    let rooms: Vec<usize> = wing.collect();
    let start = turned(&mut rng);
    let newcomer = driven(&plan, &way(&plan, &rooms), Some(start), seed + 1000)?;
    Ok(Trial { name: "wings".into(), site, newcomer, is_true: true })
}

fn offices(seed: u64) -> Result<Trial, Box<dyn Error>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut plan = Plan::solid(20 * 24 + 2, ACROSS + 2);
    let mut alike = rng.clone();
    plan.wing((1, 1), (20 * 24, false), Some(24), &mut alike);
    let some = |rng: &mut ChaCha8Rng| {
        let first = rng.random_range(0..12_usize);
        let last = rng.random_range(first + 4..=19);
        let rooms: Vec<usize> = (first..=last).flat_map(|room| [room, room + 20]).collect();
        let mut rooms: Vec<usize> = rooms.into_iter().filter(|_| rng.random_bool(0.7)).collect();
        rooms.dedup();
        rooms
    };
    let (mine, yours) = (some(&mut rng), some(&mut rng));
    let site = driven(&plan, &way(&plan, &mine), None, seed)?;
    let start = turned(&mut rng);
    let newcomer = driven(&plan, &way(&plan, &yours), Some(start), seed + 1000)?;
    Ok(Trial { name: "offices".into(), site, newcomer, is_true: true })
}

fn overlaps(seed: u64) -> Result<Vec<Trial>, Box<dyn Error>> {
    let mut trials = Vec::new();
    for share in [0.1, 0.2, 0.4, 0.6] {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let plan = building(None, &mut rng);
        // Of the newcomer's stretch, as long as the site's, the share lies in the site's.
        let length = 1.0 / (2.0 - share);
        let mine = rooms_between(&plan, 0.0, length);
        let yours = rooms_between(&plan, 1.0 - length, 1.0);
        let site = driven(&plan, &way(&plan, &mine), None, seed)?;
        let mut later = plan.clone();
        later.another_day(&yours, &mut rng);
        let start = turned(&mut rng);
        let newcomer = driven(&later, &way(&later, &yours), Some(start), seed + 1000)?;
        trials.push(Trial { name: format!("overlap {share}"), site, newcomer, is_true: true });
    }
    Ok(trials)
}

/// Stretches of logs, none of which overlaps another's.
fn logs(n_trials: u64, paths: &[String]) -> Result<(), Box<dyn Error>> {
    let logs: Vec<_> =
        paths.iter().map(|path| log::read(Path::new(path))).collect::<Result<_, _>>()?;
    let mut counts = BTreeMap::<String, usize>::new();
    for seed in 1..=n_trials {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let indices: Vec<usize> = (0..logs.len()).collect();
        let pair: Vec<usize> = indices.sample(&mut rng, 2).copied().collect();
        let mut grids = Vec::new();
        for &index in &pair {
            let log = &logs[index];
            let from = rng.random_range(0..log.len() / 2);
            let to = rng.random_range(from + log.len() / 4..log.len());
            let start = turned(&mut rng);
            grids.push(drive::mapped(&log[from..to], log::laser(log), start)?);
        }
        let (alignments, took_s) = aligned(&grids[0].grid, &grids[1].grid);
        let is_false = alignments.verdict == Verdict::Merged;
        println!(
            "logs {seed} {pair:?}: {:.0} m and {:.0} m driven, {} poses, {took_s:.2} s; {}{}",
            grids[0].way_m,
            grids[1].way_m,
            grids[1].poses.len(),
            if is_false { "FALSE " } else { "" },
            told(&alignments)
        );
        *counts.entry(format!("{:?}", alignments.verdict)).or_default() += 1;
    }
    println!("{counts:?}");
    Ok(())
}
