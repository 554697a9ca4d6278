//! Relaxation of one laser session: closures, pose graph, and every scan matched against all that was
//! seen near it; a slice at a time.

use std::num::NonZero;

use meetpoint_geometry::{GridFrame, InvalidResolution, Pose};
use meetpoint_occupancy::{Grid, ScanMarks};

use crate::closures::closure::{Closure, ClosureKey, Verdict};
use crate::closures::closure_search::ClosureSearch;
use crate::closures::evidence::Evidence;
use crate::graph::pose_graph::Edge;
use crate::laser_outcome::{LaserFigures, LaserOutcome, LaserProgress, LaserStage};
use crate::relaxation_params::LaserRelaxationParams;
use crate::scans::calibration::{Calibration, calibration};
use crate::scans::chain::{Chain, ScannedStep, odometry_edge, odometry_step, scanned_step};
use crate::scans::key_scan::{KeyScan, key_scans};
use crate::scans::laser_travel::LaserTravel;
use crate::scans::neighbours::{pairs_across, pairs_along};
use crate::scans::placing::{Keys, placed, stands};
use crate::scans::sweep::Sweeps;
use crate::sharpness::Sharpness;
use crate::side_by_side::{in_chunks, side_by_side};

/// A relaxation of one travel, under way. The same travel gives the same bits, on any number of threads.
#[derive(Debug)]
pub struct LaserRelaxation {
    travel: LaserTravel,
    params: LaserRelaxationParams,
    frame: GridFrame,
    refused: Vec<ClosureKey>,
    keys: Vec<KeyScan>,
    chain: Chain,
    calibration: Calibration,
    /// Of the key scans, as far as they are relaxed.
    key_poses: Vec<Pose>,
    /// For each key scan, those on other passes that it is matched with.
    across: Vec<Vec<usize>>,
    closures: Vec<Closure>,
    /// Between the search for closures and the end of the sweeps, what it found.
    search: Option<Box<ClosureSearch>>,
    /// Of the key scans, by live mapping.
    live: Vec<Pose>,
    n_placed: usize,
    /// Of all scans.
    poses: Vec<Pose>,
    before: LaserFigures,
    after: LaserFigures,
    work: Work,
}

/// What is being done.
#[derive(Debug)]
enum Work {
    Before(Drawing),
    Chain(Vec<ScannedStep>),
    ChainSweeps(Sweeps, u32),
    Closures(Box<ClosureSearch>),
    Sweeps(Sweeps, u32),
    Placing,
    After(Drawing),
    Done,
}

/// A map drawn scan by scan.
#[derive(Debug)]
struct Drawing {
    grid: Grid,
    marks: ScanMarks,
    n_done: usize,
}

/// What a slice holds, each some tens of milliseconds: key scans drawn...
const N_DRAWN_SLICE: usize = 150;
/// ...key scans chained...
const N_CHAINED_SLICE: usize = 60;
/// ...pairs matched...
const N_PAIRS_SLICE: usize = 2000;
/// ...scans placed.
const N_PLACED_SLICE: usize = 800;
/// Scans that a thread takes at once: some tenths of a millisecond.
const N_PLACED_AT_ONCE: usize = 16;

impl LaserRelaxation {
    /// Begins a relaxation. `refused` are the closures that an operator switched off.
    ///
    /// # Errors
    /// [`InvalidResolution`] unless that of the parameters is finite and positive.
    pub fn new(
        travel: LaserTravel,
        params: LaserRelaxationParams,
        refused: &[ClosureKey],
    ) -> Result<Self, InvalidResolution> {
        let frame = GridFrame::new(params.resolution_m)?;
        let travel = with_finite_poses(travel);
        let keys = key_scans(&travel, &params.key_scans);
        let poses = travel.scans.iter().map(|scan| scan.map_from_robot).collect();
        let live = keys.iter().map(|key| travel.scans[key.scan].map_from_robot).collect();
        Ok(Self {
            travel,
            params,
            frame,
            refused: refused.to_vec(),
            keys,
            chain: Chain::default(),
            calibration: Calibration::NONE,
            key_poses: live,
            across: Vec::new(),
            closures: Vec::new(),
            search: None,
            live: Vec::new(),
            n_placed: 0,
            poses,
            before: LaserFigures::default(),
            after: LaserFigures::default(),
            work: Work::Before(Drawing::new(frame)),
        })
    }

    /// Lets the slices that follow be shared among so many threads. What they find does not depend on it.
    pub fn use_threads(&mut self, n_threads: NonZero<usize>) {
        self.params.n_threads = n_threads;
    }

    /// Does a slice of the work, some tens of milliseconds, and says what comes next; `None` when all
    /// is done.
    pub fn advance(&mut self) -> Option<LaserProgress> {
        let work = std::mem::replace(&mut self.work, Work::Done);
        self.work = match work {
            Work::Before(mut drawing) => {
                if drawing.draw(&self.travel, &self.keys, &self.key_poses, &self.params) {
                    Work::Before(drawing)
                } else {
                    self.before.sharpness = Sharpness::of_grid(&drawing.grid);
                    if self.keys.len() < 2 {
                        Work::After(Drawing::new(self.frame))
                    } else {
                        Work::Chain(Vec::new())
                    }
                }
            }
            Work::Chain(steps) => self.chain_some(steps),
            Work::ChainSweeps(sweeps, n) => self.sweep_chain(sweeps, n),
            Work::Closures(search) => self.search_some(search),
            Work::Sweeps(sweeps, n) => self.sweep_all(sweeps, n),
            Work::Placing => self.place_some(),
            Work::After(mut drawing) => {
                if drawing.draw(&self.travel, &self.keys, &self.key_poses, &self.params) {
                    Work::After(drawing)
                } else {
                    self.after.sharpness = Sharpness::of_grid(&drawing.grid);
                    Work::Done
                }
            }
            Work::Done => Work::Done,
        };
        self.progress()
    }

    fn chain_some(&mut self, mut steps: Vec<ScannedStep>) -> Work {
        let pair = self.params.pairs();
        let end = (steps.len() + N_CHAINED_SLICE).min(self.keys.len() - 1);
        let step = |to: usize| scanned_step(&self.travel, &self.keys, to, &pair);
        steps.extend(side_by_side(steps.len() + 1..=end, self.params.n_threads, step));
        if end + 1 < self.keys.len() {
            return Work::Chain(steps);
        }
        let odometry = |to: usize| odometry_step(&self.travel, &self.keys, to);
        let both = steps.iter().enumerate();
        let both: Vec<_> =
            both.filter_map(|(from, step)| Some((odometry(from + 1)?, *step))).collect();
        self.calibration = calibration(&both);
        let by_odometry = (&self.calibration, &self.params.odometry);
        self.chain = Chain::new(&self.travel, &self.keys, &steps, by_odometry);
        let pairs = pairs_along(self.keys.len());
        Work::ChainSweeps(Sweeps::new(self.keys.len(), pairs, self.odometry_edges()), 0)
    }

    fn odometry_edges(&self) -> impl Iterator<Item = Edge> {
        let step = |to| Some((to, odometry_step(&self.travel, &self.keys, to)?));
        (1..self.keys.len()).filter_map(step).map(|(to, step)| {
            odometry_edge(self.calibration.applied(step), to, &self.params.odometry)
        })
    }

    fn sweep_chain(&mut self, mut sweeps: Sweeps, n_done: u32) -> Work {
        let pair = self.params.pairs();
        let many = (N_PAIRS_SLICE, self.params.n_threads);
        if sweeps.match_some(&self.keys, &self.chain.poses, &pair, many) {
            return Work::ChainSweeps(sweeps, n_done);
        }
        sweeps.solve(&mut self.chain.poses, &self.params.sweep_graph);
        if n_done + 1 < self.params.n_chain_sweeps {
            return Work::ChainSweeps(sweeps, n_done + 1);
        }
        Work::Closures(Box::new(ClosureSearch::new(self.evidence(), &self.refused)))
    }

    fn evidence(&self) -> Evidence<'_> {
        Evidence {
            travel: &self.travel,
            keys: &self.keys,
            chain: &self.chain,
            params: &self.params,
            frame: self.frame,
        }
    }

    fn search_some(&mut self, mut search: Box<ClosureSearch>) -> Work {
        if search.advance(self.evidence()) {
            return Work::Closures(search);
        }
        let live = std::mem::replace(&mut self.key_poses, search.graph.key_poses(&self.chain));
        let mut pairs = pairs_along(self.keys.len());
        let submap_of = search.graph.submap_of();
        let joined = search.joined();
        let across = pairs_across(
            &self.keys,
            &self.key_poses,
            (&submap_of, &joined),
            &self.params.neighbours,
        );
        self.across = vec![Vec::new(); self.keys.len()];
        for &(a, b) in &across {
            self.across[a].push(b);
            self.across[b].push(a);
        }
        pairs.extend(across);
        let others = search.graph.anchor_edges().into_iter().chain(self.odometry_edges());
        let sweeps = Sweeps::new(self.keys.len(), pairs, others);
        self.live = live;
        self.search = Some(search);
        Work::Sweeps(sweeps, 0)
    }

    fn sweep_all(&mut self, mut sweeps: Sweeps, n_done: u32) -> Work {
        let is_wide = n_done < self.params.n_wide_sweeps;
        let pair = if is_wide { self.params.wide_pairs() } else { self.params.pairs() };
        let many = (N_PAIRS_SLICE, self.params.n_threads);
        if sweeps.match_some(&self.keys, &self.key_poses, &pair, many) {
            return Work::Sweeps(sweeps, n_done);
        }
        let optimised = sweeps.solve(&mut self.key_poses, &self.params.sweep_graph);
        let n_done = n_done + 1;
        if n_done == self.params.n_wide_sweeps {
            let n_closures =
                self.search.as_ref().map_or(0, |search| search.graph.anchor_edges().len());
            let chi2_max = self.params.closures.inconsistent_chi2_min;
            sweeps.leave_out(n_closures, &self.key_poses, chi2_max);
            sweeps.forget();
        }
        let is_settled = self.params.n_wide_sweeps < n_done && optimised.step_last < STEP_MIN;
        if n_done < self.params.n_sweeps_max && !is_settled {
            return Work::Sweeps(sweeps, n_done);
        }
        self.before.chi2 = sweeps.chi2(&self.live);
        self.after.chi2 = sweeps.chi2(&self.key_poses);
        if let Some(search) = self.search.take() {
            self.closures = search.ledger(self.evidence(), &self.key_poses);
        }
        self.n_placed = 0;
        Work::Placing
    }

    fn place_some(&mut self) -> Work {
        let around = Keys { keys: &self.keys, poses: &self.key_poses, across: &self.across };
        let end = (self.n_placed + N_PLACED_SLICE).min(self.travel.scans.len());
        let pair = self.params.pairs();
        let by = (&pair, self.params.key_scans.range_max_m);
        let stood = |scan: usize| 0 < scan && stands(&self.travel, (scan - 1, scan));
        let place = |scan: usize| {
            let moved = !stood(scan);
            moved.then(|| placed(&self.travel, scan, around, &self.calibration, by))
        };
        let found = in_chunks(self.n_placed..end, N_PLACED_AT_ONCE, self.params.n_threads, place);
        for (scan, pose) in (self.n_placed..end).zip(found) {
            self.poses[scan] = pose.unwrap_or_else(|| self.poses[scan - 1]);
        }
        self.n_placed = end;
        if end < self.travel.scans.len() {
            Work::Placing
        } else {
            Work::After(Drawing::new(self.frame))
        }
    }

    fn progress(&self) -> Option<LaserProgress> {
        let of = |part: usize, all: usize| part as f64 / all.max(1) as f64;
        let (stage, share) = match &self.work {
            Work::Before(drawing) => {
                (LaserStage::Before, 0.05 * of(drawing.n_done, self.keys.len()))
            }
            Work::Chain(steps) => {
                (LaserStage::Chain, 0.05 + 0.1 * of(steps.len(), self.keys.len()))
            }
            Work::ChainSweeps(..) => (LaserStage::Chain, 0.15),
            Work::Closures(search) => {
                (LaserStage::Closures, 0.2 + 0.3 * search.share(&self.params.closures))
            }
            Work::Sweeps(_, n) => (
                LaserStage::Sweeps,
                0.5 + 0.25 * of(*n as usize, self.params.n_sweeps_max as usize),
            ),
            Work::Placing => {
                (LaserStage::Placing, 0.75 + 0.2 * of(self.n_placed, self.travel.scans.len()))
            }
            Work::After(drawing) => {
                (LaserStage::After, 0.95 + 0.05 * of(drawing.n_done, self.keys.len()))
            }
            Work::Done => return None,
        };
        let search = match &self.work {
            Work::Closures(search) => Some(search),
            _ => self.search.as_ref(),
        };
        let (n_accepted, n_refused) = search.map_or_else(
            || {
                let n = self.closures.iter().filter(|c| c.verdict == Verdict::Accepted).count();
                (n, self.closures.len() - n)
            },
            |search| search.counts(),
        );
        Some(LaserProgress { share, stage, n_accepted, n_refused })
    }

    /// What was found. Before [`LaserRelaxation::advance`] said that all is done: the poses as far as
    /// they are.
    pub fn into_outcome(self) -> LaserOutcome {
        let pairs = self.poses.iter().zip(&self.travel.scans);
        let moves = pairs.map(|(pose, scan)| pose.step_to(scan.map_from_robot).distance_m());
        LaserOutcome {
            closures: self.closures,
            before: self.before,
            after: self.after,
            calibration: self.calibration,
            move_max_m: moves.fold(0.0, f64::max),
            poses: self.poses,
        }
    }
}

/// Sweeps end when no pose moves farther, in metres and radians.
const STEP_MIN: f64 = 5e-4;

impl Drawing {
    fn new(frame: GridFrame) -> Self {
        Self { grid: Grid::new(frame), marks: ScanMarks::new(), n_done: 0 }
    }

    /// Draws some more key scans. False when all are drawn.
    fn draw(
        &mut self,
        travel: &LaserTravel,
        keys: &[KeyScan],
        poses: &[Pose],
        params: &LaserRelaxationParams,
    ) -> bool {
        let end = (self.n_done + N_DRAWN_SLICE).min(keys.len());
        for (key, &pose) in keys[self.n_done..end].iter().zip(&poses[self.n_done..end]) {
            let scan = &travel.scans[key.scan];
            if let Some(laser) = travel.lasers.get(scan.laser) {
                let pose = pose * laser.robot_from_sensor;
                let model = &params.mapping.beam_model;
                self.grid.insert_scan(
                    pose,
                    &laser.geometry,
                    &scan.ranges_m,
                    model,
                    &mut self.marks,
                );
            }
        }
        self.n_done = end;
        end < keys.len()
    }
}

/// A travel without numbers that are none: a pose that is not finite is that of the scan before, and
/// odometry that is not finite is none.
fn with_finite_poses(mut travel: LaserTravel) -> LaserTravel {
    let mut last = Pose::IDENTITY;
    for scan in &mut travel.scans {
        if scan.map_from_robot.is_finite() {
            last = scan.map_from_robot;
        }
        scan.map_from_robot = last;
        scan.odometry_from_robot = scan.odometry_from_robot.filter(|pose| pose.is_finite());
    }
    travel
}
