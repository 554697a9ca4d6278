use std::num::NonZero;
use std::time::Instant;
use meetpoint_relaxation::*;
use meetpoint_geometry::{Point2, Pose};
use meetpoint_sim::{first_data_set, benchmark_travel, BenchmarkKind, LandmarkTravel};

fn travel(sim: &LandmarkTravel) -> (Travel, Vec<Pose>) {
    let mut steps = vec![];
    let mut truth = vec![];
    let mut legs = vec![];
    let mut length = 0.0;
    let mut before: Option<Pose> = None;
    let mut leg_from: Option<Pose> = None;
    for (i, m) in sim.moments.iter().enumerate() {
        if let Some(b) = before { length += b.step_to(m.odometry).distance_m(); }
        let from = *leg_from.get_or_insert(m.odometry);
        let leg = from.step_to(m.odometry);
        let due = i == 0 || !m.sightings.is_empty() || length >= 20.0;
        if leg.distance_m() >= 0.5 || leg.theta_rad.abs() > 0.1 || due { if i > 0 { legs.push(leg); } leg_from = Some(m.odometry); }
        if due {
            let motion = Motion::new(std::mem::take(&mut legs));
            steps.push(Step { motion, sightings: m.sightings.iter().map(|s| Sighting { identity: None, landmark_type: s.landmark_type, range_m: s.range_m, bearing_rad: s.bearing_rad }).collect() });
            truth.push(m.truth);
            length = 0.0;
        }
        before = Some(m.odometry);
    }
    let origin = truth[0].inverse();
    (Travel { detector: Detector { range_max_m: 0.0, half_field_of_view_rad: std::f64::consts::PI }, steps }, truth.iter().map(|t| origin * *t).collect())
}

fn main() {
    let a = |i: usize, d: f64| std::env::args().nth(i).and_then(|s| s.parse::<f64>().ok()).unwrap_or(d);
    let which = a(1, 0.0);
    let seed = a(2, 0.0) as u64;
    let sim = if which == 0.0 { first_data_set(seed) } else if which == 1.0 { benchmark_travel(BenchmarkKind::RandomError, seed) } else { benchmark_travel(BenchmarkKind::SteadyDrift, seed) };
    let (travel, truth) = travel(&sim);
    println!("{} controls, {} steps, off {:.1}", sim.n_controls(), travel.steps.len(), sim.final_error_m());
    let motion = MotionParams { rotation_per_m: a(3, 0.01), rotation_per_rad: a(4, 0.1), translation_per_m: a(5, 0.06), ..MotionParams::CARPET };
    let perception = PerceptionParams { radius_m: a(6, 3.0), false_per_m2: a(7, 0.002), ..PerceptionParams::BUTTON };
    let chosen = grid_for(&travel, &Calibration::NONE, &motion, &perception).unwrap();
    println!("chosen {chosen:?}");
    let t: Vec<_> = truth.iter().map(|p| p.position()).collect();
    let (x0, x1) = (t.iter().map(|p| p.x).fold(1e9, f64::min), t.iter().map(|p| p.x).fold(-1e9, f64::max));
    let (y0, y1) = (t.iter().map(|p| p.y).fold(1e9, f64::min), t.iter().map(|p| p.y).fold(-1e9, f64::max));
    let (cx, cy) = ((x0 + x1) / 2.0, (y0 + y1) / 2.0);
    let grid = if a(8, 0.0) == 0.0 { PoseGrid::new(Area { min: Point2::new(cx - 44.9, cy - 44.9), max: Point2::new(cx + 44.4, cy + 44.4) }, 1.0, 72).unwrap() } else { chosen };
    let params = EmParams { grid, n_coarse_iterations: a(9, 0.0) as u32, coarse_factor: 2, motion, calibration: Calibration::NONE, perception, map: MapParams { n_even_iterations: a(10, 6.0) as u32, n_seen_nothing: 0.1 }, start: StartBelief::At(Pose::IDENTITY), selection_share: 1e-3, change_max: 1e-4, n_iterations_max: 12, n_threads: NonZero::new(a(11, 2.0) as usize).unwrap() };
    let s = Instant::now();
    let mut em = Em::new(&travel, params, Start::Controls);
    println!("new {:.3} s", s.elapsed().as_secs_f64());
    while !em.has_converged() {
        let s = Instant::now();
        let f = em.iterate();
        let d = s.elapsed().as_secs_f64();
        let path = em.path();
        let e = path.map(|p| { let mut e: Vec<f64> = p.poses.iter().zip(&truth).map(|(p, t)| (p.position() - t.position()).norm()).collect(); e.sort_by(f64::total_cmp); (e[e.len() / 2], e[e.len() - 1]) });
        println!("{d:.3} s {f:?} path median/max {e:.2?} map {:.1}", em.map().unwrap().probabilities().iter().sum::<f32>());
    }
}
