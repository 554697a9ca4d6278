//! A robot that only hears maps a room.

use meetpoint_client::v1;
use meetpoint_geometry::{Point2, Pose};
use meetpoint_sim::{Building, ChaCha8Rng, OdometryError, Robot, SonarRing, hall};
use rand::SeedableRng;
use v1::observation::Kind;

use crate::door::{Door, complete, finished, job_done};
use crate::drive::{SimulatedDrive, observation, odometry_pose, opened, opening, pose, send};
use crate::running::{Launch, empty_folder};

/// Name of the ring within a session.
const RING: &str = "ring";
/// Ticks from one firing to the next: five firings a second.
const N_TICKS_PER_FIRING: usize = 4;
/// Ticks of a batch.
const N_TICKS: usize = 40;
/// How far from the truth a pose may be, in metres: two cells.
const ERROR_MAX_M: f64 = 0.2;
/// Cells nearer to a wall's face than this are not judged, in metres: a cone blurs it.
const BLUR_M: f64 = 0.2;
/// Cells of walls deeper than this are not judged, in metres: the hall's walls are as thick, and beyond them
/// the drawing ends.
const DEPTH_M: f64 = 0.25;

/// A robot with 24 sonars and odometry that does not err, once around the hall.
pub(crate) struct SonarDrive {
    building: Building,
    drive: SimulatedDrive,
}

impl SonarDrive {
    pub(crate) fn through_the_hall() -> Self {
        let world = hall();
        let robot = Robot { odometry_error: OdometryError::NONE, ..Robot::INDOOR };
        let drive = SimulatedDrive::by_way_of(&world.building, robot, &world.tours[0], 3);
        Self { building: world.building, drive }
    }

    pub(crate) fn sensor() -> v1::Sensor {
        let ring = SonarRing::RING_24;
        let transducers = (0..ring.n_sonars).map(|at| pose(ring.robot_from_sonar(at)));
        let ring = v1::SonarRing {
            sensor_from_transducer: transducers.collect(),
            cone_angle_rad: ring.cone_rad,
            range_min_m: ring.range_min_m,
            range_max_m: ring.range_max_m,
        };
        v1::Sensor {
            id: RING.to_owned(),
            robot_from_sensor: None,
            kind: Some(v1::sensor::Kind::SonarRing(ring)),
        }
    }

    pub(crate) fn batches(&self) -> Vec<v1::Batch> {
        let mut rng = ChaCha8Rng::seed_from_u64(8);
        let mut observations = Vec::new();
        for (index, tick) in self.drive.ticks.iter().enumerate() {
            let mut of_tick = vec![observation(tick.stamp_ns, "", odometry_pose(tick.odometry))];
            if index.is_multiple_of(N_TICKS_PER_FIRING) {
                let ranges_m = SonarRing::RING_24.scan(&self.building, tick.truth, &mut rng);
                let firing = Kind::SonarScan(v1::SonarScan { ranges_m });
                of_tick.push(observation(tick.stamp_ns, RING, firing));
            }
            observations.push(of_tick);
        }
        let chunks = (1..).zip(observations.chunks(N_TICKS));
        chunks.map(|(number, chunk)| v1::Batch { number, observations: chunk.concat() }).collect()
    }

    fn n_firings(&self) -> usize {
        self.drive.ticks.len().div_ceil(N_TICKS_PER_FIRING)
    }

    /// Of the decided cells (below 0.3, above 0.7) of a grid that begins where the drive does, how many
    /// there are farther than `blur_m` from a wall's face and not deep in walls, and the share that is as
    /// the building has it.
    fn decided(&self, grid: &v1::Grid, blur_m: f64) -> (usize, f64) {
        let v1::Point { x_m, y_m } = grid.origin.expect("a corner");
        let width = grid.width as usize;
        let mut right = Vec::new();
        for (index, &percent) in grid.cells.iter().enumerate() {
            let (column, row) = ((index % width) as f64 + 0.5, (index / width) as f64 + 0.5);
            let at = Point2::new(x_m + column * grid.resolution_m, y_m + row * grid.resolution_m);
            let at = self.drive.building_from_start * at;
            match percent {
                _ if self.is_blurred(at, blur_m) || self.is_deep(at) => {}
                0..30 => right.push(!self.is_wall(at)),
                71..=100 => right.push(self.is_wall(at)),
                _ => {}
            }
        }
        let n_right = right.iter().filter(|&&is_right| is_right).count();
        (right.len(), n_right as f64 / right.len() as f64)
    }

    /// Beyond the drawing all is wall.
    fn is_wall(&self, at: Point2<f64>) -> bool {
        let info = self.building.info();
        let cell = info.frame.cell_at(at);
        info.index_of(cell).is_none() || self.building.is_wall(cell)
    }

    /// True within walls where no robot comes near: stray long echoes alone speak of it.
    fn is_deep(&self, at: Point2<f64>) -> bool {
        self.is_wall(at) && !self.is_blurred(at, DEPTH_M)
    }

    /// True if a place in a wall lies so near to free space, or the other way around.
    fn is_blurred(&self, at: Point2<f64>, blur_m: f64) -> bool {
        let sides = [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)];
        let beside = |(x, y): (f64, f64)| Point2::new(at.x + blur_m * x, at.y + blur_m * y);
        sides.into_iter().any(|side| self.is_wall(beside(side)) != self.is_wall(at))
    }
}

async fn a_room_is_heard<D: Door>(door: &D) {
    let heard = SonarDrive::through_the_hall();
    door.create_map("hall", 0.1).await.expect("a new map");
    let session = opened(door, opening("hall", "bat", &[SonarDrive::sensor()])).await;
    send(door, &session, &heard.batches()).await;
    let session = finished(door, &session).await;
    let request = v1::GetTrajectoryRequest { session: session.id.clone(), ..Default::default() };
    let (trajectory, _) = door.trajectory(request).await.expect("it is mapped");
    assert_eq!(trajectory.poses.len(), heard.n_firings(), "a pose a firing");
    assert_eq!(trajectory.origin, i32::from(v1::TrajectoryOrigin::Tracking), "by what was heard");
    for at in &trajectory.poses {
        assert_eq!(at.sensor_id, RING, "nothing else was sent");
        let v1::Pose { x_m, y_m, theta_rad } = at.pose.expect("a pose");
        let error_m = heard.drive.error_at_m(at.stamp_ns, Pose::new(x_m, y_m, theta_rad));
        assert!(error_m < ERROR_MAX_M, "{error_m} m off at {} ns", at.stamp_ns);
    }
    let grid = door.grid("hall", 0, None).await.expect("a grid");
    for (blur_m, share_min) in [(0.0, 0.88), (BLUR_M, 0.97)] {
        let (n_decided, share) = heard.decided(&grid, blur_m);
        println!(
            "{n_decided} cells decided more than {blur_m} m off faces of walls, {:.2} % rightly",
            100.0 * share
        );
        assert!(2000 < n_decided, "{n_decided} of some 4,500 cells of the hall are decided");
        assert!(share_min < share, "{share} of them rightly, {blur_m} m off faces");
    }
    let map = door.map("hall").await.expect("it was made");
    let job = door.create_job("hall").await.expect("it can be drawn again");
    job_done(door, &job.id).await;
    complete(door, &session.id).await;
    let again = door.grid("hall", 0, None).await.expect("a grid");
    assert!(map.latest_version < again.map_version, "a new version");
    assert!(again.cells == grid.cells, "drawn again it is the same, bit for bit");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_room_is_heard_over_grpc() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    a_room_is_heard(&service.grpc()).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_room_is_heard_over_rest() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    a_room_is_heard(&service.rest()).await;
}
