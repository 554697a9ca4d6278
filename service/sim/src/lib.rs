//! Simulated buildings and robots: drives with a known truth, imperfect odometry and laser scans,
//! the same bits from the same seed.

mod building;
mod drive;
mod laser;
mod odometry;
mod ray;
mod route;
mod world;

pub use building::{Building, InvalidBuilding};
pub use drive::{Drive, Robot, Tick};
pub use laser::{Laser, LaserNoise};
pub use odometry::{Odometer, OdometryError};
pub use rand_chacha::ChaCha8Rng;
pub use route::route;
pub use world::{World, corridor_loop, hall, office};
