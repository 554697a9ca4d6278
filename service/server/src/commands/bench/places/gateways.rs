//! Parses plans of buildings into places, has a robot drive to each, and compares gateways with
//! doors.
//!
//! Beside every plan `NAME.png` lies `NAME_gt_segmentation.png`, rooms between drawn lines, as in R.
//! Bormann et al., "Room segmentation: survey, implementation, and analysis", ICRA 2016; files of rooms
//! and of furniture are left out.
//!
//! Each plan is parsed as a whole ("plan"), and from what a robot with a laser knows at each place
//! when it comes there, with poses that are right ("laser") or odometry's ("odometry"). A door is
//! found if the middle of a gateway lies within half a metre of it. A gateway is extra if it lies neither
//! near a door nor near one of the plan's constrictions. A star is right if it is that of the same
//! place of the plan, by the same criterion.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::Context;
use meetpoint_geometry::Point2;
use meetpoint_occupancy::Raster;
use meetpoint_places::{
    GatewayCriterion, LocalGateway, LocalParams, LocalPlace, ParsedMap, parsed_map,
};
use meetpoint_sim::OdometryError;

use super::plan::{doors, plan};
use super::star_picture;
use super::visits::{Visit, visits};

/// A gateway is at a door, or another gateway, up to this distance, in metres.
const AT_DOOR_M: f64 = 0.5;

/// How well gateways were found, of one plan or of all.
#[derive(Clone, Copy, Default)]
struct Score {
    n_places: usize,
    n_gateways: usize,
    n_doors: usize,
    n_found: usize,
    n_extra: usize,
    n_visits: usize,
    n_right: usize,
    time_ms: f64,
}

impl Score {
    fn add(&mut self, other: &Self) {
        self.n_places += other.n_places;
        self.n_gateways += other.n_gateways;
        self.n_doors += other.n_doors;
        self.n_found += other.n_found;
        self.n_extra += other.n_extra;
        self.n_visits += other.n_visits;
        self.n_right += other.n_right;
        self.time_ms += other.time_ms;
    }

    fn print(&self, plan: &str, from: &str, criterion: GatewayCriterion) {
        let Self { n_places, n_gateways, n_doors, n_found, n_extra, .. } = self;
        let Self { n_visits, n_right, time_ms, .. } = self;
        println!(
            "{plan:18} {from:9} {:12} {n_places:7} {n_gateways:8} {n_doors:6} {n_found:6} \
             {n_extra:6} {:>9} {time_ms:8.0}",
            format!("{criterion:?}"),
            format!("{n_right}/{n_visits}"),
        );
    }
}

/// A score, and of what: the plan, what a laser saw, or that at odometry's poses.
type Row = (&'static str, GatewayCriterion, Score);

/// A plan, and what it is judged by.
struct Judged {
    raster: Raster,
    doors: Vec<Vec<Point2<f64>>>,
    /// Centres of its constrictions.
    constrictions: Vec<Point2<f64>>,
}

impl Judged {
    fn score(&self, places: &[LocalPlace]) -> Score {
        let centers = centers(places);
        let is_at = |center: &Point2<f64>, points: &[Point2<f64>]| {
            points.iter().any(|point| (point - center).norm() <= AT_DOOR_M)
        };
        let is_found = |door: &&Vec<Point2<f64>>| centers.iter().any(|center| is_at(center, door));
        let is_extra = |center: &&Point2<f64>| {
            !is_at(center, &self.constrictions)
                && !self.doors.iter().any(|door| is_at(center, door))
        };
        Score {
            n_places: places.iter().filter(|place| place.place.is_some()).count(),
            n_gateways: centers.len(),
            n_doors: self.doors.len(),
            n_found: self.doors.iter().filter(is_found).count(),
            n_extra: centers.iter().filter(is_extra).count(),
            ..Score::default()
        }
    }

    fn save(&self, places: &[LocalPlace], path: &Path) -> anyhow::Result<()> {
        star_picture::save(&self.raster, &self.doors, places, path)
    }
}

fn centers(places: &[LocalPlace]) -> Vec<Point2<f64>> {
    places.iter().flat_map(|local| &local.gateways).map(LocalGateway::center).collect()
}

/// The place of the plan that was visited has the star that was seen there.
fn is_right(parsed: &ParsedMap, visit: &Visit, seen: &LocalPlace) -> bool {
    // The plan's places by this criterion need not be those that were driven to.
    let nearest = parsed.places().map(|(_, place)| place).min_by(|a, b| {
        let away = |place: &LocalPlace| (place.core - visit.core).norm();
        away(a).total_cmp(&away(b))
    });
    let is_alike = |place: &LocalPlace| {
        (0..place.star.n_gateways()).any(|at| place.star.looks_from(at, &seen.star))
    };
    nearest.is_some_and(is_alike)
}

/// Prints a row for each plan, way of looking and criterion; saves pictures.
pub(super) fn print(plans: &[PathBuf], folder: Option<&Path>, drives: bool) -> anyhow::Result<()> {
    anyhow::ensure!(!plans.is_empty(), "no plans are named");
    println!(
        "{:18} {:9} {:12} {:>7} {:>8} {:>6} {:>6} {:>6} {:>9} {:>8}",
        "plan", "from", "criterion", "places", "gateways", "doors", "found", "extra", "stars", "ms"
    );
    let mut sums = vec![];
    for path in plans {
        let name =
            path.file_stem().and_then(|name| name.to_str()).context("a plan without a name")?;
        if name.ends_with("_gt_segmentation") || name.ends_with("_furnitures") {
            continue;
        }
        let scores = examined(path, name, folder, drives)?;
        sums.resize(scores.len(), Score::default());
        for (sum, (from, criterion, score)) in sums.iter_mut().zip(&scores) {
            score.print(name, from, *criterion);
            sum.add(score);
        }
    }
    let ways = ["plan", "laser", "odometry"].into_iter();
    let rows = ways.flat_map(|from| GatewayCriterion::ALL.map(|criterion| (from, criterion)));
    for (sum, (from, criterion)) in sums.iter().zip(rows) {
        sum.print("all", from, criterion);
    }
    Ok(())
}

/// The scores of one plan: as a whole, by a laser at true poses, and at those of odometry.
fn examined(
    path: &Path,
    name: &str,
    folder: Option<&Path>,
    drives: bool,
) -> anyhow::Result<Vec<Row>> {
    let raster = plan(path)?;
    let doors = doors(&raster, &path.with_file_name(format!("{name}_gt_segmentation.png")))?;
    let by = |criterion| LocalParams::INDOOR.by(criterion);
    let plain = parsed_map(&raster, &by(GatewayCriterion::Constriction));
    let constrictions = centers(&plain.neighborhoods);
    let judged = Judged { raster, doors, constrictions };
    let mut scores = vec![];
    let mut parsed_by = vec![];
    for criterion in GatewayCriterion::ALL {
        let start = Instant::now();
        let parsed = parsed_map(&judged.raster, &by(criterion));
        let time_ms = start.elapsed().as_secs_f64() * 1e3;
        let score = Score { time_ms, ..judged.score(&parsed.neighborhoods) };
        scores.push(("plan", criterion, score));
        if let Some(folder) = folder {
            let file = folder.join(format!("{name}_plan_{criterion:?}.png"));
            judged.save(&parsed.neighborhoods, &file)?;
        }
        parsed_by.push(parsed);
    }
    let ways = [("laser", OdometryError::NONE), ("odometry", OdometryError::UNCALIBRATED)];
    for (from, error) in ways.into_iter().filter(|_| drives) {
        let visits = visits(&judged.raster, &plain, error).unwrap_or_default();
        for (criterion, parsed) in GatewayCriterion::ALL.into_iter().zip(&parsed_by) {
            let start = Instant::now();
            let seen: Vec<Option<LocalPlace>> =
                visits.iter().map(|visit| visit.seen(&by(criterion))).collect();
            let time_ms = start.elapsed().as_secs_f64() * 1e3;
            let n_right = visits.iter().zip(&seen).filter(|(visit, seen)| {
                seen.as_ref().is_some_and(|seen| is_right(parsed, visit, seen))
            });
            let (n_visits, n_right) = (visits.len(), n_right.count());
            let places: Vec<LocalPlace> = seen.into_iter().flatten().collect();
            let score = Score { n_visits, n_right, time_ms, ..judged.score(&places) };
            scores.push((from, criterion, score));
            if let Some(folder) = folder {
                judged.save(&places, &folder.join(format!("{name}_{from}_{criterion:?}.png")))?;
            }
        }
    }
    Ok(scores)
}
