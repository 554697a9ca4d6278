//! A planar laser range finder that errs as real ones do.

use std::f64::consts::FRAC_PI_2;

use meetpoint_geometry::Pose;
use meetpoint_occupancy::LaserGeometry;
use rand::{Rng, RngExt};
use rand_distr::StandardNormal;

use crate::building::Building;

/// How a laser is built. Beam i points at `angle_min_rad + i * angle_increment_rad`,
/// counter-clockwise from its x axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Laser {
    /// Where it sits on the robot.
    pub robot_from_laser: Pose,
    /// Direction of beam 0, in radians.
    pub angle_min_rad: f64,
    /// From one beam to the next, in radians.
    pub angle_increment_rad: f64,
    /// Beams a scan.
    pub n_beams: u32,
    /// Nearer walls read as "too close", in metres.
    pub range_min_m: f64,
    /// Farther walls are not seen, in metres.
    pub range_max_m: f64,
    /// How its readings err.
    pub noise: LaserNoise,
}

/// How readings err. Shares are probabilities of a single reading; their sum is at most 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LaserNoise {
    /// Standard deviation of a right reading, in metres.
    pub range_std_m: f64,
    /// Share of readings anywhere within the range (cross-talk, mirrors).
    pub random_share: f64,
    /// Share of readings anywhere before the wall (people, dust).
    pub short_share: f64,
    /// Share of readings with no return (glass, black cloth).
    pub no_return_share: f64,
}

impl LaserNoise {
    /// A laser that never errs.
    pub const NONE: Self =
        Self { range_std_m: 0.0, random_share: 0.0, short_share: 0.0, no_return_share: 0.0 };

    /// An indoor laser in use: 1 cm, as data sheets of such lasers say, and three readings in a
    /// thousand that are wrong, mostly too short: walls of glass are rare and would be drawn open.
    pub const INDOOR: Self = Self {
        range_std_m: 0.01,
        random_share: 0.0002,
        short_share: 0.002,
        no_return_share: 0.0005,
    };
}

impl Laser {
    /// Half a turn in steps of one degree, as the lasers of the classic indoor logs; 20 m.
    pub const INDOOR: Self = Self {
        robot_from_laser: Pose { x_m: 0.1, y_m: 0.0, theta_rad: 0.0 },
        angle_min_rad: -FRAC_PI_2,
        angle_increment_rad: std::f64::consts::PI / 180.0,
        n_beams: 181,
        range_min_m: 0.05,
        range_max_m: 20.0,
        noise: LaserNoise::INDOOR,
    };

    /// How it scans, as a robot declares it.
    pub fn geometry(&self) -> LaserGeometry {
        let &Self { angle_min_rad, angle_increment_rad, n_beams, range_min_m, range_max_m, .. } =
            self;
        LaserGeometry { angle_min_rad, angle_increment_rad, n_beams, range_min_m, range_max_m }
    }

    /// One sweep from a robot at that pose of the building's frame: metres, one a beam; `+inf`
    /// where nothing came back and `-inf` where a wall is too close (REP 117).
    pub fn scan(&self, building: &Building, robot: Pose, rng: &mut impl Rng) -> Vec<f32> {
        let laser = robot * self.robot_from_laser;
        let beam = |index: u32| {
            let angle_rad = self.angle_min_rad + f64::from(index) * self.angle_increment_rad;
            let bearing_rad = laser.theta_rad + angle_rad;
            let wall_m = building.range_m(laser.position(), bearing_rad, self.range_max_m);
            self.reading(wall_m, rng)
        };
        (0..self.n_beams).map(beam).collect()
    }

    /// What the laser says of a wall at that distance, `None` being no wall within its range.
    #[expect(clippy::cast_possible_truncation, reason = "lasers answer in 32-bit floats")]
    fn reading(&self, wall_m: Option<f64>, rng: &mut impl Rng) -> f32 {
        let LaserNoise { range_std_m, random_share, short_share, no_return_share } = self.noise;
        let chance: f64 = rng.random();
        let anywhere_before = |end_m: f64, rng: &mut _| {
            let share: f64 = RngExt::random(rng);
            self.range_min_m + share * (end_m - self.range_min_m).max(0.0)
        };
        let range_m = match wall_m {
            _ if chance < random_share => anywhere_before(self.range_max_m, rng),
            _ if chance < random_share + no_return_share => f64::INFINITY,
            None => f64::INFINITY,
            Some(wall_m) if chance < random_share + no_return_share + short_share => {
                anywhere_before(wall_m, rng)
            }
            Some(wall_m) => wall_m + range_std_m * rng.sample::<f64, _>(StandardNormal),
        };
        if range_m < self.range_min_m {
            f32::NEG_INFINITY
        } else if self.range_max_m < range_m {
            f32::INFINITY
        } else {
            range_m as f32
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    fn corridor() -> Building {
        Building::from_drawing("##########\n          \n##########", 1.0).expect("a drawing")
    }

    #[test]
    fn a_laser_that_never_errs() {
        let laser = Laser {
            robot_from_laser: Pose::new(0.5, 0.0, 0.0),
            angle_increment_rad: FRAC_PI_2,
            n_beams: 3,
            noise: LaserNoise::NONE,
            ..Laser::INDOOR
        };
        let robot = Pose::new(4.0, 1.25, 0.0);
        let scan = laser.scan(&corridor(), robot, &mut ChaCha8Rng::seed_from_u64(1));
        assert!((scan[0] - 0.25).abs() < 1e-6, "{} to the right", scan[0]);
        assert_eq!(scan[1], f32::INFINITY, "the corridor is open ahead");
        assert!((scan[2] - 0.75).abs() < 1e-6, "{} to the left", scan[2]);
        let close = Laser { range_min_m: 0.3, ..laser };
        let scan = close.scan(&corridor(), robot, &mut ChaCha8Rng::seed_from_u64(1));
        assert_eq!(scan[0], f32::NEG_INFINITY, "too close");
    }

    #[test]
    fn errs_as_often_as_told() {
        let laser = Laser {
            n_beams: 20_000,
            angle_increment_rad: 0.0,
            noise: LaserNoise {
                range_std_m: 0.02,
                random_share: 0.1,
                short_share: 0.2,
                no_return_share: 0.3,
            },
            ..Laser::INDOOR
        };
        let robot = Pose::new(4.0, 1.5, 0.0);
        let scan = laser.scan(&corridor(), robot, &mut ChaCha8Rng::seed_from_u64(7));
        let share = |is: &dyn Fn(f32) -> bool| {
            scan.iter().filter(|&&range_m| is(range_m)).count() as f64 / scan.len() as f64
        };
        assert!((share(&|r| r == f32::INFINITY) - 0.3).abs() < 0.02, "no return");
        assert!(
            (share(&|r| (r - 0.5).abs() < 0.1) - 0.4).abs() < 0.07,
            "right, or short by little"
        );
        assert!((share(&|r| r.is_finite() && 0.6 < r) - 0.1).abs() < 0.02, "random");
        let right: Vec<f64> = scan
            .iter()
            .filter(|&&range_m| (range_m - 0.5).abs() < 0.05)
            .map(|&range_m| f64::from(range_m) - 0.5)
            .collect();
        let variance = right.iter().map(|error| error * error).sum::<f64>() / right.len() as f64;
        assert!((variance.sqrt() - 0.02).abs() < 0.003, "{} m is not 0.02 m", variance.sqrt());
    }
}
