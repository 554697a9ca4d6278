//! What robots send in the scenarios: simulated drives, and observations made by hand.

use meetpoint_client::v1;
use meetpoint_geometry::{Point2, Pose};
use meetpoint_sim::{
    Building, ChaCha8Rng, Drive, Laser, OdometryError, Robot, Tick, World, corridor_loop, hall,
};
use rand::SeedableRng;
use v1::ingest_batch_request::Kind as Upload;
use v1::observation::Kind;

use crate::door::Door;

/// Name of the laser within a session.
pub(crate) const LASER: &str = "laser";
/// Name of the camera within a session.
const CAMERA: &str = "camera";
/// Beacons in the hall, in the building's frame, in metres.
const BEACONS_M: [[f64; 2]; 3] = [[0.5, 0.5], [7.5, 1.0], [4.0, 5.5]];
/// The robot's clock at the start, nanoseconds; fixed, so that every run has the same bits.
pub(crate) const START_NS: i64 = 1_767_225_600_000_000_000;
/// Nanoseconds in a second.
pub(crate) const SECOND_NS: i64 = 1_000_000_000;

/// A drive through the hall, 8 m by 6 m, once around; or through a corridor about a block.
pub(crate) struct SimulatedDrive {
    pub(crate) sensor: v1::Sensor,
    pub(crate) ticks: Vec<Tick>,
    /// The true pose at the start, in the building's frame.
    pub(crate) building_from_start: Pose,
}

/// Odometry, as a robot reports it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Odometry {
    Poses,
    Velocities,
}

impl SimulatedDrive {
    pub(crate) fn through_the_hall(seed: u64) -> Self {
        Self::through(&hall(), Robot::INDOOR, seed)
    }

    /// Once around the block and one side more: 68 m, with odometry that drifts by a degree in two
    /// metres, and a scan every fifth of a second.
    pub(crate) fn around_the_block(seed: u64) -> Self {
        let odometry_error =
            OdometryError { drift_rad_per_m: 0.009, ..OdometryError::UNCALIBRATED };
        let robot = Robot { n_ticks_per_scan: 4, odometry_error, ..Robot::INDOOR };
        Self::through(&corridor_loop(), robot, seed)
    }

    /// Around a block of 60 m by 20 m and on around two corners, with odometry that drifts by a degree in two metres,
    /// and a scan every fifth of a second.
    pub(crate) fn around_a_large_block(seed: u64) -> Self {
        let odometry_error =
            OdometryError { drift_rad_per_m: 0.009, ..OdometryError::UNCALIBRATED };
        let robot = Robot { n_ticks_per_scan: 4, odometry_error, ..Robot::INDOOR };
        let building = Building::from_drawing(&large_block(), LARGE_EDGE_M).expect("a drawing");
        let tour = [(10.0, 1.25), (58.75, 1.25), (58.75, 18.75), (1.25, 18.75), (1.25, 1.25)];
        let on = [(58.75, 1.25), (58.75, 18.75), (30.0, 18.75)];
        let tour = tour.iter().chain(&on).map(|&(x_m, y_m)| Point2::new(x_m, y_m));
        Self::through(&World { building, tours: vec![tour.collect()] }, robot, seed)
    }

    fn through(world: &World, robot: Robot, seed: u64) -> Self {
        Self::by_way_of(&world.building, robot, &world.tours[0], seed)
    }

    /// From the first of these places, by way of the others, to the last.
    pub(crate) fn by_way_of(
        building: &Building,
        robot: Robot,
        places: &[Point2<f64>],
        seed: u64,
    ) -> Self {
        let rng = ChaCha8Rng::seed_from_u64(seed);
        let drive = Drive::new(building, robot, places, START_NS, rng);
        let drive = drive.expect("the building's tour can be driven");
        let building_from_start = drive.truth();
        Self { sensor: laser(&robot.laser), building_from_start, ticks: drive.collect() }
    }

    /// Number of scans.
    pub(crate) fn n_scans(&self) -> usize {
        self.ticks.iter().filter(|tick| tick.scan.is_some()).count()
    }

    /// In batches of so many ticks, of which every other has a scan.
    pub(crate) fn batches(&self, n_ticks: usize) -> Vec<v1::Batch> {
        self.batches_with(n_ticks, Odometry::Poses)
    }

    pub(crate) fn batches_with(&self, n_ticks: usize, odometry: Odometry) -> Vec<v1::Batch> {
        let observations: Vec<Vec<v1::Observation>> = (0..self.ticks.len())
            .map(|index| {
                let tick = &self.ticks[index];
                let pose = match odometry {
                    Odometry::Poses => odometry_pose(tick.odometry),
                    Odometry::Velocities => velocity(tick, self.ticks.get(index + 1)),
                };
                let scan = tick.scan.clone().map(laser_scan);
                let scan = scan.map(|scan| observation(tick.stamp_ns, LASER, scan));
                std::iter::once(observation(tick.stamp_ns, "", pose)).chain(scan).collect()
            })
            .collect();
        let chunks = (1..).zip(observations.chunks(n_ticks));
        chunks.map(|(number, chunk)| v1::Batch { number, observations: chunk.concat() }).collect()
    }

    /// A camera that sees beacons all about it.
    pub(crate) fn beacon_detector() -> v1::Sensor {
        let half_field_of_view_rad = std::f64::consts::PI;
        let detector = v1::LandmarkDetector { range_max_m: 20.0, half_field_of_view_rad };
        v1::Sensor {
            id: CAMERA.to_owned(),
            robot_from_sensor: None,
            kind: Some(v1::sensor::Kind::LandmarkDetector(detector)),
        }
    }

    /// The same with a beacon seen every 40 ticks, one after the other.
    pub(crate) fn batches_with_beacons(&self, n_ticks: usize) -> Vec<v1::Batch> {
        let mut batches = self.batches(n_ticks);
        for (index, tick) in self.ticks.iter().enumerate().step_by(40) {
            let beacon = index / 40 % BEACONS_M.len();
            let [x_m, y_m] = BEACONS_M[beacon];
            let seen = tick.truth.inverse() * Point2::new(x_m, y_m);
            let sighting = v1::LandmarkSighting {
                identity: Some(format!("beacon {beacon}")),
                landmark_type: "beacon".to_owned(),
                bearing_rad: Some(seen.y.atan2(seen.x)),
                range_m: Some(seen.coords.norm()),
            };
            let sighting = observation(tick.stamp_ns, CAMERA, Kind::LandmarkSighting(sighting));
            batches[index / n_ticks].observations.push(sighting);
        }
        batches
    }

    /// How far a place in the map's frame is from the beacon of that name, in metres.
    pub(crate) fn beacon_error_m(&self, name: Option<&str>, at: Point2<f64>) -> f64 {
        let is_meant = |index: usize| name == Some(&format!("beacon {index}"));
        let beacon = (0..BEACONS_M.len()).find(|&index| is_meant(index)).expect("a beacon's name");
        self.error_m(BEACONS_M[beacon], [at.x, at.y])
    }

    /// How far a place in the map's frame is from one in the building's, in metres.
    pub(crate) fn error_m(&self, truth_m: [f64; 2], at_m: [f64; 2]) -> f64 {
        let [truth, at] = [truth_m, at_m].map(|[x_m, y_m]| Point2::new(x_m, y_m));
        (self.building_from_start.inverse() * truth - at).norm()
    }

    /// How far a pose in the map's frame is from where the robot truly was at a stamp, in metres.
    pub(crate) fn error_at_m(&self, stamp_ns: i64, map_from_robot: Pose) -> f64 {
        let tick = self.ticks.iter().find(|tick| tick.stamp_ns == stamp_ns).expect("of the drive");
        let truth = self.building_from_start.inverse() * tick.truth;
        truth.step_to(map_from_robot).distance_m()
    }

    /// The same of the scans alone, where other observations have poses too.
    pub(crate) fn mean_errors_m_of_scans(&self, trajectory: &v1::Trajectory) -> (f64, f64) {
        let mut scans = trajectory.clone();
        scans.poses.retain(|pose| pose.sensor_id == LASER);
        self.mean_errors_m(&scans)
    }

    /// The mean distance of a trajectory from the truth, in metres, and of odometry alone.
    /// The session began at the map's origin, or in a frame of its own.
    pub(crate) fn mean_errors_m(&self, trajectory: &v1::Trajectory) -> (f64, f64) {
        let scans: Vec<&Tick> = self.ticks.iter().filter(|tick| tick.scan.is_some()).collect();
        assert_eq!(scans.len(), trajectory.poses.len(), "a pose a scan");
        let (mut estimated_m, mut odometry_m) = (0.0, 0.0);
        for (tick, pose) in scans.iter().zip(&trajectory.poses) {
            assert_eq!(tick.stamp_ns, pose.stamp_ns, "in the order of the scans");
            let truth = self.building_from_start.inverse() * tick.truth;
            let v1::Pose { x_m, y_m, theta_rad } = pose.pose.expect("every pose is there");
            estimated_m += truth.step_to(Pose::new(x_m, y_m, theta_rad)).distance_m();
            odometry_m += truth.step_to(tick.odometry).distance_m();
        }
        (estimated_m / scans.len() as f64, odometry_m / scans.len() as f64)
    }
}

/// Edge of a character of the large block, in metres.
const LARGE_EDGE_M: f64 = 0.25;

/// Where the niches of a side begin, at distances that do not repeat.
fn niches(is_first_side: bool) -> impl Iterator<Item = usize> {
    let offset = if is_first_side { 0 } else { 5 };
    [15, 26, 44, 51, 73, 89, 97, 120, 134, 141, 168, 175, 197, 211]
        .into_iter()
        .map(move |at| at + offset)
}

/// A corridor of 2 m around a block, with niches for doors here and there.
fn large_block() -> String {
    let (width, height, corridor) = (240, 80, 9);
    let cell = |column: usize, row: usize| {
        let is_end = row == 0 || row + 1 == height || column == 0 || column + 1 == width;
        let is_block = (corridor..width - corridor).contains(&column)
            && (corridor..height - corridor).contains(&row);
        let is_front = row == corridor || row + corridor + 1 == height;
        let is_niche =
            is_front && niches(row == corridor).any(|from| (from..from + 4).contains(&column));
        if is_end || (is_block && !is_niche) { '#' } else { '.' }
    };
    let row = |row: usize| (0..width).map(|column| cell(column, row)).collect::<String>();
    (0..height).map(row).collect::<Vec<_>>().join("\n")
}

/// The velocities that lead from one tick's odometry to the next one's.
fn velocity(tick: &Tick, next: Option<&Tick>) -> Kind {
    let Some(next) = next else {
        return Kind::OdometryVelocity(v1::OdometryVelocity::default());
    };
    let seconds = (next.stamp_ns - tick.stamp_ns) as f64 / SECOND_NS as f64;
    let step = tick.odometry.step_to(next.odometry);
    // The chord of an arc of angle a is seen at a/2 from its beginning and is 2 sin(a/2)/a of it.
    let half_rad = 0.5 * step.theta_rad;
    let arc = if half_rad.abs() < 1e-9 { 1.0 } else { half_rad / half_rad.sin() };
    let (sin, cos) = half_rad.sin_cos();
    Kind::OdometryVelocity(v1::OdometryVelocity {
        forward_m_per_s: arc * (cos * step.x_m + sin * step.y_m) / seconds,
        left_m_per_s: arc * (cos * step.y_m - sin * step.x_m) / seconds,
        turn_rad_per_s: step.theta_rad / seconds,
    })
}

pub(crate) fn pose(pose: Pose) -> v1::Pose {
    v1::Pose { x_m: pose.x_m, y_m: pose.y_m, theta_rad: pose.theta_rad }
}

pub(crate) fn odometry_pose(odometry_from_robot: Pose) -> Kind {
    Kind::OdometryPose(v1::OdometryPose { odometry_from_robot: Some(pose(odometry_from_robot)) })
}

pub(crate) fn laser_scan(ranges_m: Vec<f32>) -> Kind {
    Kind::LaserScan(v1::LaserScan { ranges_m, intensities: Vec::new() })
}

pub(crate) fn observation(stamp_ns: i64, sensor_id: &str, kind: Kind) -> v1::Observation {
    let sensor_id = sensor_id.to_owned();
    v1::Observation { stamp_ns, monotonic_ns: None, sensor_id, kind: Some(kind) }
}

/// A batch with a mark: the smallest that says something. Marks carry `label`.
pub(crate) fn mark(number: u64, label: &str) -> v1::Batch {
    let stamp_ns = START_NS + SECOND_NS * i64::try_from(number).expect("a small number");
    let kind = Kind::Mark(v1::Mark { label: label.to_owned() });
    v1::Batch { number, observations: vec![observation(stamp_ns, "", kind)] }
}

/// The simulated laser as a session declares it.
pub(crate) fn laser(laser: &Laser) -> v1::Sensor {
    let geometry = v1::LaserGeometry {
        angle_min_rad: laser.angle_min_rad,
        angle_increment_rad: laser.angle_increment_rad,
        n_beams: laser.n_beams,
        range_min_m: laser.range_min_m,
        range_max_m: laser.range_max_m,
    };
    v1::Sensor {
        id: LASER.to_owned(),
        robot_from_sensor: Some(pose(laser.robot_from_laser)),
        kind: Some(v1::sensor::Kind::Laser(geometry)),
    }
}

/// A session that begins at the map's origin.
pub(crate) fn opening(map: &str, robot: &str, sensors: &[v1::Sensor]) -> v1::OpenSessionRequest {
    v1::OpenSessionRequest {
        map: map.to_owned(),
        robot: robot.to_owned(),
        client_key: format!("{robot} on {map}"),
        epoch: 1,
        start: None,
        sensors: sensors.to_vec(),
        delivery: v1::Delivery::Complete.into(),
    }
}

/// Opens a session that has to be new or resumed without complaint.
pub(crate) async fn opened<D: Door>(door: &D, request: v1::OpenSessionRequest) -> v1::Session {
    let reply = door.open(request).await.expect("a good request");
    reply.session.expect("a session")
}

/// Makes a map, opens a session with a laser and sends batches, one after the other.
pub(crate) async fn driven<D: Door>(
    door: &D,
    map: &str,
    drive: &SimulatedDrive,
    batches: &[v1::Batch],
) -> v1::Session {
    door.create_map(map, 0.05).await.expect("a new map");
    let request = opening(map, "rover", std::slice::from_ref(&drive.sensor));
    let session = opened(door, request).await;
    send(door, &session, batches).await;
    session
}

/// Sends batches, one after the other, none of which is to be refused or have rejections.
pub(crate) async fn send<D: Door>(door: &D, session: &v1::Session, batches: &[v1::Batch]) {
    for batch in batches {
        let ack = door.upload(&session.id, session.epoch, Upload::Batch(batch.clone())).await;
        let ack = ack.expect("a good batch");
        assert_eq!(ack.acked_through, batch.number, "cumulative");
        assert_eq!(ack.rejected, [], "nothing is wrong with it");
    }
}
