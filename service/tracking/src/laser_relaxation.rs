//! Relaxation of laser sessions: closures, pose graph, and every scan matched against all that was seen
//! near it; a slice at a time. Named landmarks that were seen on the way are part of the graph.
//!
//! Several sessions on one map are one graph. No odometry leads from one to the next: closures and the
//! scans matched across them say how they lie to each other, and where nothing was seen twice each stays
//! where it was placed.

mod progress;

use std::num::NonZero;
use std::ops::Range;

use meetpoint_geometry::{GridFrame, InvalidResolution, Pose};

use crate::closures::closure::{Closure, ClosureKey};
use crate::closures::closure_search::ClosureSearch;
use crate::closures::evidence::Evidence;
use crate::drawing::Drawing;
use crate::graph::pose_graph::Edge;
use crate::laser_outcome::{LaserFigures, LaserOutcome, LaserProgress, TravelOutcome};
use crate::relaxation_params::LaserRelaxationParams;
use crate::scans::calibration::{Calibration, calibration};
use crate::scans::chain::{Chain, ScannedStep, odometry_edge, odometry_step, scanned_step};
use crate::scans::key_scan::{KeyScan, key_scans};
use crate::scans::laser_travel::PlacedTravel;
use crate::scans::map_matching::MapMatching;
use crate::scans::neighbours::{pairs_across, pairs_along};
use crate::scans::placing::{Keys, carried, placed, stands};
use crate::scans::sweep::Sweeps;
use crate::scans::travels::Travels;
use crate::sharpness::Sharpness;
use crate::side_by_side::side_by_side;

/// A relaxation of travels on one map, under way. The same travels in the same order give the same bits,
/// on any number of threads.
#[derive(Debug)]
pub struct LaserRelaxation {
    travels: Travels,
    params: LaserRelaxationParams,
    frame: GridFrame,
    refused: Vec<ClosureKey>,
    /// What an earlier relaxation judged, if one is gone on from.
    known: Option<Vec<Closure>>,
    keys: Vec<KeyScan>,
    chain: Chain,
    /// Of each travel.
    calibrations: Vec<Calibration>,
    /// Of the key scans, as far as they are relaxed.
    key_poses: Vec<Pose>,
    /// For each key scan, those on other passes that it is matched with.
    across: Vec<Vec<usize>>,
    closures: Vec<Closure>,
    /// Of each travel, sightings of landmarks that the graph rests on, and that it does not believe.
    n_sightings: Vec<(usize, usize)>,
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
    Before(Drawing, Vec<ScannedStep>),
    ChainSweeps(Sweeps, u32),
    Closures(Box<ClosureSearch>),
    Sweeps(Sweeps, u32),
    /// With the sweeps that came before.
    MapMatching(Box<(MapMatching, Sweeps)>),
    Placing(Drawing),
    After(Drawing),
    Done,
}

/// A part of a slice that a thread may do while others do the others.
enum Part<'a> {
    /// Draws the map of some poses up to a key scan.
    Draw(&'a mut Drawing, &'a [Pose], usize),
    /// Matches a key scan with the one before.
    Chain(usize),
    /// Places some scans.
    Place(Range<usize>),
}

/// What a part found.
enum Parted {
    Drawn,
    Chained(ScannedStep),
    /// `None` for scans at which the robot stood since the one before.
    Placed(Vec<Option<Pose>>),
}

/// What a slice holds, each some tens of milliseconds: key scans drawn and chained...
const N_CHAINED_SLICE: usize = 80;
/// ...pairs matched...
const N_PAIRS_SLICE: usize = 2000;
/// ...scans placed, while as large a share of the key scans is drawn.
const N_PLACED_SLICE: usize = 400;
/// Scans that a thread takes at once: some tenths of a millisecond.
const N_PLACED_AT_ONCE: usize = 16;

impl LaserRelaxation {
    /// Begins a relaxation of travels on one map. The first key scan of the first of them stays where it
    /// is, so that the first should be the one whose place is surest. `refused` are the closures that an
    /// operator switched off.
    ///
    /// # Errors
    /// [`InvalidResolution`] unless that of the parameters is finite and positive.
    pub fn new(
        travels: Vec<PlacedTravel>,
        params: LaserRelaxationParams,
        refused: &[ClosureKey],
    ) -> Result<Self, InvalidResolution> {
        Self::begun(Travels::new(travels, false), &params, refused, None)
    }

    /// Begins one that goes on from an earlier one of the same travels, which have grown since: cheaply,
    /// to be done again and again while robots drive. Closures are looked for where something is new;
    /// what is known bends with the graph, but only what is new is matched once more, and no map is drawn
    /// to be measured. `known` are the closures that the earlier one judged, by the same order of travels.
    /// Less is gone through than `params` ask for: see [`LaserRelaxationParams::in_passing`].
    ///
    /// # Errors
    /// [`InvalidResolution`] unless that of the parameters is finite and positive.
    pub fn going_on(
        travels: Vec<PlacedTravel>,
        params: LaserRelaxationParams,
        refused: &[ClosureKey],
        known: Vec<Closure>,
    ) -> Result<Self, InvalidResolution> {
        Self::begun(Travels::new(travels, true), &params.in_passing(), refused, Some(known))
    }

    fn begun(
        travels: Travels,
        params: &LaserRelaxationParams,
        refused: &[ClosureKey],
        known: Option<Vec<Closure>>,
    ) -> Result<Self, InvalidResolution> {
        let frame = GridFrame::new(params.resolution_m)?;
        let keys = key_scans(&travels, &params.key_scans);
        let scans = &travels.all.scans;
        let poses = scans.iter().map(|scan| scan.map_from_robot).collect();
        let live = keys.iter().map(|key| scans[key.scan].map_from_robot).collect();
        Ok(Self {
            calibrations: vec![Calibration::NONE; travels.len()],
            n_sightings: vec![(0, 0); travels.len()],
            travels,
            params: *params,
            frame,
            refused: refused.to_vec(),
            known,
            keys,
            chain: Chain::default(),
            key_poses: live,
            across: Vec::new(),
            closures: Vec::new(),
            search: None,
            live: Vec::new(),
            n_placed: 0,
            poses,
            before: LaserFigures::default(),
            after: LaserFigures::default(),
            work: Work::Before(Drawing::new(frame), Vec::new()),
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
            Work::Before(drawing, steps) => self.chain_some(drawing, steps),
            Work::ChainSweeps(sweeps, n) => self.sweep_chain(sweeps, n),
            Work::Closures(search) => self.search_some(search),
            Work::Sweeps(sweeps, n) => self.sweep_all(sweeps, n),
            Work::MapMatching(both) => self.match_some_with_map(both),
            Work::Placing(drawing) => self.place_some(drawing),
            Work::After(drawing) => {
                self.after.sharpness = self.measured(&drawing);
                Work::Done
            }
            Work::Done => Work::Done,
        };
        self.progress()
    }

    /// How sharp a map is that was drawn to be measured.
    fn measured(&self, drawing: &Drawing) -> Option<Sharpness> {
        self.known.is_none().then(|| Sharpness::of_grid(&drawing.grid))
    }

    /// Does some parts, on as many threads as there may be; results stand in their order.
    fn parted(&self, parts: Vec<Part<'_>>) -> Vec<Parted> {
        let Self { travels, params, keys, .. } = self;
        let travel = &travels.all;
        let pair = params.pairs();
        let around = Keys { keys, poses: &self.key_poses, across: &self.across };
        let by = (&pair, params.key_scans.range_max_m);
        let place = |scan: usize| {
            if travels.is_known(scan) {
                return Some(carried(travels, scan, around));
            }
            let stood = !travels.begins_at(scan) && stands(travel, (scan - 1, scan));
            (!stood).then(|| placed(travels, scan, around, &self.calibrations, by))
        };
        side_by_side(parts, params.n_threads, |part| match part {
            Part::Draw(drawing, poses, end) => {
                drawing.draw(travel, keys, poses, (&params.mapping.beam_model, end));
                Parted::Drawn
            }
            Part::Chain(to) => Parted::Chained(scanned_step(travel, keys, to, &pair)),
            Part::Place(scans) => Parted::Placed(scans.map(place).collect()),
        })
    }

    /// Draws the map by live poses and matches each key scan with the one before.
    fn chain_some(&mut self, mut drawing: Drawing, mut steps: Vec<ScannedStep>) -> Work {
        let end = (steps.len() + 1 + N_CHAINED_SLICE).min(self.keys.len());
        let mut parts: Vec<Part<'_>> = (steps.len() + 1..end).map(Part::Chain).collect();
        if self.known.is_none() {
            parts.insert(0, Part::Draw(&mut drawing, &self.key_poses, end));
        }
        for done in self.parted(parts) {
            if let Parted::Chained(step) = done {
                steps.push(step);
            }
        }
        if end < self.keys.len() {
            return Work::Before(drawing, steps);
        }
        self.before.sharpness = self.measured(&drawing);
        if self.keys.len() < 2 {
            // Nothing to match: the scans stay where they are, and the map with them.
            return Work::After(drawing);
        }
        self.calibrate(&steps);
        let by_odometry = (self.calibrations.as_slice(), &self.params.odometry);
        self.chain = Chain::new(&self.travels.all, &self.keys, &steps, by_odometry);
        let pairs = pairs_along(&self.keys);
        Work::ChainSweeps(Sweeps::new(&self.keys, pairs, self.way_edges(), Vec::new()), 0)
    }

    /// Finds the scale of each travel's odometry.
    fn calibrate(&mut self, steps: &[ScannedStep]) {
        let odometry = |to: usize| odometry_step(&self.travels.all, &self.keys, to);
        let mut both = vec![Vec::new(); self.travels.len()];
        for (from, step) in steps.iter().enumerate() {
            if let Some(odometry) = odometry(from + 1) {
                both[self.keys[from].travel].push((odometry, *step));
            }
        }
        self.calibrations = both.iter().map(|steps| calibration(steps)).collect();
    }

    /// What is known without looking: odometry from key scan to key scan, and where travels were placed.
    fn way_edges(&self) -> impl Iterator<Item = Edge> {
        let step = |to| Some((to, odometry_step(&self.travels.all, &self.keys, to)?));
        let steps = (1..self.keys.len()).filter_map(step).map(|(to, step)| {
            let calibration = self.calibrations[self.keys[to].travel];
            odometry_edge(calibration.applied(step), to, &self.params.odometry)
        });
        steps.chain(self.travels.start_edges(&self.keys))
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
        let known = self.known.as_deref().unwrap_or_default();
        Work::Closures(Box::new(ClosureSearch::new(self.evidence(), &self.refused, known)))
    }

    fn evidence(&self) -> Evidence<'_> {
        Evidence {
            travels: &self.travels,
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
        let by_graph = search.graph.key_poses(self.evidence());
        let live = std::mem::replace(&mut self.key_poses, by_graph);
        let mut pairs = pairs_along(&self.keys);
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
        let to_landmarks = search.graph.landmark_edges(self.keys.len());
        let seen_again = search.graph.anchor_edges().into_iter().chain(to_landmarks);
        let landmarks = search.graph.landmarks.poses.clone();
        let others = seen_again.chain(self.way_edges());
        let sweeps = Sweeps::new(&self.keys, pairs, others, landmarks);
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
            self.leave_out(&mut sweeps);
            sweeps.forget();
        }
        let is_settled = self.params.n_wide_sweeps < n_done && optimised.step_last < STEP_MIN;
        if n_done < self.params.n_sweeps_max && !is_settled {
            return Work::Sweeps(sweeps, n_done);
        }
        let matching = MapMatching::new(self.frame, self.params.n_map_rounds);
        Work::MapMatching(Box::new((matching, sweeps)))
    }

    fn match_some_with_map(&mut self, mut both: Box<(MapMatching, Sweeps)>) -> Work {
        let (matching, sweeps) = &mut *both;
        let (scans, poses) = ((&self.travels.all, self.keys.as_slice()), &mut self.key_poses);
        if matching.advance(scans, poses, &self.params.mapping, self.params.n_threads) {
            return Work::MapMatching(both);
        }
        self.before.chi2 = sweeps.chi2(&self.live);
        self.after.chi2 = sweeps.chi2(&self.key_poses);
        if let Some(search) = self.search.take() {
            self.closures = search.ledger(self.evidence(), &self.key_poses);
            self.n_sightings = search.n_sightings(self.travels.len());
        }
        self.n_placed = 0;
        Work::Placing(Drawing::new(self.frame))
    }

    /// Leaves out the closures and sightings that the scans contradict.
    fn leave_out(&mut self, sweeps: &mut Sweeps) {
        let Some(search) = &mut self.search else { return };
        let n_closures = search.graph.anchor_edges().len();
        let n_seen_again = n_closures + search.graph.landmarks.believed().len();
        let chi2_max = self.params.closures.inconsistent_chi2_min;
        let kept = sweeps.leave_out(n_seen_again, &self.key_poses, chi2_max);
        search.graph.landmarks.keep(&kept[n_closures..]);
    }

    /// Places some scans and draws the map by the relaxed poses.
    fn place_some(&mut self, mut drawing: Drawing) -> Work {
        let (n_scans, from) = (self.travels.all.scans.len(), self.n_placed);
        let end = (from + N_PLACED_SLICE).min(n_scans);
        let n_drawn = (self.keys.len() * end).div_ceil(n_scans.max(1));
        let mut parts = Vec::new();
        if self.known.is_none() {
            parts.push(Part::Draw(&mut drawing, &self.key_poses, n_drawn));
        }
        let chunks = (from..end).step_by(N_PLACED_AT_ONCE);
        parts.extend(chunks.map(|first| Part::Place(first..end.min(first + N_PLACED_AT_ONCE))));
        for done in self.parted(parts) {
            let Parted::Placed(poses) = done else { continue };
            for pose in poses {
                self.poses[self.n_placed] = pose.unwrap_or_else(|| self.poses[self.n_placed - 1]);
                self.n_placed += 1;
            }
        }
        if end < n_scans { Work::Placing(drawing) } else { Work::After(drawing) }
    }

    /// What was found. Before [`LaserRelaxation::advance`] said that all is done: the poses as far as
    /// they are.
    pub fn into_outcome(self) -> LaserOutcome {
        let of_travel = |(travel, &calibration): (usize, &Calibration)| {
            let scans = self.travels.scans(travel);
            let poses = self.poses[scans.clone()].to_vec();
            let pairs = poses.iter().zip(&self.travels.all.scans[scans]);
            let moves = pairs.map(|(pose, scan)| pose.step_to(scan.map_from_robot).distance_m());
            let move_max_m = moves.fold(0.0, f64::max);
            let (n_sightings_in_graph, n_sightings_doubted) = self.n_sightings[travel];
            TravelOutcome {
                poses,
                move_max_m,
                calibration,
                n_sightings_in_graph,
                n_sightings_doubted,
            }
        };
        LaserOutcome {
            travels: self.calibrations.iter().enumerate().map(of_travel).collect(),
            closures: self.closures,
            before: self.before,
            after: self.after,
        }
    }
}

/// Sweeps end when no pose moves farther, in metres and radians.
const STEP_MIN: f64 = 5e-4;
