//! A person, as a robot's sensors see one: a disc.

use meetpoint_geometry::{Point2, Vector2};

use crate::ray::Hit;

/// Somebody who stands or walks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Person {
    /// Where, in the building's frame, in metres.
    pub position: Point2<f64>,
    /// Radius of the disc, in metres.
    pub radius_m: f64,
}

impl Person {
    /// Radius of the legs and hips of a person who walks, in metres.
    pub const RADIUS_M: f64 = 0.2;

    /// Where a ray of unit `direction` enters the disc; at 0 from within, `None` if it passes by.
    ///
    /// With `c` from the ray's start to the disc's middle, the ray is inside it between
    ///
    /// ```text
    /// t = c·d ± sqrt(r² - |c|² + (c·d)²)
    /// ```
    pub(crate) fn hit(&self, from: Point2<f64>, direction: Vector2<f64>) -> Option<Hit> {
        let to_middle = self.position - from;
        let along_m = to_middle.dot(&direction);
        let half_m2 = self.radius_m.powi(2) - to_middle.norm_squared() + along_m.powi(2);
        if half_m2 < 0.0 || along_m + half_m2.sqrt() < 0.0 {
            return None;
        }
        let range_m = (along_m - half_m2.sqrt()).max(0.0);
        let across = half_m2.sqrt() / self.radius_m;
        Some(Hit { range_m, incidence_rad: across.clamp(0.0, 1.0).acos() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hit_in_the_middle_at_the_side_and_not_at_all() {
        let person = Person { position: Point2::new(3.0, 1.0), radius_m: 0.5 };
        let hit = |y_m: f64, x_to: f64| person.hit(Point2::new(0.0, y_m), Vector2::new(x_to, 0.0));
        let middle = hit(1.0, 1.0).expect("head-on");
        assert!((middle.range_m - 2.5).abs() < 1e-12, "{} m to the belly", middle.range_m);
        assert!(middle.incidence_rad < 1e-6, "head-on");
        let side = hit(1.25, 1.0).expect("at half the radius");
        assert!((side.range_m - (3.0 - 0.1875_f64.sqrt())).abs() < 1e-12, "{} m", side.range_m);
        assert!((side.incidence_rad - 0.5_f64.asin()).abs() < 1e-9, "half the radius: 30 degrees");
        assert_eq!(hit(1.6, 1.0), None, "passes by");
        assert_eq!(hit(1.0, -1.0), None, "behind");
        let within = person.hit(Point2::new(3.1, 1.0), Vector2::new(1.0, 0.0)).expect("within");
        assert_eq!(within.range_m, 0.0, "from within");
    }
}
