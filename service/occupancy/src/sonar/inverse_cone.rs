//! The classic inverse model of a sonar: each cone by itself.
//!
//! ```text
//! r < R - e        free        log-odds fall with (1 - (a / half cone)²) (1 - r / range)
//! |r - R| <= e     occupied    log-odds rise with the same
//! R + e < r        nothing is said
//! ```
//!
//! for a place at distance r and angle a off the cone's middle, and an echo at distance R. H. Moravec and
//! A. Elfes, "High resolution maps from wide angle sonar", ICRA (1985): the baseline that the network
//! is measured against.

use meetpoint_geometry::Point2;

use super::ring::{SonarRing, SonarScan};

/// How much a cone is believed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InverseCone {
    /// Most that is taken from the log-odds before an echo, dimensionless.
    pub log_odds_free: f32,
    /// Most that is added to the log-odds at an echo, dimensionless.
    pub log_odds_occupied: f32,
    /// Half the thickness of what an echo may come from, in metres.
    pub half_depth_m: f64,
    /// Echoes from farther are not believed, in metres.
    pub range_max_m: f64,
}

impl InverseCone {
    /// Numbers as they are used with such rings.
    pub const CLASSIC: Self =
        Self { log_odds_free: 1.5, log_odds_occupied: 1.5, half_depth_m: 0.15, range_max_m: 4.0 };

    /// What a scan adds to the log-odds of a place of the robot's frame: 0 if it says nothing of it.
    #[expect(clippy::cast_possible_truncation, reason = "evidence is kept in 32-bit floats")]
    pub fn evidence(&self, ring: &SonarRing, scan: &SonarScan, place: Point2<f64>) -> f32 {
        let Some((echo, off_rad)) = scan.nearest(place.y.atan2(place.x)) else { return 0.0 };
        let (distance_m, half_rad) = (place.coords.norm(), ring.cone_rad / 2.0);
        if half_rad < off_rad || self.range_max_m < distance_m {
            return 0.0;
        }
        let sure = (1.0 - (off_rad / half_rad).powi(2)) * (1.0 - distance_m / self.range_max_m);
        let beyond_m = distance_m - echo.distance_m;
        if beyond_m < -self.half_depth_m {
            -self.log_odds_free * sure as f32
        } else if beyond_m <= self.half_depth_m && echo.distance_m <= self.range_max_m {
            self.log_odds_occupied * sure as f32
        } else {
            0.0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use meetpoint_geometry::Pose;

    #[test]
    fn free_before_the_echo_occupied_at_it_and_nothing_behind() {
        let ring = SonarRing {
            robot_from_transducer: vec![Pose::IDENTITY],
            cone_rad: 0.5,
            range_min_m: 0.1,
            range_max_m: 6.0,
        };
        let scan = ring.scan(&[2.0]);
        let evidence =
            |x_m, y_m| InverseCone::CLASSIC.evidence(&ring, &scan, Point2::new(x_m, y_m));
        assert!(evidence(1.0, 0.0) < -1.0, "before it");
        assert!(evidence(1.0, 0.0) < evidence(1.0, 0.2), "surest in the middle of the cone");
        assert!(0.5 < evidence(2.05, 0.0), "at it");
        assert_eq!(evidence(2.5, 0.0), 0.0, "behind");
        assert_eq!(evidence(1.0, 0.5), 0.0, "beside the cone");
    }
}
