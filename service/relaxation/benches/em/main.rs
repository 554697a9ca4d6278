//! What EM on a grid costs: the first data set of Thrun, Burgard and Fox in kind, by iteration, and
//! how time grows with steps and with cells times kernel, and what each economy of section 5 brings.
//!
//! ```text
//! cargo bench -p meetpoint-relaxation --bench em -- [SEED]
//! ```

mod travel;

use std::num::NonZero;
use std::time::Instant;

use meetpoint_geometry::{Point2, Pose};
use meetpoint_relaxation::{
    Area, Em, EmParams, Figures, LandmarkMap, PeakParams, PoseGrid, Start, Travel,
};
use meetpoint_sim::{LandmarkTravel, first_data_set};

/// "A step per landmark or every 20 m."
const STEP_M: f64 = 20.0;

fn main() {
    let seed = std::env::args().find_map(|word| word.parse().ok()).unwrap_or(0);
    let simulated = first_data_set(seed);
    let (travel, truth) = travel::cut(&simulated, STEP_M);
    println!(
        "first data set, seed {seed}: {} controls, {:.0} m, {} steps, {} sightings of {} landmarks, \
         dead reckoning {:.1} m off\n90 by 90 m, 1 m, 5 degrees, two threads\n",
        simulated.n_controls(),
        simulated.length_m(),
        travel.steps.len(),
        travel.n_sightings(),
        simulated.landmarks.len(),
        simulated.final_error_m(),
    );
    let params = &EmParams {
        n_threads: NonZero::new(2).expect("not zero"),
        ..EmParams::button(grid_around(&truth, 1.0, 72))
    };
    by_iteration(&travel, &truth, params, simulated.landmarks.len());
    growth_with_steps(&simulated, params);
    growth_with_cells(&travel, &truth, params);
    economies(&simulated, &truth, params);
}

/// The paper's area, about the true path.
fn grid_around(truth: &[Pose], resolution_m: f64, n_headings: u32) -> PoseGrid {
    let middle = |values: &dyn Fn(&Pose) -> f64| {
        let min = truth.iter().map(values).fold(f64::INFINITY, f64::min);
        let max = truth.iter().map(values).fold(f64::NEG_INFINITY, f64::max);
        f64::midpoint(min, max)
    };
    let (x, y) = (middle(&|pose| pose.x_m), middle(&|pose| pose.y_m));
    let area = Area { min: Point2::new(x - 44.5, y - 44.5), max: Point2::new(x + 44.5, y + 44.5) };
    PoseGrid::new(area, resolution_m, n_headings).expect("a grid")
}

fn seconds<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let begun = Instant::now();
    let result = work();
    (result, begun.elapsed().as_secs_f64())
}

fn megabytes(n_bytes: usize) -> f64 {
    n_bytes as f64 / 1e6
}

fn by_iteration(travel: &Travel, truth: &[Pose], params: &EmParams, n_landmarks: usize) {
    println!(
        "iteration  seconds  ln P(d|m)      cells     MB  landmarks  path off: median, most (m)"
    );
    let (mut em, mut total_s) = seconds(|| Em::new(travel, *params, Start::Controls));
    while !em.has_converged() {
        let (figures, taken_s) = seconds(|| em.iterate());
        total_s += taken_s;
        let (median_m, most_m) =
            em.path().map_or((f64::NAN, f64::NAN), |path| travel::off_m(&path.poses, truth));
        println!(
            "{:9}  {taken_s:7.3}  {:9.1}  {:9}  {:5.1}  {:9}  {median_m:.2}, {most_m:.2}",
            figures.iteration,
            figures.log_likelihood.unwrap_or(f64::NAN),
            figures.n_cells,
            megabytes(figures.n_bytes),
            n_found(em.map()),
        );
    }
    println!("all with tables: {total_s:.2} s; {} of {n_landmarks} landmarks\n", n_found(em.map()));
}

fn n_found(map: Option<&LandmarkMap>) -> usize {
    map.map_or(0, |map| map.landmarks(&PeakParams::BUTTON).len())
}

/// Iterations on one grid, which the economies are compared by.
const N_ITERATIONS: u32 = 5;

/// Seconds of tables and of all iterations, and what they worked on.
fn timed(travel: &Travel, params: &EmParams) -> (f64, f64, Vec<Figures>) {
    let (mut em, tables_s) = seconds(|| Em::new(travel, *params, Start::Controls));
    let iterations = || (0..N_ITERATIONS).map(|_| em.iterate()).collect();
    let (figures, taken_s) = seconds(iterations);
    (tables_s, taken_s, figures)
}

fn print_timed(name: &str, travel: &Travel, params: &EmParams) {
    let (tables_s, taken_s, figures) = timed(travel, params);
    let n_products: usize = figures.iter().map(|figures| figures.n_products).sum();
    let n_bytes = figures.iter().map(|figures| figures.n_bytes).max().unwrap_or(0);
    let (n, n_steps) = (f64::from(N_ITERATIONS), travel.steps.len() as f64);
    println!(
        "{name:34} {n_steps:5}  {tables_s:8.3}  {:9.3}  {:7.2}  {:10.1}  {:12.2}  {:6.1}",
        taken_s / n,
        1e3 * taken_s / n / n_steps,
        n_products as f64 / n / 1e6,
        1e9 * taken_s / n_products as f64,
        megabytes(n_bytes),
    );
}

fn print_head(title: &str) {
    println!("{title:34} steps  tables s  iterat. s  ms/step  M products  ns a product      MB");
}

/// Without coarse iterations, so that all is measured on one grid.
fn on_one_grid(params: &EmParams) -> EmParams {
    EmParams { n_coarse_iterations: 0, ..*params }
}

fn growth_with_steps(simulated: &LandmarkTravel, params: &EmParams) {
    print_head("growth with steps");
    let (travel, _) = travel::cut(simulated, STEP_M);
    for share in [4, 2, 1] {
        let steps = travel.steps[..travel.steps.len() / share].to_vec();
        let prefix = Travel { steps, ..travel.clone() };
        print_timed(&format!("1/{share} of the travel"), &prefix, &on_one_grid(params));
    }
    println!();
}

fn growth_with_cells(travel: &Travel, truth: &[Pose], params: &EmParams) {
    print_head("growth with cells times kernel");
    for (resolution_m, n_headings) in
        [(2.0, 36), (2.0, 72), (1.0, 36), (1.0, 72), (1.0, 144), (0.5, 72)]
    {
        let grid = grid_around(truth, resolution_m, n_headings);
        let params = EmParams { grid, ..on_one_grid(params) };
        print_timed(&format!("{resolution_m} m, {n_headings} headings"), travel, &params);
    }
    println!();
}

fn economies(simulated: &LandmarkTravel, truth: &[Pose], params: &EmParams) {
    print_head("economies of section 5");
    let (travel, _) = travel::cut(simulated, STEP_M);
    let one_grid = on_one_grid(params);
    print_timed("all", &travel, &one_grid);
    for share in [1e-4, 0.0] {
        let params = EmParams { selection_share: share, ..one_grid };
        print_timed(&format!("selection at {share:e} of the maximum"), &travel, &params);
    }
    for step_m in [5.0, 1.0] {
        let (travel, _) = travel::cut(simulated, step_m);
        print_timed(&format!("coarse time: a step every {step_m} m"), &travel, &one_grid);
    }
    let one_thread = EmParams { n_threads: NonZero::<usize>::MIN, ..one_grid };
    print_timed("one thread", &travel, &one_thread);
    let mut em = Em::new(&travel, one_grid, Start::Controls);
    for _ in 0..N_ITERATIONS {
        em.iterate();
    }
    let (_, e_step_s) = seconds(|| em.posterior());
    let (_, beta_s) = seconds(|| em.beta(0));
    println!(
        "\nE-step with beta where alpha is: {e_step_s:.3} s; all betas anywhere: {beta_s:.3} s"
    );
    println!(
        "tables hold a quarter of the headings: without symmetry four times the time and bytes"
    );
    for n_coarse_iterations in [0, params.n_coarse_iterations] {
        let params = EmParams { n_coarse_iterations, ..*params };
        let run = || {
            let mut em = Em::new(&travel, params, Start::Controls);
            while !em.has_converged() {
                em.iterate();
            }
            em
        };
        let (em, taken_s) = seconds(run);
        let path = em.path().map(|path| travel::off_m(&path.poses, truth));
        println!(
            "{n_coarse_iterations} coarse iterations of {}: {taken_s:.2} s, {} landmarks, path off {path:.2?} m",
            em.n_iterations(),
            n_found(em.map()),
        );
    }
}
