//! Relaxation of one laser session: closures, pose graph, and every scan matched against all that was
//! seen near it; a slice at a time.

use meetpoint_geometry::{GridFrame, InvalidResolution, Pose};
use meetpoint_occupancy::{Grid, ScanMarks};

use crate::closure::{Closure, ClosureKey};
use crate::key_scan::{KeyScan, key_scans};
use crate::normal_equations::NormalEquations;
use crate::pose_graph::{Edge, PoseGraphParams, optimise};
use crate::scan_pair::PairParams;
use crate::sweep::pair_edges;
use crate::laser_travel::LaserTravel;
use crate::relaxation_params::LaserRelaxationParams;
use crate::sharpness::Sharpness;

/// What a relaxation is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LaserStage {
    /// Drawing the map by the live poses, to measure it.
    Before,
    /// Matching each key scan with those just before it.
    Chain,
    /// Looking for closures.
    Closures,
    /// Matching each key scan with all that were taken near it.
    Sweeps,
    /// Placing the scans between key scans.
    Placing,
    /// Drawing the map by the relaxed poses, to measure it.
    After,
}

/// How far a relaxation is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LaserProgress {
    /// Share of the work that is done, in 0..=1.
    pub share: f64,
    /// What is done next.
    pub stage: LaserStage,
    /// Closures accepted so far.
    pub n_accepted: usize,
    /// Closures refused so far.
    pub n_refused: usize,
}

/// What is told of a map.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LaserFigures {
    /// Entropy of the grid that the poses draw.
    pub sharpness: Sharpness,
    /// Sum over all constraints of the last pose graph of the square of their residuals in units of
    /// their covariance, at these poses.
    pub chi2: f64,
}

/// What a relaxation found.
#[derive(Clone, Debug, PartialEq)]
pub struct LaserOutcome {
    /// Pose of the robot at each scan of the travel: `map_from_robot`. The first key scan stays where
    /// live mapping had it.
    pub poses: Vec<Pose>,
    /// Every closure that was considered, accepted or not, by key.
    pub closures: Vec<Closure>,
    /// The map by live poses.
    pub before: LaserFigures,
    /// The map by the relaxed ones.
    pub after: LaserFigures,
    /// The farthest that a pose moved, in metres.
    pub move_max_m: f64,
}

/// A relaxation of one travel, under way. The same calls give the same bits.
#[derive(Debug)]
pub struct LaserRelaxation {
    travel: LaserTravel,
    params: LaserRelaxationParams,
    before: Drawing,
    after: Drawing,
    keys: Vec<KeyScan>,
    key_poses: Vec<Pose>,
    near: Vec<Vec<usize>>,
    poses: Vec<Pose>,
    n_sweeps: u32,
    stage: Option<LaserStage>,
}

/// A map drawn scan by scan.
#[derive(Debug)]
struct Drawing {
    grid: Grid,
    marks: ScanMarks,
    n_done: usize,
}

/// Scans drawn in one slice.
const N_SCANS_SLICE: usize = 500;

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
        let _ = refused;
        let frame = GridFrame::new(params.resolution_m)?;
        let drawing = || Drawing { grid: Grid::new(frame), marks: ScanMarks::new(), n_done: 0 };
        let keys = key_scans(&travel, &params.key_scans);
        let key_poses: Vec<Pose> = keys.iter().map(|k| travel.scans[k.scan].map_from_robot).collect();
        let poses = travel.scans.iter().map(|s| s.map_from_robot).collect();
        let before = drawing();
        let after = drawing();
        Ok(Self {
            travel,
            params,
            before,
            after,
            keys,
            key_poses,
            near: Vec::new(),
            poses,
            n_sweeps: 0,
            stage: Some(LaserStage::Before),
        })
    }

    fn draw(&mut self, is_before: bool) -> bool {
        let drawing = if is_before { &mut self.before } else { &mut self.after };
        let end = (drawing.n_done + N_SCANS_SLICE).min(self.travel.scans.len());
        for index in drawing.n_done..end {
            let scan = &self.travel.scans[index];
            let pose = if is_before { scan.map_from_robot } else { self.poses[index] };
            if let Some(laser) = self.travel.lasers.get(scan.laser) {
                let pose = pose * laser.robot_from_sensor;
                let model = &self.params.mapping.beam_model;
                drawing.grid.insert_scan(pose, &laser.geometry, &scan.ranges_m, model, &mut drawing.marks);
            }
        }
        drawing.n_done = end;
        end == self.travel.scans.len()
    }

    fn sweep(&mut self) {
        let n = self.keys.len();
        let mut near: Vec<Vec<usize>> = vec![Vec::new(); n];
        let mut pairs = Vec::new();
        let env = |name: &str, default: f64| std::env::var(name).ok().and_then(|v| v.parse().ok()).unwrap_or(default);
        let n_loop = env("NLOOP", 6.0) as usize;
        for i in 0..n {
            for d in [1, 2, 4, 8] {
                if i + d < n {
                    pairs.push((i, i + d));
                    near[i].push(i + d);
                    near[i + d].push(i);
                }
            }
            // best of each pass
            let mut found: Vec<(f64, usize)> = Vec::new();
            let mut last: Option<usize> = None;
            for j in 0..i.saturating_sub(20) {
                let step = self.key_poses[i].step_to(self.key_poses[j]);
                let d = step.distance_m();
                if d > env("RADIUS", 3.0) { continue; }
                let rank = d + step.theta_rad.abs();
                if last.is_some_and(|l| j - l < 10) {
                    let best = found.last_mut().unwrap();
                    if rank < best.0 { *best = (rank, j); }
                } else {
                    found.push((rank, j));
                }
                last = Some(j);
            }
            found.sort_by(|a, b| a.0.total_cmp(&b.0));
            for &(_, j) in found.iter().take(n_loop) {
                pairs.push((j, i));
                near[i].push(j);
                near[j].push(i);
            }
        }
        let pair_params = PairParams {
            gate_m: if self.n_sweeps < 3 { 0.2 } else { env("GATE", 0.1) },
            turn_m: if self.n_sweeps < 3 { 0.1 } else { env("TURN", 0.05) },
            facet_std_m: 0.05,
        };
        let mut edges: Vec<Edge> = Vec::new();
        for &pair in &pairs {
            edges.extend(pair_edges(&self.keys, &self.key_poses, pair, &pair_params, 90));
        }
        for i in 1..n {
            let (a, b) = (&self.travel.scans[self.keys[i - 1].scan], &self.travel.scans[self.keys[i].scan]);
            if let (Some(oa), Some(ob)) = (a.odometry_from_robot, b.odometry_from_robot) {
                let z = oa.step_to(ob);
                let st = 0.02 + 0.05 * z.distance_m();
                let sr = 0.02 + 0.1 * z.theta_rad.abs();
                let information = nalgebra::Matrix3::from_diagonal(&nalgebra::Vector3::new(1.0 / (st * st), 1.0 / (st * st), 1.0 / (sr * sr)));
                edges.push(Edge { from: i - 1, to: i, from_to: z, information, chi2_turn: 9.0 });
            }
        }
        let t = std::time::Instant::now();
        let mut equations = NormalEquations::new(n, &edges);
        let t1 = t.elapsed();
        let o = optimise(&mut self.key_poses, &edges, &mut equations, &PoseGraphParams { n_iterations_max: 5, fall_min: 1e-3 });
        eprintln!("sweep {} keys {n} pairs {} {o:?} symbolic {t1:?} all {:?}", self.n_sweeps, pairs.len(), t.elapsed());
        self.near = near;
        self.n_sweeps += 1;
    }

    fn place(&mut self) {
        let env = |name: &str, default: f64| std::env::var(name).ok().and_then(|v| v.parse().ok()).unwrap_or(default);
        let n = self.keys.len();
        let scans = &self.travel.scans;
        for s in 0..scans.len() {
            let after = self.keys.partition_point(|k| k.scan <= s);
            let (a, b) = (after.saturating_sub(1), after.min(n - 1));
            let live = |k: usize| scans[self.keys[k].scan].map_from_robot;
            let from_a = self.key_poses[a] * live(a).step_to(scans[s].map_from_robot);
            let from_b = self.key_poses[b] * live(b).step_to(scans[s].map_from_robot);
            let (ka, kb) = (self.keys[a].scan, self.keys[b].scan);
            let t = if ka == kb { 0.0 } else { (s as f64 - ka as f64) / (kb as f64 - ka as f64) };
            let mut pose = from_a.interpolate(from_b, t.clamp(0.0, 1.0));
            if self.keys[a].scan != s && env("PLACE", 1.0) > 0.0 {
                let prior = pose;
                let mut near: Vec<usize> = vec![a, b];
                near.extend(&self.near[a]);
                near.extend(&self.near[b]);
                near.sort_unstable();
                near.dedup();
                let Some(surface) = crate::key_scan::surface(&self.travel, &scans[s], 40.0) else { continue };
                let params = PairParams { gate_m: env("GATE", 0.1), turn_m: env("TURN", 0.05), facet_std_m: 0.05 };
                for _ in 0..3 {
                    let ps = env("PRIOR_M", 0.01);
                    let pr = env("PRIOR_RAD", 0.005);
                    let mut h = nalgebra::Matrix3::from_diagonal(&nalgebra::Vector3::new(1.0 / (ps * ps), 1.0 / (ps * ps), 1.0 / (pr * pr)));
                    let d = nalgebra::Vector3::new(pose.x_m - prior.x_m, pose.y_m - prior.y_m, meetpoint_geometry::angle_between(prior.theta_rad, pose.theta_rad));
                    let mut g = h * d;
                    for &k in &near {
                        let key = &self.keys[k];
                        let seen = self.key_poses[k].step_to(pose);
                        let form = crate::scan_pair::pair_form(&key.surface, &surface, seen, &params, surface.facets().len().div_ceil(90).max(1));
                        if form.n_met < 12 || form.met_share() < 0.15 { continue; }
                        let (sin, cos) = self.key_poses[k].theta_rad.sin_cos();
                        let r = nalgebra::Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
                        h += r * form.hessian * r.transpose();
                        g += r * form.gradient;
                    }
                    if let Some(c) = h.cholesky() { let step = -c.solve(&g); pose = crate::scan_pair::moved(pose, step); }
                }
            }
            self.poses[s] = pose;
        }
    }

    /// Does a slice of the work, some tens of milliseconds, and says what comes next; `None` when all
    /// is done.
    pub fn advance(&mut self) -> Option<LaserProgress> {
        match self.stage? {
            LaserStage::Before => if self.draw(true) { self.stage = Some(LaserStage::Sweeps) },
            LaserStage::Sweeps => { self.sweep(); let m = std::env::var("SWEEPS").ok().and_then(|v| v.parse().ok()).unwrap_or(8); if self.n_sweeps >= m { self.stage = Some(LaserStage::Placing) } },
            LaserStage::Placing => { self.place(); self.stage = Some(LaserStage::After) },
            _ => if self.draw(false) { self.stage = None },
        }
        let stage = self.stage?;
        Some(LaserProgress { share: 0.5, stage, n_accepted: 0, n_refused: 0 })
    }

    /// What was found. Before [`LaserRelaxation::advance`] said that all is done: the poses as far as
    /// they are.
    pub fn into_outcome(self) -> LaserOutcome {
        let figures =
            |drawing: &Drawing| LaserFigures { sharpness: Sharpness::of_grid(&drawing.grid), chi2: 0.0 };
        LaserOutcome {
            closures: Vec::new(),
            before: figures(&self.before),
            after: figures(&self.after),
            move_max_m: self.poses.iter().zip(&self.travel.scans).map(|(p, s)| p.step_to(s.map_from_robot).distance_m()).fold(0.0, f64::max),
            poses: self.poses,
        }
    }
}
