//! Fifteen minutes of a robot in a building, and odometry that ends 11.5 m off.

use std::error::Error;

use meetpoint_geometry::{Point2, Pose};
use meetpoint_sim::{
    Building, ChaCha8Rng, Drive, Odometer, OdometryError, Robot, RoomParams, random_rooms,
};
use rand::{RngExt, SeedableRng};

/// The floor, in metres.
const FLOOR_M: (f64, f64) = (30.0, 20.0);
/// The robot stops after so long, in nanoseconds.
const DURATION_NS: i64 = 900_000_000_000;
/// It stands before it drives for so many ticks: five seconds.
const N_TICKS_STANDING: usize = 100;
/// Goals that it drives to, one after the other, at most.
const N_GOALS: usize = 80;
/// Goals lie so far off walls, in metres.
const CLEARANCE_M: f64 = 0.5;
/// What dead reckoning ends up wrong by, in metres (Fig. 5).
const ODOMETRY_ERROR_M: f64 = 11.5;
/// Draws of odometry to choose from.
const N_DRAWS: u64 = 8;
/// How it errs, times a factor.
const ERROR: OdometryError = OdometryError { scale: 1.005, ..OdometryError::UNCALIBRATED };

/// A moment of the travel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moment {
    pub(crate) stamp_ns: i64,
    /// In the building's frame.
    pub(crate) truth: Pose,
    /// In a frame that begins where the travel does.
    pub(crate) odometry: Pose,
}

/// A building and a way through it.
pub(crate) struct Travel {
    pub(crate) building: Building,
    pub(crate) moments: Vec<Moment>,
    /// How many times the odometry errs more than [`ERROR`].
    pub(crate) factor: f64,
    pub(crate) seed: u64,
}

impl Travel {
    pub(crate) fn new(seed: u64) -> Result<Self, Box<dyn Error>> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let building = random_rooms(FLOOR_M, &RoomParams::OFFICES, &mut rng)?;
        let goals = goals(&building, &mut rng);
        let robot = Robot {
            speed_max_m_per_s: 0.5,
            n_ticks_per_scan: u32::MAX,
            odometry_error: OdometryError::NONE,
            ..Robot::INDOOR
        };
        let drive = Drive::new(&building, robot, &goals, 0, rng).ok_or("no way between goals")?;
        let mut truths: Vec<Pose> = vec![drive.truth(); N_TICKS_STANDING];
        truths.extend(drive.map(|tick| tick.truth));
        let n = usize::try_from(DURATION_NS / robot.tick_ns)?;
        truths.truncate(n);
        let (factor, odometry) = odometry(&truths, seed);
        let moment = |(index, (&truth, odometry)): (usize, (&Pose, Pose))| Moment {
            stamp_ns: i64::try_from(index).unwrap_or(0) * robot.tick_ns,
            truth,
            odometry,
        };
        let moments = truths.iter().zip(odometry).enumerate().map(moment).collect();
        Ok(Self { building, moments, factor, seed })
    }

    pub(crate) fn length_m(&self) -> f64 {
        let step = |pair: &[Moment]| pair[0].truth.step_to(pair[1].truth).distance_m();
        self.moments.windows(2).map(step).sum()
    }

    /// Distance of a pose, in a frame that begins where the travel does, from the truth, in metres.
    pub(crate) fn error_m(&self, moment: &Moment, pose: Pose) -> f64 {
        let truth = self.moments[0].truth.inverse() * moment.truth;
        (truth.position() - pose.position()).norm()
    }

    pub(crate) fn odometry_error_m(&self) -> f64 {
        self.moments.last().map_or(0.0, |last| self.error_m(last, last.odometry))
    }
}

/// Places anywhere: the nearest of some new ones next, so that most of the building is seen before much of it
/// is seen again.
fn goals(building: &Building, rng: &mut ChaCha8Rng) -> Vec<Point2<f64>> {
    let mut goals = vec![free_place(building, rng)];
    let mut ahead: Vec<Point2<f64>> = (0..N_GOALS / 2).map(|_| free_place(building, rng)).collect();
    while !ahead.is_empty() {
        let here = goals[goals.len() - 1];
        let off = |at: &Point2<f64>| (at - here).norm();
        let nearest = (0..ahead.len()).min_by(|&a, &b| off(&ahead[a]).total_cmp(&off(&ahead[b])));
        goals.push(ahead.swap_remove(nearest.unwrap_or(0)));
    }
    goals.extend((0..N_GOALS / 2).map(|_| free_place(building, rng)));
    goals
}

fn free_place(building: &Building, rng: &mut ChaCha8Rng) -> Point2<f64> {
    loop {
        let (x_m, y_m) = (rng.random_range(0.0..FLOOR_M.0), rng.random_range(0.0..FLOOR_M.1));
        if building.is_free(Point2::new(x_m, y_m), CLEARANCE_M) {
            return Point2::new(x_m, y_m);
        }
    }
}

/// The draw of odometry and the factor at which dead reckoning ends [`ODOMETRY_ERROR_M`] off: of some draws that
/// with the factor nearest to 1, since a way that ends where it began may hide any error.
fn odometry(truths: &[Pose], seed: u64) -> (f64, Vec<Pose>) {
    let draws = (0..N_DRAWS).map(|draw| {
        let draw_seed = 1000 + N_DRAWS * seed + draw;
        let factor = factor(truths, draw_seed);
        (factor, draw_seed)
    });
    let off = |factor: f64| factor.ln().abs();
    let nearest = draws.min_by(|a, b| off(a.0).total_cmp(&off(b.0)));
    let (factor, draw_seed) = nearest.unwrap_or((1.0, seed));
    (factor, reckoned(truths, factor, draw_seed))
}

/// The least factor at which dead reckoning ends [`ODOMETRY_ERROR_M`] off.
fn factor(truths: &[Pose], draw_seed: u64) -> f64 {
    let error_m = |factor: f64| {
        let way = truths[0].step_to(truths[truths.len() - 1]);
        let reckoned = reckoned(truths, factor, draw_seed);
        (reckoned[reckoned.len() - 1].position() - way.position()).norm()
    };
    let mut high = 0.05;
    while error_m(high) < ODOMETRY_ERROR_M && high < 10.0 {
        high += 0.05;
    }
    let mut low = high - 0.05;
    for _ in 0..20 {
        let middle = f64::midpoint(low, high);
        if error_m(middle) < ODOMETRY_ERROR_M { low = middle } else { high = middle }
    }
    high
}

/// Dead reckoning along a way with so many times the error.
fn reckoned(truths: &[Pose], factor: f64, draw_seed: u64) -> Vec<Pose> {
    // Every other draw drifts to the other side.
    let side = if draw_seed.is_multiple_of(2) { 1.0 } else { -1.0 };
    let error = OdometryError {
        scale: 1.0 + factor * (ERROR.scale - 1.0),
        drift_rad_per_m: side * factor * ERROR.drift_rad_per_m,
        drift_rad_per_rad: factor * ERROR.drift_rad_per_rad,
        distance_std_m: factor * ERROR.distance_std_m,
        heading_std_rad: factor * ERROR.heading_std_rad,
        turn_std_rad: factor * ERROR.turn_std_rad,
    };
    let mut rng = ChaCha8Rng::seed_from_u64(draw_seed);
    let mut odometer = Odometer::new(error);
    let mut odometry = vec![Pose::IDENTITY];
    for pair in truths.windows(2) {
        odometer.count(pair[0].step_to(pair[1]), &mut rng);
        odometry.push(odometer.odometry_from_robot());
    }
    odometry
}
