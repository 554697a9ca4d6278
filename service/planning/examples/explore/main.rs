//! Robots that explore random buildings with live mapping and nobody's help: how much they see, and
//! how long they drive for it.
//!
//! `cargo run -p meetpoint-planning --example explore [BUILDINGS]`
//!
//! Lasers and odometry err as in the demo. Robots ask for goals once a second and drive on towards
//! them meanwhile; they stop when nothing that they can reach is unexplored.

mod fleet;
mod floor;

use meetpoint_planning::ExplorationParams;
use meetpoint_sim::{ChaCha8Rng, RoomParams, random_rooms};
use rand::SeedableRng;

use fleet::{Account, Fleet};
use floor::Floor;

/// Buildings where nothing is said.
const N_BUILDINGS: u64 = 6;
/// Sizes of the buildings, in metres.
const SIZE_M: (f64, f64) = (24.0, 16.0);
/// Robots ask for ways so much farther from walls than they are wide, in metres: corners are cut.
const SPARE_M: f64 = 0.1;

fn main() {
    let asked = std::env::args().nth(1).and_then(|text| text.parse().ok());
    let indoor = ExplorationParams::INDOOR;
    let radius_m = meetpoint_sim::Robot::INDOOR.radius_m + SPARE_M;
    let costs = [
        ("length", ExplorationParams { radius_m, ..indoor }),
        ("paper", ExplorationParams { radius_m, ..ExplorationParams::THRUN_1998 }),
    ];
    println!("building  robots  costs   seen %  minutes  way m  at work %  error m  left m");
    let mut sums: Vec<(usize, &str, Vec<Account>)> = vec![];
    for seed in 1..=asked.unwrap_or(N_BUILDINGS) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let building =
            random_rooms(SIZE_M, &RoomParams::OFFICES, &mut rng).expect("a floor of that size");
        let floor = Floor::new(&building, radius_m);
        for n_robots in [1, 3] {
            for (name, params) in &costs {
                let account = Fleet::new(&floor, n_robots, *params, seed).explored();
                tell(&seed.to_string(), n_robots, name, &account);
                match sums.iter_mut().find(|(n, costs, _)| (n, costs) == (&n_robots, name)) {
                    Some((.., accounts)) => accounts.push(account),
                    None => sums.push((n_robots, name, vec![account])),
                }
            }
        }
    }
    for (n_robots, name, accounts) in &sums {
        tell("mean", *n_robots, name, &Account::mean(accounts));
    }
}

fn tell(building: &str, n_robots: usize, costs: &str, account: &Account) {
    let Account { seen_share, duration_s, way_m, at_work_share, error_mean_m, left_m } = account;
    println!(
        "{building:>8}  {n_robots:>6}  {costs:<6}  {:>6.2}  {:>7.1}  {way_m:>5.0}  {:>9.0}  \
         {error_mean_m:>7.3}  {left_m:>6.1}",
        100.0 * seen_share,
        duration_s / 60.0,
        100.0 * at_work_share,
    );
}
