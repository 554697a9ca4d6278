//! NX in its environments, driven by the explorer.

use meetpoint_geometry::Pose;
use meetpoint_places::qualitative::{Command, Explorer, ExplorerParams, ExplorerState, Readings};
use meetpoint_places::{World, is_isomorphic};
use meetpoint_sim::{ChaCha8Rng, Nx, NxSenses, NxWorld, OdometryError};
use rand::{RngExt, SeedableRng};

/// Motions and firings after which an exploration counts as not complete.
const N_COMMANDS_MAX: u32 = 60_000;

/// How an exploration is made.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Drive {
    pub(crate) params: ExplorerParams,
    /// Standard deviation of readings, as a share of the distance.
    pub(crate) range_error: f64,
    /// Whether home is marked.
    pub(crate) has_home: bool,
    pub(crate) seed: u64,
}

/// What came out of one exploration.
pub(crate) struct Explored {
    pub(crate) explorer: Explorer,
    /// Whether nothing was left to explore.
    pub(crate) is_complete: bool,
    /// Whether the graph found is the true one.
    pub(crate) is_true: bool,
    /// Steps that moved the robot.
    pub(crate) n_steps: u32,
    /// Firings of the ring.
    pub(crate) n_firings: u32,
    /// How far the robot really went, in metres.
    pub(crate) way_m: f64,
}

/// Explores a world; `watch` is shown every command, and where the robot is when it is given.
pub(crate) fn explore(
    world: &NxWorld,
    drive: Drive,
    mut watch: impl FnMut(&Explorer, Pose, Command),
) -> Explored {
    let mut nx = nx(world, drive);
    let mut explorer = Explorer::new(drive.params);
    let (mut n_steps, mut n_firings, mut way_m) = (0, 1, 0.0);
    let is_complete = loop {
        let readings = Readings {
            ranges_m: nx.ranges_m(),
            heading_rad: nx.heading_rad(),
            moved_m: nx.moved_m(),
            sees_home: nx.sees_home(),
        };
        let command = explorer.next(&readings);
        watch(&explorer, nx.truth(), command);
        match command {
            Command::Turn { by_rad } => nx.turn(by_rad),
            Command::Move { by_m } => {
                let before = nx.truth();
                nx.advance(by_m);
                n_steps += 1;
                way_m += (nx.truth().position() - before.position()).norm();
            }
            Command::Look => nx.look(),
            Command::Done => break explorer.state() == ExplorerState::Complete,
        }
        n_firings += 1;
        if N_COMMANDS_MAX < n_firings {
            break false;
        }
    };
    let truth = World::from_drawing(world.graph).expect("the crate's own drawings are valid");
    let is_true = is_complete && is_isomorphic(explorer.graph().map(), truth.map());
    Explored { explorer, is_complete, is_true, n_steps, n_firings, way_m }
}

/// The robot where it begins, a little aslant.
fn nx(world: &NxWorld, drive: Drive) -> Nx<'_> {
    let mut rng = ChaCha8Rng::seed_from_u64(drive.seed);
    let senses = NxSenses {
        range_error: drive.range_error,
        odometry_error: OdometryError::UNCALIBRATED,
        has_compass: drive.params.heading_error.is_compass(),
    };
    let start = world.start * Pose::new(0.0, 0.0, rng.random_range(-0.2..0.2));
    let nx = Nx::new(&world.building, start, senses, rng);
    if drive.has_home { nx.with_home(world.home) } else { nx }
}
