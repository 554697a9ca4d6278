//! A ring of sonars that errs as real ones do.
//!
//! The main cone of a sonar is a fan of five rays. Each reports, by lot,
//!
//! ```text
//! anywhere before the wall      with P(short)                              (echoes, cross-talk)
//! anywhere beyond the wall      with P(long) = least + (most - least) / (1 + e^-(a - turn) / spread)
//! the distance to the wall      otherwise
//! ```
//!
//! where `a` is the angle between the ray and the normal of what it hits: a smooth wall throws the
//! sound of a slanting ray away. The sonar reports the shortest of the five. S. Thrun, "Learning
//! metric-topological maps for indoor mobile robot navigation", Artificial Intelligence 99 (1998),
//! footnote 3; the paper does not print the probabilities.

use std::f64::consts::TAU;

use meetpoint_geometry::Pose;
use rand::{Rng, RngExt};
use rand_distr::StandardNormal;

use crate::building::Building;
use crate::ray::Hit;

/// Rays that a cone is made of (footnote 3).
const N_RAYS: u32 = 5;

/// How a ring is built: sonars evenly around the robot, each looking outward, sonar 0 ahead and the
/// others counter-clockwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SonarRing {
    /// Sonars around the robot.
    pub n_sonars: u32,
    /// Radius of the circle that they sit on, in metres.
    pub radius_m: f64,
    /// Angle of the whole main cone, in radians.
    pub cone_rad: f64,
    /// Nearer walls read as "too close", in metres.
    pub range_min_m: f64,
    /// Farther walls are not heard, in metres.
    pub range_max_m: f64,
    /// How its readings err.
    pub noise: SonarNoise,
}

/// How the rays of a cone err. Shares are probabilities of a single ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SonarNoise {
    /// Standard deviation of a right reading, in metres.
    pub range_std_m: f64,
    /// Share of rays that return from before the wall.
    pub short_share: f64,
    /// Share of head-on rays that return too late or never.
    pub long_share_least: f64,
    /// The same of rays that graze the wall.
    pub long_share_most: f64,
    /// Angle of incidence at which half of the difference is reached, in radians.
    pub turn_rad: f64,
    /// How gradually that goes, in radians.
    pub spread_rad: f64,
}

impl SonarNoise {
    /// Sonars that never err.
    pub const NONE: Self = Self {
        range_std_m: 0.0,
        short_share: 0.0,
        long_share_least: 0.0,
        long_share_most: 0.0,
        turn_rad: 1.0,
        spread_rad: 1.0,
    };

    /// Painted walls and wood: ranging modules see them head-on and to some 25 degrees aslant; of a
    /// hundred cones two return from before the wall.
    pub const INDOOR: Self = Self {
        range_std_m: 0.02,
        short_share: 0.004,
        long_share_least: 0.02,
        long_share_most: 0.98,
        turn_rad: 0.44,
        spread_rad: 0.07,
    };
}

impl SonarRing {
    /// 24 sonars every 15 degrees, as the paper's robots had.
    pub const RING_24: Self = Self {
        n_sonars: 24,
        radius_m: 0.26,
        cone_rad: 15.0 * TAU / 360.0,
        range_min_m: 0.15,
        range_max_m: 6.0,
        noise: SonarNoise::INDOOR,
    };

    /// 16 sonars every 22.5 degrees, as the smaller ones had.
    pub const RING_16: Self = Self { n_sonars: 16, radius_m: 0.18, ..Self::RING_24 };

    /// Where a sonar sits on the robot; its x axis is the middle of its cone.
    pub fn robot_from_sonar(&self, index: u32) -> Pose {
        let bearing_rad = TAU * f64::from(index) / f64::from(self.n_sonars.max(1));
        let (sin, cos) = bearing_rad.sin_cos();
        Pose::new(self.radius_m * cos, self.radius_m * sin, bearing_rad)
    }

    /// One firing of all sonars from a robot at that pose of the building's frame: metres, one a
    /// sonar; `+inf` where nothing came back and `-inf` where a wall is too close (REP 117).
    pub fn scan(&self, building: &Building, robot: Pose, rng: &mut impl Rng) -> Vec<f32> {
        let cone = |index: u32| self.reading(building, robot * self.robot_from_sonar(index), rng);
        (0..self.n_sonars).map(cone).collect()
    }

    /// The shortest that the rays of a cone report.
    #[expect(clippy::cast_possible_truncation, reason = "sonars answer in 32-bit floats")]
    fn reading(&self, building: &Building, sonar: Pose, rng: &mut impl Rng) -> f32 {
        let mut range_m = f64::INFINITY;
        for ray in 0..N_RAYS {
            let share = f64::from(ray) / f64::from(N_RAYS - 1) - 0.5;
            let bearing_rad = sonar.theta_rad + share * self.cone_rad;
            let hit = building.hit(sonar.position(), bearing_rad, self.range_max_m);
            range_m = range_m.min(self.ray_m(hit, rng));
        }
        if range_m < self.range_min_m {
            f32::NEG_INFINITY
        } else if self.range_max_m < range_m {
            f32::INFINITY
        } else {
            range_m as f32
        }
    }

    /// What one ray reports, in metres; `+inf` if nothing.
    fn ray_m(&self, hit: Option<Hit>, rng: &mut impl Rng) -> f64 {
        let noise = &self.noise;
        let chance: f64 = rng.random();
        let share: f64 = rng.random();
        let between = |from_m: f64, to_m: f64| from_m + share * (to_m - from_m).max(0.0);
        let wall_m = hit.map_or(self.range_max_m, |hit| hit.range_m);
        if chance < noise.short_share {
            return between(self.range_min_m, wall_m);
        }
        let Some(hit) = hit else { return f64::INFINITY };
        if chance < noise.short_share + noise.long_share(hit.incidence_rad) {
            // As far again as the farthest: half of these never come back.
            return between(wall_m, 2.0 * self.range_max_m - wall_m);
        }
        wall_m + noise.range_std_m * rng.sample::<f64, _>(StandardNormal)
    }
}

impl SonarNoise {
    /// Share of rays under that angle of incidence that return too late or never.
    pub fn long_share(&self, incidence_rad: f64) -> f64 {
        let turned = 1.0 / (1.0 + (-(incidence_rad - self.turn_rad) / self.spread_rad).exp());
        self.long_share_least + (self.long_share_most - self.long_share_least) * turned
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    fn corridor() -> Building {
        let wall = "#".repeat(40);
        let free = " ".repeat(40);
        let drawing = format!("{wall}\n{free}\n{free}\n{wall}");
        Building::from_drawing(&drawing, 1.0).expect("a drawing")
    }

    /// The robot in the middle of the corridor, one metre off both walls, along it.
    const IN_CORRIDOR: Pose = Pose { x_m: 20.0, y_m: 2.0, theta_rad: 0.0 };

    #[test]
    fn a_ring_that_never_errs_hears_the_nearest_wall_of_each_cone() {
        let ring = SonarRing { radius_m: 0.0, noise: SonarNoise::NONE, ..SonarRing::RING_24 };
        let scan = ring.scan(&corridor(), IN_CORRIDOR, &mut ChaCha8Rng::seed_from_u64(1));
        assert_eq!(scan.len(), 24, "one a sonar");
        assert!((scan[6] - 1.0).abs() < 1e-6, "{} to the left, head-on", scan[6]);
        assert!((scan[18] - 1.0).abs() < 1e-6, "{} to the right", scan[18]);
        // A cone at 45 degrees: its steepest ray goes up at 52.5.
        let steepest_m = 1.0 / 52.5_f64.to_radians().sin();
        assert!((f64::from(scan[3]) - steepest_m).abs() < 1e-5, "{} ahead to the left", scan[3]);
        let ahead_m = 1.0 / 7.5_f64.to_radians().sin();
        assert!(6.0 < ahead_m, "the corridor's walls are beyond hearing");
        assert_eq!(scan[0], f32::INFINITY, "nothing ahead");
        let close = SonarRing { range_min_m: 1.5, ..ring };
        let scan = close.scan(&corridor(), IN_CORRIDOR, &mut ChaCha8Rng::seed_from_u64(1));
        assert_eq!(scan[6], f32::NEG_INFINITY, "too close");
    }

    #[test]
    fn walls_are_heard_head_on_and_missed_aslant() {
        const N: i32 = 4000;
        let ring = SonarRing { radius_m: 0.0, ..SonarRing::RING_24 };
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let (mut n_right, mut n_short, mut n_long_aslant) = (0, 0, 0);
        for _ in 0..N {
            let scan = ring.scan(&corridor(), IN_CORRIDOR, &mut rng);
            n_right += i32::from((scan[6] - 1.0).abs() < 0.1);
            n_short += i32::from(scan[6] < 0.9);
            n_long_aslant += i32::from(1.8 < scan[2]);
        }
        let share = |n: i32| f64::from(n) / f64::from(N);
        // Each of the five rays returns early with 0.4 %, mostly by more than a tenth.
        assert!((share(n_short) - 0.018).abs() < 0.008, "{} short", share(n_short));
        assert!(0.96 < share(n_right), "{} right head-on", share(n_right));
        assert!(0.8 < share(n_long_aslant), "{} beyond the slanting wall", share(n_long_aslant));
    }

    #[test]
    fn errs_by_the_angle_of_incidence() {
        let noise = SonarNoise::INDOOR;
        assert!(noise.long_share(0.0) < 0.03, "head-on");
        assert!((noise.long_share(noise.turn_rad) - 0.5).abs() < 1e-9, "half way");
        assert!(0.97 < noise.long_share(1.2), "grazing");
    }

    #[test]
    fn sixteen_or_twenty_four_all_around() {
        let left = SonarRing::RING_16.robot_from_sonar(4);
        assert!(left.x_m.abs() < 1e-12 && (left.y_m - 0.18).abs() < 1e-12, "{left:?}");
        let behind = SonarRing::RING_24.robot_from_sonar(12);
        assert!((behind.x_m + 0.26).abs() < 1e-12, "{behind:?}");
    }
}
