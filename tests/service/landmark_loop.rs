//! A robot without a laser that drives around a block twice, past doors that a button is pressed
//! at, with odometry that drifts.

use std::f64::consts::{FRAC_PI_2, PI};

use meetpoint_client::v1;
use meetpoint_geometry::{Point2, Pose};
use v1::observation::Kind;

use crate::drive::{SECOND_NS, START_NS, observation, odometry_pose};

/// Name of the button within a session.
pub(crate) const BUTTON: &str = "button";
/// The block: 12 m by 8 m, beginning at the map's origin along x.
const SIDES_M: [u32; 4] = [12, 8, 12, 8];
/// Steps in a metre.
const N_STEPS_A_METRE: u32 = 4;
/// Turns of a quarter are made in so many steps.
const N_STEPS_A_TURN: u32 = 6;
/// Times around.
const N_ROUNDS: usize = 2;
/// Doors on the way around: one 6 m into each side, and one at its end.
pub(crate) const N_DOORS: usize = 8;
/// What the odometry turns too far, in radians a metre: 55 degrees over the whole drive.
const DRIFT_RAD_PER_M: f64 = 0.012;
/// Of each metre it tells so much.
const SCALE: f64 = 1.02;

/// A drive around the block.
pub(crate) struct LandmarkLoop {
    /// By arrival: odometry, and a sighting where there is a door.
    observations: Vec<v1::Observation>,
    /// Where the robot truly was at each sighting.
    pub(crate) truth: Vec<Pose>,
    /// What odometry says of that.
    pub(crate) odometry: Vec<Pose>,
    /// The doors: what they are called, and where they truly are.
    pub(crate) doors: Vec<(String, Point2<f64>)>,
}

impl LandmarkLoop {
    pub(crate) fn around_the_block() -> Self {
        Self::from_corner(0)
    }

    /// The same way from another corner on: 0 is the map's origin.
    pub(crate) fn from_corner(corner: usize) -> Self {
        let mut drive = Self {
            observations: Vec::new(),
            truth: Vec::new(),
            odometry: Vec::new(),
            doors: Vec::new(),
        };
        let (mut truth, mut odometry) = (Pose::IDENTITY, Pose::IDENTITY);
        let n_before = corner * N_DOORS / SIDES_M.len();
        drive.note(truth, odometry, Some(n_before % N_DOORS));
        for _ in 0..N_ROUNDS {
            let mut door = 0;
            for index in 0..SIDES_M.len() {
                let side_m = SIDES_M[(corner + index) % SIDES_M.len()];
                for step in 1..=side_m * N_STEPS_A_METRE {
                    let length_m = 1.0 / f64::from(N_STEPS_A_METRE);
                    truth = truth * Pose::new(length_m, 0.0, 0.0);
                    let drift_rad = length_m * DRIFT_RAD_PER_M;
                    odometry = odometry * Pose::new(length_m * SCALE, 0.0, drift_rad);
                    let is_door =
                        step % (6 * N_STEPS_A_METRE) == 0 || step == side_m * N_STEPS_A_METRE;
                    door += usize::from(is_door);
                    let name = (n_before + door) % N_DOORS;
                    drive.note(truth, odometry, is_door.then_some(name));
                }
                for _ in 0..N_STEPS_A_TURN {
                    let turn = Pose::new(0.0, 0.0, FRAC_PI_2 / f64::from(N_STEPS_A_TURN));
                    (truth, odometry) = (truth * turn, odometry * turn);
                    drive.note(truth, odometry, None);
                }
            }
        }
        drive
    }

    /// The same, past doors that all look alike.
    pub(crate) fn past_nameless_doors(mut self) -> Self {
        for seen in self.observations.iter_mut().filter_map(|it| it.kind.as_mut()) {
            if let Kind::LandmarkSighting(sighting) = seen {
                sighting.identity = None;
            }
        }
        self
    }

    fn note(&mut self, truth: Pose, odometry: Pose, door: Option<usize>) {
        let tick = i64::try_from(self.observations.len()).expect("a short drive");
        let stamp_ns = START_NS + tick * SECOND_NS / 2;
        self.observations.push(observation(stamp_ns, "", odometry_pose(odometry)));
        let Some(door) = door else { return };
        let name = format!("door {door}");
        if self.doors.iter().all(|(known, _)| *known != name) {
            self.doors.push((name.clone(), truth.position()));
        }
        let sighting = v1::LandmarkSighting {
            identity: Some(name),
            landmark_type: "door".into(),
            ..v1::LandmarkSighting::default()
        };
        self.observations.push(observation(stamp_ns, BUTTON, Kind::LandmarkSighting(sighting)));
        self.truth.push(truth);
        self.odometry.push(odometry);
    }

    /// In batches of so many observations.
    pub(crate) fn batches(&self, n_observations: usize) -> Vec<v1::Batch> {
        let chunks = (1..).zip(self.observations.chunks(n_observations));
        chunks.map(|(number, chunk)| v1::Batch { number, observations: chunk.to_vec() }).collect()
    }

    /// What the robot declares: nothing but the button.
    pub(crate) fn sensor() -> v1::Sensor {
        let detector = v1::LandmarkDetector { range_max_m: 0.3, half_field_of_view_rad: PI };
        v1::Sensor {
            id: BUTTON.into(),
            robot_from_sensor: None,
            kind: Some(v1::sensor::Kind::LandmarkDetector(detector)),
        }
    }

    /// Mean distance of poses from the truth at the sightings, in metres.
    pub(crate) fn mean_error_m(&self, poses: impl Iterator<Item = Pose>) -> f64 {
        let errors_m: Vec<f64> = self
            .truth
            .iter()
            .zip(poses)
            .map(|(truth, pose)| truth.step_to(pose).distance_m())
            .collect();
        assert_eq!(errors_m.len(), self.truth.len(), "a pose a sighting");
        errors_m.iter().sum::<f64>() / errors_m.len() as f64
    }
}
