//! A ring of sonars, a scan of it, and what the scan shows of one place.

use meetpoint_geometry::{Point2, Pose, angle_between, wrap_angle};

/// Transducers that look away from the robot.
#[derive(Clone, Debug, PartialEq)]
pub struct SonarRing {
    /// Where each transducer sits; its x axis is the middle of its cone.
    pub robot_from_transducer: Vec<Pose>,
    /// Angle of the whole cone, in radians.
    pub cone_rad: f64,
    /// Readings up to this mean that something is too close, in metres.
    pub range_min_m: f64,
    /// Readings from this on mean that nothing was heard, in metres.
    pub range_max_m: f64,
}

/// A firing of all transducers, seen from the robot's middle.
#[derive(Clone, Debug, PartialEq)]
pub struct SonarScan {
    /// By bearing, counter-clockwise from -π. Invariant: bearings are finite, echoes not NaN.
    echoes: Vec<Echo>,
}

/// What one transducer heard.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Echo {
    /// Direction of the cone's middle seen from the robot, in radians, in (-π, π].
    pub(super) bearing_rad: f64,
    /// Distance from the robot's middle to what was heard, along the bearing, in metres; infinite if
    /// nothing was.
    pub(super) distance_m: f64,
}

/// One place around a robot and the four transducers nearest to its bearing (T98, Fig. 2).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SonarView {
    /// Angle from the second of the four to the place as a share of the angle to the third, in 0..=1: what
    /// the paper's angle to the first is, whatever the number of transducers.
    pub share: f32,
    /// From the robot's middle to the place, in metres.
    pub distance_m: f32,
    /// From the robot's middle to what the four heard, clockwise first, in metres; infinite if nothing.
    pub echoes_m: [f32; 4],
}

/// Transducers farther apart than this leave a gap in which nothing is said, in radians.
const GAP_MAX_RAD: f64 = 0.8;

impl SonarRing {
    /// What the ring heard: metres, one a transducer, as REP 117. What is no reading (NaN, negative) is left
    /// out, as are readings beyond the number of transducers.
    pub fn scan(&self, ranges_m: &[f32]) -> SonarScan {
        let heard = self.robot_from_transducer.iter().zip(ranges_m);
        let echoes = heard.filter_map(|(transducer, &range_m)| {
            let range_m = f64::from(range_m);
            let outward = |range_m: f64| {
                let (sin, cos) = transducer.theta_rad.sin_cos();
                range_m + transducer.x_m * cos + transducer.y_m * sin
            };
            let distance_m = if range_m.is_nan() || (range_m < 0.0 && range_m.is_finite()) {
                return None;
            } else if self.range_max_m <= range_m {
                f64::INFINITY
            } else {
                outward(range_m.max(self.range_min_m))
            };
            let bearing_rad = wrap_angle(transducer.theta_rad);
            (transducer.is_finite() && !distance_m.is_nan())
                .then_some(Echo { bearing_rad, distance_m })
        });
        let mut echoes: Vec<Echo> = echoes.collect();
        echoes.sort_by(|a, b| a.bearing_rad.total_cmp(&b.bearing_rad));
        SonarScan { echoes }
    }
}

impl SonarScan {
    /// What is heard of a place of the robot's frame; `None` where no transducer looks.
    #[expect(clippy::cast_possible_truncation, reason = "networks compute in 32-bit floats")]
    pub fn view(&self, place: Point2<f64>) -> Option<SonarView> {
        let bearing_rad = place.y.atan2(place.x);
        let (second, share) = self.second(bearing_rad)?;
        let n = self.echoes.len();
        let echo_m = |step: usize| self.echoes[(second + n - 1 + step) % n].distance_m as f32;
        Some(SonarView {
            share: share as f32,
            distance_m: place.coords.norm() as f32,
            echoes_m: std::array::from_fn(echo_m),
        })
    }

    /// The transducer clockwise of a bearing, and how far the bearing is on the way to the next.
    fn second(&self, bearing_rad: f64) -> Option<(usize, f64)> {
        let n = self.echoes.len();
        if n < 2 {
            return None;
        }
        let after = self.echoes.partition_point(|echo| echo.bearing_rad <= bearing_rad);
        let (second, third) = ((after + n - 1) % n, after % n);
        let gap_rad = forward_rad(self.echoes[second].bearing_rad, self.echoes[third].bearing_rad);
        if GAP_MAX_RAD < gap_rad || gap_rad <= 0.0 {
            return None;
        }
        let share = forward_rad(self.echoes[second].bearing_rad, bearing_rad) / gap_rad;
        Some((second, share.clamp(0.0, 1.0)))
    }

    /// The transducer whose cone's middle is nearest to a bearing, and the angle between them.
    pub(super) fn nearest(&self, bearing_rad: f64) -> Option<(Echo, f64)> {
        let off = |echo: &Echo| angle_between(echo.bearing_rad, bearing_rad).abs();
        let nearest = self.echoes.iter().min_by(|a, b| off(a).total_cmp(&off(b)))?;
        Some((*nearest, off(nearest)))
    }
}

/// The way counter-clockwise from one direction to another, in radians, in [0, 2π).
fn forward_rad(from_rad: f64, to_rad: f64) -> f64 {
    (to_rad - from_rad).rem_euclid(std::f64::consts::TAU)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    fn ring(n: u32) -> SonarRing {
        let at = |index: u32| {
            let bearing_rad = TAU * f64::from(index) / f64::from(n);
            Pose::new(0.2 * bearing_rad.cos(), 0.2 * bearing_rad.sin(), bearing_rad)
        };
        SonarRing {
            robot_from_transducer: (0..n).map(at).collect(),
            cone_rad: 0.26,
            range_min_m: 0.15,
            range_max_m: 6.0,
        }
    }

    #[test]
    fn four_neighbours_in_their_order() {
        let ranges_m: Vec<f32> = (0_u8..8).map(|index| 1.0 + f32::from(index)).collect();
        let scan = ring(8).scan(&ranges_m);
        // A little counter-clockwise of transducer 1, which looks ahead to the left.
        let view = scan.view(Point2::new(0.9, 1.1)).expect("heard all around");
        assert_eq!(view.echoes_m, [1.2, 2.2, 3.2, 4.2], "transducers 0 to 3, from the middle");
        assert!(0.0 < view.share && view.share < 0.3, "{} past the second", view.share);
        let behind = scan.view(Point2::new(-2.0, -0.1)).expect("heard all around");
        assert_eq!(behind.echoes_m, [4.2, 5.2, f32::INFINITY, f32::INFINITY], "past the seam");
    }

    #[test]
    fn nothing_is_said_where_nobody_looks() {
        let mut front = ring(8);
        front.robot_from_transducer.truncate(3);
        let scan = front.scan(&[2.0; 3]);
        assert!(scan.view(Point2::new(1.0, 0.5)).is_some(), "between two transducers");
        assert!(scan.view(Point2::new(-1.0, -0.5)).is_none(), "behind");
        assert!(ring(1).scan(&[2.0]).view(Point2::new(1.0, 0.0)).is_none(), "one is no ring");
    }

    #[test]
    fn readings_follow_rep_117() {
        let wrong = [f32::NAN, -1.0, f32::NEG_INFINITY, 6.0, 81.0, 1.0, 1.0, 1.0];
        let scan = ring(8).scan(&wrong);
        assert_eq!(scan.echoes.len(), 6, "what is no reading is left out");
        let (close, _) = scan.nearest(TAU / 4.0).expect("echoes");
        assert!((close.distance_m - 0.35).abs() < 1e-9, "too close is as close as can be");
        let (nothing, _) = scan.nearest(3.0 * TAU / 8.0).expect("echoes");
        assert!(nothing.distance_m.is_infinite(), "from the end of the range on");
    }
}
