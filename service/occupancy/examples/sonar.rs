//! Trains the network that interprets sonar rings on simulated buildings, and measures it.
//!
//! ```text
//! cargo run --release -p meetpoint-occupancy --example sonar -- [WEIGHTS]
//! ```
//!
//! Places around random poses in random floors, half of them heard by rings of 16 sonars and half by rings
//! of 24; a place is occupied if its cell of 0.1 m is wall. Held out are other floors. Told are mean cross-entropy and the share of
//! places on the wrong side of one half, for the network, the inverse cone model and the constant
//! answer, then how often places are occupied of which the network says so. WEIGHTS is written if named.

use std::error::Error;

use meetpoint_geometry::{Point2, Pose};
use meetpoint_occupancy::{
    Example, InverseCone, Network, SonarRing, TrainingParams, cross_entropy, trained,
};
use meetpoint_sim::{Building, ChaCha8Rng, RoomParams, random_rooms};
use rand::{RngExt, SeedableRng};

/// Places to learn from, and places held out.
const N_TRAINED: usize = 400_000;
const N_HELD_OUT: usize = 100_000;
/// Places taken of a scan: a few, so that there are many scans.
const N_PER_SCAN: usize = 20;
/// Scans of a floor.
const N_SCANS_PER_FLOOR: usize = 200;
/// Places are taken up to this distance, in metres.
const DISTANCE_MAX_M: f64 = 3.5;
/// Places are not taken nearer than this: the robot stands there.
const DISTANCE_MIN_M: f64 = 0.3;
/// Robots keep this off walls, in metres.
const CLEARANCE_M: f64 = 0.3;

/// A place, and what the baseline says of it.
struct Place {
    example: Example,
    by_cone: f32,
}

fn main() -> Result<(), Box<dyn Error>> {
    let trained_on = places(N_TRAINED, 1)?;
    let held_out = places(N_HELD_OUT, 1_000_001)?;
    let examples: Vec<Example> = trained_on.iter().map(|place| place.example).collect();
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let network = trained(&examples, &TrainingParams::STANDARD, &mut rng);
    measure("trained now", &network, &held_out);
    measure("shipped", &Network::shipped(), &held_out);
    if let Some(path) = std::env::args().nth(1) {
        std::fs::write(path, network.to_text())?;
    }
    Ok(())
}

fn measure(name: &str, network: &Network, held_out: &[Place]) {
    let examples: Vec<Example> = held_out.iter().map(|place| place.example).collect();
    let prior = network.prior_log_odds();
    let by_network = cross_entropy(&examples, |view| network.log_odds(view));
    let constant = cross_entropy(&examples, |_| prior);
    let losses = held_out.iter().map(|place| {
        cross_entropy(std::slice::from_ref(&place.example), |_| prior + place.by_cone)
    });
    let by_cone = losses.sum::<f64>() / held_out.len() as f64;
    let wrong = |said: &dyn Fn(&Place) -> f32| {
        let is_wrong = |place: &&Place| (0.0 < said(place)) != place.example.is_occupied;
        100.0 * held_out.iter().filter(is_wrong).count() as f64 / held_out.len() as f64
    };
    println!("{name}, {} places held out, {:.1} % occupied", held_out.len(), {
        100.0 * examples.iter().filter(|one| one.is_occupied).count() as f64 / examples.len() as f64
    });
    println!("| model | cross-entropy, nats | wrong |");
    println!("|---|---|---|");
    println!("| constant | {constant:.4} | {:.1} % |", wrong(&|_| prior));
    println!("| inverse cone | {by_cone:.4} | {:.1} % |", wrong(&|place| prior + place.by_cone));
    let of_network = wrong(&|place| network.log_odds(&place.example.view));
    println!("| network | {by_network:.4} | {of_network:.1} % |");
    println!("| network says | places | occupied |");
    println!("|---|---|---|");
    for tenth in 0..10_u8 {
        let (low, high) = (f32::from(tenth) / 10.0, f32::from(tenth + 1) / 10.0);
        let says = |place: &&Place| {
            let said = 1.0 / (1.0 + (-network.log_odds(&place.example.view)).exp());
            low <= said && (said < high || tenth == 9)
        };
        let said: Vec<&Place> = held_out.iter().filter(says).collect();
        let n_occupied = said.iter().filter(|place| place.example.is_occupied).count();
        let share = n_occupied as f64 / said.len().max(1) as f64;
        println!("| {low:.1} to {high:.1} | {} | {share:.3} |", said.len());
    }
}

/// Places of floors that a seed determines.
fn places(n: usize, seed: u64) -> Result<Vec<Place>, Box<dyn Error>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut places = Vec::new();
    while places.len() < n {
        let floor = random_rooms((24.0, 16.0), &RoomParams::OFFICES, &mut rng)?;
        for index in 0..N_SCANS_PER_FLOOR {
            let sonars = if index % 2 == 0 {
                meetpoint_sim::SonarRing::RING_24
            } else {
                meetpoint_sim::SonarRing::RING_16
            };
            let robot = free_pose(&floor, &mut rng);
            let ranges_m = sonars.scan(&floor, robot, &mut rng);
            let ring = ring(&sonars);
            let scan = ring.scan(&ranges_m);
            for _ in 0..N_PER_SCAN {
                // As many at every distance: near ones are asked more often than there is room for them.
                let distance_m = rng.random_range(DISTANCE_MIN_M..DISTANCE_MAX_M);
                let bearing_rad = rng.random_range(0.0..std::f64::consts::TAU);
                let (sin, cos) = bearing_rad.sin_cos();
                let place = Point2::new(distance_m * cos, distance_m * sin);
                let Some(view) = scan.view(place) else { continue };
                let is_occupied = floor.is_wall(floor.info().frame.cell_at(robot * place));
                let by_cone = InverseCone::CLASSIC.evidence(&ring, &scan, place);
                places.push(Place { example: Example { view, is_occupied }, by_cone });
            }
        }
    }
    places.truncate(n);
    Ok(places)
}

fn free_pose(floor: &Building, rng: &mut ChaCha8Rng) -> Pose {
    let info = floor.info();
    let edge_m = info.frame.resolution_m();
    loop {
        let x_m = rng.random_range(0.0..edge_m * f64::from(info.width));
        let y_m = rng.random_range(0.0..edge_m * f64::from(info.height));
        if floor.is_free(Point2::new(x_m, y_m), CLEARANCE_M) {
            return Pose::new(x_m, y_m, rng.random_range(0.0..std::f64::consts::TAU));
        }
    }
}

/// A simulated ring as the service has it declared.
fn ring(sonars: &meetpoint_sim::SonarRing) -> SonarRing {
    SonarRing {
        robot_from_transducer: (0..sonars.n_sonars).map(|at| sonars.robot_from_sonar(at)).collect(),
        cone_rad: sonars.cone_rad,
        range_min_m: sonars.range_min_m,
        range_max_m: sonars.range_max_m,
    }
}
