//! A log cut in two: the second part comes from another robot that was set down nobody knows where.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::Context;
use meetpoint_client::Client;
use meetpoint_geometry::Pose;

use super::super::child::ChildService;
use super::super::measurement::measurement;
use super::super::poses::poses;
use super::super::relation_frame::{error_m, offset_m};
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
    /// Relations across the cut, if it was merged.
    across: Option<Across>,
    seconds: f64,
    margin: Option<f64>,
}

/// Relations across a cut, and their mean errors.
#[derive(Default)]
struct Across {
    n: usize,
    translation_m: f64,
    rotation_rad: f64,
    /// The translational one if the relations are of a point of the robot that those say which do not
    /// lead across.
    in_own_frame_m: f64,
    /// The translational one of the same relations in the map of the log that was not cut.
    uncut_m: f64,
}

/// Prints a row for every cut of every log, and one for all of a log.
pub(super) async fn print(files: &[PathBuf], n_cuts: u32, data: &Path) -> anyhow::Result<()> {
    println!(
        "| log, cut at | verdict | accepted | margin | relations across | mean error | in the relations' own frame | not cut | merge and relax |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    let mut n_wrong = 0;
    for pair in files.chunks_exact(2) {
        let (log, path) = (&pair[0], &pair[1]);
        let text = std::fs::read_to_string(path)
            .with_context(|| format!("cannot read {}", path.display()))?;
        let truth = relations::read(&text).with_context(|| format!("in {}", path.display()))?;
        let name = log.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let uncut = measurement(log, &[], data).await?.relaxed;
        let mut found = Vec::new();
        for index in 0..n_cuts {
            let step = (CUTS.1 - CUTS.0) / f64::from(n_cuts.saturating_sub(1).max(1));
            let share = CUTS.0 + step * f64::from(index);
            let cut = cut(log, share, (&truth, &uncut), data).await?;
            println!("| {name}, {:.0} % | {} |", 100.0 * share, text_of(&cut));
            found.push(cut);
        }
        n_wrong += found.iter().filter(|cut| is_wrong(cut)).count();
        println!("| {name}, all | {} |", text_of_all(&found));
    }
    anyhow::ensure!(n_wrong == 0, "{n_wrong} merged wrongly");
    Ok(())
}

/// Cuts a log at a share of its time and compares with relations and with the poses of the log that was not
/// cut.
async fn cut(
    log: &Path,
    share: f64,
    (truth, uncut): (&[Relation], &BTreeMap<i64, Pose>),
    data: &Path,
) -> anyhow::Result<Cut> {
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
        Some(across(first, second, truth, uncut)?)
    } else {
        None
    };
    let margin = merge.alignments.first().and_then(|alignment| alignment.margin);
    Ok(Cut { verdict: verdict(&merge), is_merged, across, seconds, margin })
}

/// Relations from one part to the other.
fn across(
    first: BTreeMap<i64, Pose>,
    second: BTreeMap<i64, Pose>,
    truth: &[Relation],
    uncut: &BTreeMap<i64, Pose>,
) -> anyhow::Result<Across> {
    let cut_ns = *second.keys().next().context("the second part has no pose")?;
    let all: BTreeMap<i64, Pose> = first.into_iter().chain(second).collect();
    let (across, within): (Vec<&Relation>, Vec<&Relation>) =
        truth.iter().partition(|one| one.leads_across(cut_ns));
    let off = relations::residuals(&all, &across);
    let Some(errors) = relations::errors(&off, across.len()) else { return Ok(Across::default()) };
    let uncut = relations::errors(&relations::residuals(uncut, &across), across.len());
    let in_own_frame_m = offset_m(&all, &within).and_then(|off_m| error_m(&all, &across, off_m));
    Ok(Across {
        n: errors.n,
        translation_m: errors.translation_m,
        rotation_rad: errors.rotation_rad,
        in_own_frame_m: in_own_frame_m.unwrap_or(f64::NAN),
        uncut_m: uncut.map_or(f64::NAN, |errors| errors.translation_m),
    })
}

fn is_wrong(cut: &Cut) -> bool {
    cut.is_merged && cut.across.as_ref().is_some_and(|across| WRONG_M < across.translation_m)
}

fn text_of(cut: &Cut) -> String {
    let Cut { verdict, is_merged, across, seconds, margin } = cut;
    let margin = margin.map_or("no rival".to_owned(), |margin| format!("{margin:.1}"));
    let accepted = if *is_merged { "yes" } else { "no" };
    let errors = match across {
        Some(across) if 0 < across.n => text_of_errors(across),
        Some(_) => "0 | - | - | -".to_owned(),
        None => "- | - | - | -".to_owned(),
    };
    format!("{verdict} | {accepted} | {margin} | {errors} | {seconds:.1} s")
}

fn text_of_errors(across: &Across) -> String {
    let Across { n, translation_m, rotation_rad, in_own_frame_m, uncut_m } = across;
    let degrees = rotation_rad.to_degrees();
    format!("{n} | {translation_m:.4} m, {degrees:.3}° | {in_own_frame_m:.4} m | {uncut_m:.4} m")
}

/// All relations of all cuts together, each counted as often as it leads across one.
fn text_of_all(cuts: &[Cut]) -> String {
    let n_merged = cuts.iter().filter(|cut| cut.is_merged).count();
    let n_wrong = cuts.iter().filter(|cut| is_wrong(cut)).count();
    let across: Vec<&Across> = cuts.iter().filter_map(|cut| cut.across.as_ref()).collect();
    let n = across.iter().map(|one| one.n).sum::<usize>();
    let mean = |of: &dyn Fn(&Across) -> f64| {
        across.iter().map(|one| one.n as f64 * of(one)).sum::<f64>() / n.max(1) as f64
    };
    let errors = text_of_errors(&Across {
        n,
        translation_m: mean(&|one| one.translation_m),
        rotation_rad: mean(&|one| one.rotation_rad),
        in_own_frame_m: mean(&|one| one.in_own_frame_m),
        uncut_m: mean(&|one| one.uncut_m),
    });
    format!("{n_merged} of {} merged, {n_wrong} wrongly | | | {errors} |", cuts.len())
}
