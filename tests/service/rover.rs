//! NX on the wire: it does what it is told, fires, and sends what it sensed.

use std::f64::consts::TAU;

use meetpoint_client::v1;
use meetpoint_geometry::Pose;
use meetpoint_places::qualitative::{
    Command, Explorer, ExplorerParams, Firing, Guide, GuideParams,
};
use meetpoint_sim::{ChaCha8Rng, Nx, NxSenses, NxWorld, OdometryError};
use rand::SeedableRng;
use v1::ingest_batch_request::Kind as Upload;
use v1::observation::Kind;

use crate::door::Door;
use crate::drive::{SECOND_NS, START_NS, observation, odometry_pose, opened, opening, pose};

/// Readings from here on mean that nothing was heard, in metres.
const RANGE_MAX_M: f64 = 6.0;
/// Beams of the laser: four degrees each.
const N_BEAMS: u32 = 90;

/// By what it looks around.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Eyes {
    /// Sixteen sonars.
    Ring,
    /// A laser that looks all around, and twice as far.
    Laser,
}

impl Eyes {
    pub(crate) fn sensor(self) -> v1::Sensor {
        let kind = match self {
            Self::Ring => v1::sensor::Kind::SonarRing(v1::SonarRing {
                sensor_from_transducer: (0..16)
                    .map(|at| pose(Pose::new(0.0, 0.0, TAU * f64::from(at) / 16.0)))
                    .collect(),
                cone_angle_rad: TAU / 16.0,
                range_min_m: 0.0,
                range_max_m: RANGE_MAX_M,
            }),
            Self::Laser => v1::sensor::Kind::Laser(v1::LaserGeometry {
                angle_min_rad: 0.0,
                angle_increment_rad: TAU / f64::from(N_BEAMS),
                n_beams: N_BEAMS,
                range_min_m: 0.0,
                range_max_m: 2.0 * RANGE_MAX_M,
            }),
        };
        v1::Sensor { id: "eyes".to_owned(), robot_from_sensor: None, kind: Some(kind) }
    }
}

/// What a robot is equipped with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Senses {
    pub(crate) eyes: Eyes,
    pub(crate) has_compass: bool,
    /// Whether home is marked.
    pub(crate) has_home: bool,
}

impl Senses {
    /// With a compass, in an environment without marks.
    pub(crate) fn of(eyes: Eyes) -> Self {
        Self { eyes, has_compass: true, has_home: false }
    }
}

/// NX, and beside it what the same guide would tell it that never was on any wire.
pub(crate) struct Rover<'a> {
    world: &'a NxWorld,
    nx: Nx<'a>,
    eyes: Eyes,
    odometry: Pose,
    pub(crate) session: v1::Session,
    n_batches: u64,
    pub(crate) guide: Guide,
}

impl<'a> Rover<'a> {
    /// With a compass, sonars that err by 5 %, and wheels that were never calibrated.
    pub(crate) async fn new<D: Door>(door: &D, map: &str, world: &'a NxWorld, eyes: Eyes) -> Self {
        Self::with(door, map, world, Senses::of(eyes)).await
    }

    /// The same with these senses.
    pub(crate) async fn with<D: Door>(
        door: &D,
        map: &str,
        world: &'a NxWorld,
        senses: Senses,
    ) -> Self {
        let Senses { eyes, has_compass, has_home } = senses;
        let senses = NxSenses {
            range_error: 0.05,
            odometry_error: OdometryError::UNCALIBRATED,
            has_compass,
        };
        let nx = Nx::new(&world.building, world.start, senses, ChaCha8Rng::seed_from_u64(2));
        let nx = if has_home { nx.with_home(world.home) } else { nx };
        let session = opened(door, opening(map, "nx", &[eyes.sensor()])).await;
        let odometry = Pose::new(0.0, 0.0, nx.heading_rad());
        let guide = Guide::new(Explorer::new(ExplorerParams::NX), GuideParams::WHEELS);
        Self { world, nx, eyes, odometry, session, n_batches: 0, guide }
    }

    fn ranges_m(&self) -> Vec<f32> {
        #[expect(clippy::cast_possible_truncation, reason = "as the wire has it")]
        let on_wire = |range_m: f64| range_m as f32;
        match self.eyes {
            Eyes::Ring => self.nx.ranges_m().iter().copied().map(on_wire).collect(),
            Eyes::Laser => {
                let from = self.nx.truth();
                let range_m = |beam: u32| {
                    let bearing_rad = from.theta_rad + TAU * f64::from(beam) / f64::from(N_BEAMS);
                    let building = &self.world.building;
                    building.range_m(from.position(), bearing_rad, 2.0 * RANGE_MAX_M)
                };
                (0..N_BEAMS).map(|beam| on_wire(range_m(beam).unwrap_or(f64::INFINITY))).collect()
            }
        }
    }

    /// Sends its newest firing.
    pub(crate) async fn fire<D: Door>(&mut self, door: &D) {
        self.n_batches += 1;
        let stamp_ns = START_NS + i64::try_from(self.n_batches).expect("few") * SECOND_NS;
        let ranges_m = self.ranges_m();
        if self.eyes == Eyes::Ring {
            let heard = |&range_m: &f32| match f64::from(range_m) {
                far_m if RANGE_MAX_M <= far_m => f64::INFINITY,
                range_m => range_m,
            };
            let heard: Vec<f64> = ranges_m.iter().map(heard).collect();
            let odometry_from_robot = self.odometry;
            let sees_home = self.nx.sees_home();
            self.guide.take_in(&Firing { ranges_m: &heard, odometry_from_robot, sees_home });
        }
        let scan = match self.eyes {
            Eyes::Ring => Kind::SonarScan(v1::SonarScan { ranges_m }),
            Eyes::Laser => Kind::LaserScan(v1::LaserScan { ranges_m, intensities: Vec::new() }),
        };
        let mut observations = vec![observation(stamp_ns, "", odometry_pose(self.odometry))];
        if self.nx.sees_home() {
            let label = "home".to_owned();
            observations.push(observation(stamp_ns, "", Kind::Mark(v1::Mark { label })));
        }
        observations.push(observation(stamp_ns, "eyes", scan));
        let batch = v1::Batch { number: self.n_batches, observations };
        let ack = door.upload(&self.session.id, self.session.epoch, Upload::Batch(batch)).await;
        assert_eq!(ack.expect("a good batch").rejected, [], "nothing is wrong with it");
    }

    /// Does what it is told; false if that is nothing.
    pub(crate) fn carry_out(&mut self, step: &v1::QualitativeStep) -> bool {
        match step.kind() {
            v1::StepKind::Turn => self.nx.turn(step.turn_rad.expect("how far")),
            v1::StepKind::Move => {
                let by_m = step.move_m.expect("how far");
                self.nx.advance(by_m);
                let (sin, cos) = self.nx.heading_rad().sin_cos();
                let moved_m = by_m.signum() * self.nx.moved_m();
                self.odometry.x_m += moved_m * cos;
                self.odometry.y_m += moved_m * sin;
            }
            v1::StepKind::Look => self.nx.look(),
            v1::StepKind::Done => return false,
            v1::StepKind::Unspecified => panic!("{step:?}"),
        }
        self.odometry = Pose::new(self.odometry.x_m, self.odometry.y_m, self.nx.heading_rad());
        true
    }

    /// Whether a step is what the guide beside it tells.
    pub(crate) fn is_as_guided(&self, step: &v1::QualitativeStep) -> bool {
        match self.guide.next() {
            Command::Turn { by_rad } => step.turn_rad == Some(by_rad),
            Command::Move { by_m } => step.move_m == Some(by_m),
            Command::Look => step.kind() == v1::StepKind::Look,
            Command::Done => step.kind() == v1::StepKind::Done,
        }
    }
}
