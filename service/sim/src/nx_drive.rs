//! NX in one of its environments, driven by the qualitative explorer, and whether it found the true
//! graph.

use meetpoint_geometry::Pose;
use meetpoint_places::qualitative::{Body, Command, Explored, Explorer, ExplorerParams, Readings};
use meetpoint_places::{World, is_isomorphic};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::nx::{Nx, NxSenses};
use crate::nx_world::NxWorld;
use crate::odometry::OdometryError;

/// Motions and firings after which an exploration counts as not complete.
const N_FIRINGS_MAX: u32 = 60_000;
/// Robots begin up to so much aslant, in radians.
const ASLANT_RAD: f64 = 0.2;

/// How an exploration is made.
#[derive(Clone, Copy, Debug)]
pub struct NxDrive {
    /// How the explorer thinks, and whether it has a compass.
    pub params: ExplorerParams,
    /// Standard deviation of readings, as a share of the distance.
    pub range_error: f64,
    /// Whether home is marked.
    pub has_home: bool,
    /// Of all errors, and of how the robot stands at first.
    pub seed: u64,
}

/// What came out of one exploration.
#[derive(Clone, Debug)]
pub struct NxExplored {
    /// What is known, and whether nothing was left to explore.
    pub explored: Explored,
    /// Whether that is so and the graph found is the true one.
    pub is_true: bool,
    /// How far the robot really went, in metres.
    pub way_m: f64,
}

impl NxDrive {
    /// The robot where it begins, a little aslant, with the wheels of
    /// [`OdometryError::UNCALIBRATED`].
    pub fn robot<'a>(&self, world: &'a NxWorld) -> Nx<'a> {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        let senses = NxSenses {
            range_error: self.range_error,
            odometry_error: OdometryError::UNCALIBRATED,
            has_compass: self.params.heading_error.is_compass(),
        };
        let aslant_rad = rng.random_range(-ASLANT_RAD..ASLANT_RAD);
        let start = world.start * Pose::new(0.0, 0.0, aslant_rad);
        let nx = Nx::new(&world.building, start, senses, rng);
        if self.has_home { nx.with_home(world.home) } else { nx }
    }

    /// Explores an environment; `watch` is shown every command, and where the robot is when it is
    /// given.
    pub fn explore(
        &self,
        world: &NxWorld,
        mut watch: impl FnMut(&Explorer, Pose, Command),
    ) -> NxExplored {
        let mut nx = self.robot(world);
        let (mut way_m, mut before) = (0.0, nx.truth());
        let explored = meetpoint_places::qualitative::explore(
            &mut nx,
            self.params,
            N_FIRINGS_MAX,
            |explorer, nx: &Nx<'_>, command| {
                way_m += (nx.truth().position() - before.position()).norm();
                before = nx.truth();
                watch(explorer, before, command);
            },
        );
        way_m += (nx.truth().position() - before.position()).norm();
        let is_true = explored.is_complete
            && is_isomorphic(explored.explorer.graph().map(), world.truth().map());
        NxExplored { explored, is_true, way_m }
    }
}

impl NxWorld {
    /// The true graph, as it is drawn.
    ///
    /// # Panics
    /// Never for those of [`crate::nx_worlds`]: their graphs are part of the crate and tested.
    pub fn truth(&self) -> World {
        World::from_drawing(self.graph).expect("the crate's own drawings are valid")
    }
}

impl Body for Nx<'_> {
    fn readings(&self) -> Readings<'_> {
        Readings {
            ranges_m: self.ranges_m(),
            heading_rad: self.heading_rad(),
            moved_m: self.moved_m(),
            sees_home: self.sees_home(),
        }
    }

    fn turn(&mut self, by_rad: f64) {
        self.turn(by_rad);
    }

    fn advance(&mut self, by_m: f64) {
        self.advance(by_m);
    }

    fn look(&mut self) {
        self.look();
    }
}
