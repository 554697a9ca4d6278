//! Simulated buildings and robots: drives with a known truth, imperfect odometry, laser and sonar scans,
//! and travels past landmarks; the same bits from the same seed.

mod benchmark_travel;
mod building;
mod corridors;
mod crowd;
mod drive;
mod landmark_drive;
mod landmark_sensor;
mod landmark_travel;
mod laser;
mod museum;
mod odometry;
mod person;
mod random_building;
mod random_rooms;
mod ray;
mod ring_corridor;
mod route;
mod sonar;
mod thrun_1998;
mod tour;
mod triangular_odometry;
mod world;

pub use benchmark_travel::{BenchmarkKind, benchmark_tour, benchmark_travel};
pub use building::{Building, InvalidBuilding};
pub use corridors::{Corridors, InvalidCorridor};
pub use crowd::Crowd;
pub use drive::{Drive, Robot, Tick};
pub use landmark_drive::{LandmarkRobot, Waypoint, landmark_drive, n_controls};
pub use landmark_sensor::{LandmarkDetector, LandmarkSensor, Sense};
pub use landmark_travel::{Landmark, LandmarkTravel, Moment, Stage, TrueSighting};
pub use laser::{Laser, LaserNoise};
pub use museum::{museum, museum_again};
pub use odometry::{Odometer, OdometryError};
pub use person::Person;
pub use rand_chacha::ChaCha8Rng;
pub use random_building::random_building;
pub use random_rooms::{RoomParams, random_rooms};
pub use ray::Hit;
pub use ring_corridor::ring_corridor;
pub use route::route;
pub use sonar::{SonarNoise, SonarRing};
pub use thrun_1998::{first_data_set, second_data_set};
pub use tour::tour;
pub use triangular_odometry::{TriangularError, triangular};
pub use world::{World, corridor_loop, hall, office, rooms};
