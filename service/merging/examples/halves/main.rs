//! Logs cut in two: `halves LOG RELATIONS [N_CUTS] [SHARES...]`. Each part is mapped live by itself, the
//! second from an origin of its own and turned by any angle; then the second is aligned to the first, and
//! held against the relations across the cut. With shares (say `0.1 0.2 0.4 0.6`), stretches of the log
//! are taken as the second part of which that share lies where the first has been. With `IMAGES=FOLDER`
//! previews are drawn. Times are those on a processor.

mod cpu;
mod drive;
mod log;
mod relations;

use std::collections::{BTreeMap, BTreeSet};
use std::error::Error;
use std::f64::consts::PI;
use std::path::Path;
use std::sync::Arc;

use meetpoint_geometry::Pose;
use meetpoint_merging::{AlignmentParams, AlignmentSearch, Alignments, MergeRules, Part, preview};
use meetpoint_occupancy::Reading;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use cpu::cpu_s;
use drive::{Mapped, mapped};
use log::LoggedScan;
use relations::Relations;

/// An alignment is right if the newcomer lies this near to where it does in a map of the whole log.
const RIGHT_M: f64 = 1.0;
/// Stretches that are looked at for one of the share wanted.
const N_STRETCHES_TRIED: usize = 300;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [path, relations, rest @ ..] = arguments.as_slice() else {
        return Err("usage: halves LOG RELATIONS [N_CUTS] [SHARES...]".into());
    };
    let scans = log::read(Path::new(path))?;
    let relations = Relations::read(relations)?;
    let n_cuts: usize = rest.first().map_or(Ok(10), |n| n.parse())?;
    let shares: Vec<f64> = rest.iter().skip(1).map(|s| s.parse()).collect::<Result<_, _>>()?;
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let whole = mapped(&scans, log::laser(&scans), Pose::IDENTITY)?;
    let mut counts = BTreeMap::<String, usize>::new();
    if shares.is_empty() {
        for cut in 1..=n_cuts {
            let middle = scans.len() * cut / (n_cuts + 1);
            let label = format!("cut {:.2}", cut as f64 / (n_cuts + 1) as f64);
            let told = aligned(
                &label,
                &whole,
                (&scans[..middle], &scans[middle..]),
                &relations,
                &mut rng,
            )?;
            *counts.entry(told).or_default() += 1;
        }
    }
    for share in shares {
        for trial in 0..n_cuts {
            let Some((first, second)) = stretches(&whole, &scans, share, &mut rng) else {
                continue;
            };
            let label = format!("share {share} {trial}");
            let told = aligned(&label, &whole, (first, second), &relations, &mut rng)?;
            *counts.entry(format!("{share} {told}")).or_default() += 1;
        }
    }
    println!("{counts:?}");
    Ok(())
}

/// The beginning of a log and a later stretch of it, of which about that share of where the robot looked
/// was looked at in the beginning too.
fn stretches<'a>(
    whole: &Mapped,
    scans: &'a [LoggedScan],
    share: f64,
    rng: &mut ChaCha8Rng,
) -> Option<(&'a [LoggedScan], &'a [LoggedScan])> {
    let laser = log::laser(scans).geometry;
    let seen = |scans: &[LoggedScan]| {
        let mut squares = BTreeSet::new();
        for scan in scans.iter().step_by(5) {
            let pose = whole.poses[&scan.stamp_ns];
            for (bearing_rad, reading) in laser.readings(&scan.ranges_m).step_by(4) {
                let Reading::Hit(range_m) = reading else { continue };
                let (sin, cos) = (pose.theta_rad + bearing_rad).sin_cos();
                for step in 1..=6 {
                    let range_m = range_m.min(8.0) * f64::from(step) / 6.0;
                    let (x, y) = (pose.x_m + range_m * cos, pose.y_m + range_m * sin);
                    #[expect(clippy::cast_possible_truncation, reason = "some metres")]
                    squares.insert(((2.0 * x).floor() as i32, (2.0 * y).floor() as i32));
                }
            }
        }
        squares
    };
    for _ in 0..N_STRETCHES_TRIED {
        let end = rng.random_range(scans.len() / 20..scans.len() / 2);
        let from = rng.random_range(end..scans.len() - scans.len() / 20);
        let to = (from + rng.random_range(scans.len() / 30..scans.len() / 5)).min(scans.len());
        let (first, second) = (&scans[..end], &scans[from..to]);
        let (there, here) = (seen(first), seen(second));
        let both = here.intersection(&there).count() as f64 / here.len().max(1) as f64;
        if (both - share).abs() < 0.03 {
            return Some((first, second));
        }
    }
    None
}

fn aligned(
    label: &str,
    whole: &Mapped,
    (first, second): (&[LoggedScan], &[LoggedScan]),
    relations: &Relations,
    rng: &mut ChaCha8Rng,
) -> Result<String, Box<dyn Error>> {
    let start = Pose::new(0.0, 0.0, rng.random_range(-PI..PI));
    let laser = log::laser(first);
    let site = mapped(first, laser, Pose::IDENTITY)?;
    let newcomer = mapped(second, laser, start)?;
    let (alignments, took_s, slowest_s) = searched(&site, &newcomer);
    println!(
        "{label}: {:?} of {:.0} m way in {took_s:.2} s (slice {slowest_s:.3} s)",
        alignments.verdict, newcomer.way_m
    );
    if let Some(best) = alignments.ranked.first() {
        let placed = newcomer.poses.iter().map(|(&at, &pose)| (at, best.site_from_newcomer * pose));
        let across = relations.across(&site.poses, &placed.collect());
        let (apart_m, apart_rad) = off(whole, &site, &newcomer, best.site_from_newcomer);
        println!(
            "    relations {:.3} m {:.2} deg of {}; from the whole {apart_m:.2} m {:.2} deg",
            across.mean_m,
            across.mean_deg,
            across.n,
            apart_rad.to_degrees(),
        );
        if let Some(pose) = relations.best(&site.poses, &newcomer.poses) {
            let placed = newcomer.poses.iter().map(|(&at, &own)| (at, pose * own));
            let across = relations.across(&site.poses, &placed.collect());
            println!("    no rigid transform has less than about {:.3} m", across.mean_m);
        }
        println!(
            "    odds {:.1} margin {:.1} overlap {:.0} m2 {:.2} agreement {:.2} contradiction {:.3}",
            best.log_odds,
            best.margin.unwrap_or(f64::INFINITY),
            best.overlap_m2,
            best.overlap_share,
            best.agreement,
            best.contradiction,
        );
        if let Ok(folder) = std::env::var("IMAGES") {
            let picture = preview(&site.grid, &newcomer.grid, best.site_from_newcomer, 1000);
            std::fs::write(format!("{folder}/{label}.png"), picture)?;
        }
    }
    for reason in &alignments.reasons {
        println!("    {reason}");
    }
    println!("    {:?}", alignments.figures);
    let is_right = alignments
        .ranked
        .first()
        .is_some_and(|best| off(whole, &site, &newcomer, best.site_from_newcomer).0 < RIGHT_M);
    let is_right = if is_right { "right" } else { "wrong" };
    Ok(format!("{:?} {is_right}", alignments.verdict))
}

fn searched(site: &Mapped, newcomer: &Mapped) -> (Alignments, f64, f64) {
    let params = AlignmentParams::INDOOR;
    let began = cpu_s();
    let parts = [site, newcomer].map(|mapped| Arc::new(Part::of_grid(&mapped.grid, &params)));
    let made_s = cpu_s() - began;
    let [site, newcomer] = parts;
    let mut search = AlignmentSearch::new(site, newcomer, params, MergeRules::INDOOR);
    let mut slowest_s = 0.0_f64;
    let began = cpu_s();
    loop {
        let slice = cpu_s();
        let more = search.advance();
        slowest_s = slowest_s.max(cpu_s() - slice);
        if more.is_none() {
            break;
        }
    }
    let alignments = search.into_alignments();
    print!("[parts {made_s:.2} s] ");
    (alignments, cpu_s() - began, slowest_s)
}

/// Median distance of the newcomer's poses from where they lie in a map of the whole log.
fn off(whole: &Mapped, site: &Mapped, newcomer: &Mapped, pose: Pose) -> (f64, f64) {
    let site_from_whole = site
        .poses
        .iter()
        .next()
        .map_or(Pose::IDENTITY, |(at, &pose)| pose * whole.poses[at].inverse());
    let mut errors: Vec<(f64, f64)> = newcomer
        .poses
        .iter()
        .map(|(at, &own)| {
            let error = (site_from_whole * whole.poses[at]).step_to(pose * own);
            (error.distance_m(), error.theta_rad.abs())
        })
        .collect();
    errors.sort_by(|a, b| a.0.total_cmp(&b.0));
    errors.get(errors.len() / 2).copied().unwrap_or_default()
}
