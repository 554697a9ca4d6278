//! A log cut in two: the second part comes from another robot that was set down nobody knows where.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::Context;
use meetpoint_client::Client;
use meetpoint_geometry::Pose;

use super::super::child::ChildService;
use super::super::poses::poses;
use super::super::relations::{self, Relation};
use super::super::replaying::{replayed, session_of};
use super::settled::{is_accepted, merge_of, settle, verdict};

/// The map of each cut.
const MAP: &str = "bench";
/// The first and the last cut, as shares of the time.
const CUTS: (f64, f64) = (0.25, 0.75);
/// A merge with a larger mean error across the cut put the second part elsewhere, in metres: half a
/// door's width.
const WRONG_M: f64 = 0.5;

/// What became of a cut.
struct Cut {
    verdict: &'static str,
    is_merged: bool,
    /// Relations across the cut, and their mean errors in metres and radians, if it was merged.
    across: Option<(usize, f64, f64)>,
    seconds: f64,
    margin: Option<f64>,
}

/// Prints a row for every cut of every log, and one for all of a log.
pub(super) async fn print(files: &[PathBuf], n_cuts: u32, data: &Path) -> anyhow::Result<()> {
    println!(
        "| log, cut at | verdict | accepted | margin | relations across | mean error | merge and relax |"
    );
    println!("|---|---|---|---|---|---|---|");
    let mut n_wrong = 0;
    for pair in files.chunks_exact(2) {
        let (log, path) = (&pair[0], &pair[1]);
        let text = std::fs::read_to_string(path)
            .with_context(|| format!("cannot read {}", path.display()))?;
        let truth = relations::read(&text).with_context(|| format!("in {}", path.display()))?;
        let name = log.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let mut found = Vec::new();
        for index in 0..n_cuts {
            let step = (CUTS.1 - CUTS.0) / f64::from(n_cuts.saturating_sub(1).max(1));
            let share = CUTS.0 + step * f64::from(index);
            let cut = cut(log, share, &truth, data).await?;
            println!("| {name}, {:.0} % | {} |", 100.0 * share, text_of(&cut));
            found.push(cut);
        }
        n_wrong += found.iter().filter(|cut| is_wrong(cut)).count();
        println!("| {name}, all | {} |", text_of_all(&found));
    }
    anyhow::ensure!(n_wrong == 0, "{n_wrong} merged wrongly");
    Ok(())
}

async fn cut(log: &Path, share: f64, truth: &[Relation], data: &Path) -> anyhow::Result<Cut> {
    let service = ChildService::start(data, "merge")?;
    let client = Client::connect(&service.url)?;
    let at = format!("{share:.4}");
    let first = replayed(log, MAP, &["--robot", "first", "--to", &at], &service.url)?;
    let options = ["--robot", "second", "--from", &at, "--start", "unknown"];
    let second = replayed(log, MAP, &options, &service.url)?;
    let begun = Instant::now();
    settle(&client, MAP).await?;
    let seconds = begun.elapsed().as_secs_f64();
    let (first, second) = (session_of(&first)?, session_of(&second)?);
    let merge = merge_of(&client, MAP, second).await?;
    let is_merged = is_accepted(&merge);
    let across = if is_merged {
        let (first, second) = (poses(&client, first).await?, poses(&client, second).await?);
        Some(across(first, second, truth)?)
    } else {
        None
    };
    let margin = merge.alignments.first().and_then(|alignment| alignment.margin);
    Ok(Cut { verdict: verdict(&merge), is_merged, across, seconds, margin })
}

/// Relations from one part to the other, and their mean errors.
fn across(
    first: BTreeMap<i64, Pose>,
    second: BTreeMap<i64, Pose>,
    truth: &[Relation],
) -> anyhow::Result<(usize, f64, f64)> {
    let cut_ns = *second.keys().next().context("the second part has no pose")?;
    let all: BTreeMap<i64, Pose> = first.into_iter().chain(second).collect();
    let across: Vec<&Relation> = truth.iter().filter(|one| one.leads_across(cut_ns)).collect();
    let off = relations::residuals(&all, &across);
    let errors = relations::errors(&off, across.len());
    Ok(errors.map_or((0, 0.0, 0.0), |errors| (errors.n, errors.translation_m, errors.rotation_rad)))
}

fn is_wrong(cut: &Cut) -> bool {
    cut.is_merged && cut.across.is_some_and(|(_, metres, _)| WRONG_M < metres)
}

fn text_of(cut: &Cut) -> String {
    let Cut { verdict, is_merged, across, seconds, margin } = cut;
    let margin = margin.map_or("no rival".to_owned(), |margin| format!("{margin:.1}"));
    let accepted = if *is_merged { "yes" } else { "no" };
    let (n, error) = match across {
        Some((n @ 1.., metres, radians)) => {
            (n.to_string(), format!("{metres:.4} m, {:.3}°", radians.to_degrees()))
        }
        Some((0, ..)) => ("0".to_owned(), "-".to_owned()),
        None => ("-".to_owned(), "-".to_owned()),
    };
    format!("{verdict} | {accepted} | {margin} | {n} | {error} | {seconds:.1} s")
}

/// All relations of all cuts together, each counted as often as it leads across one.
fn text_of_all(cuts: &[Cut]) -> String {
    let n_merged = cuts.iter().filter(|cut| cut.is_merged).count();
    let n_wrong = cuts.iter().filter(|cut| is_wrong(cut)).count();
    let across: Vec<(usize, f64, f64)> = cuts.iter().filter_map(|cut| cut.across).collect();
    let n: usize = across.iter().map(|(n, ..)| n).sum();
    let mean = |of: &dyn Fn(&(usize, f64, f64)) -> f64| {
        across.iter().map(|one| one.0 as f64 * of(one)).sum::<f64>() / n.max(1) as f64
    };
    let (metres, degrees) = (mean(&|one| one.1), mean(&|one| one.2).to_degrees());
    format!(
        "{n_merged} of {} merged, {n_wrong} wrongly | | | {n} | {metres:.4} m, {degrees:.3}° |",
        cuts.len()
    )
}
