//! Exact ray casting.
//!
//! The ray visits cells in the order in which it crosses their borders; the first wall cell that
//! it enters is hit where it crosses that cell's border:
//!
//! ```text
//! t = (border - from) / direction    along the axis across which the cell is entered
//! ```
//!
//! J. Amanatides and A. Woo, "A fast voxel traversal algorithm for ray tracing", Eurographics
//! (1987); every border is computed afresh instead of summed up, so that nothing accumulates.
//! Time O(cells crossed).

use meetpoint_geometry::{Cell, GridFrame, Point2, Vector2};

use crate::building::Building;

/// Where a ray ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance from where the ray begins, in metres; 0 from within a wall.
    pub range_m: f64,
    /// Angle between the ray and the normal of what it hits, in radians, in [0, π/2]: 0 is head-on.
    pub incidence_rad: f64,
}

impl Building {
    /// Distance in metres from `from` along `bearing_rad` (in the building's frame) to the first
    /// wall, closed door or person, if there is one no farther than `range_max_m`; 0 from within.
    pub fn range_m(&self, from: Point2<f64>, bearing_rad: f64, range_max_m: f64) -> Option<f64> {
        self.hit(from, bearing_rad, range_max_m).map(|hit| hit.range_m)
    }

    /// What a ray hits first, as [`Building::range_m`].
    pub fn hit(&self, from: Point2<f64>, bearing_rad: f64, range_max_m: f64) -> Option<Hit> {
        let direction = Vector2::new(bearing_rad.cos(), bearing_rad.sin());
        let wall = self.wall_hit(from, direction, range_max_m);
        let people = self.people().iter().filter_map(|person| person.hit(from, direction));
        people
            .chain(wall)
            .filter(|hit| hit.range_m <= range_max_m)
            .min_by(|a, b| a.range_m.total_cmp(&b.range_m))
    }

    fn wall_hit(
        &self,
        from: Point2<f64>,
        direction: Vector2<f64>,
        range_max_m: f64,
    ) -> Option<Hit> {
        let mut walk = Walk::new(self.info().frame, from, direction);
        let mut range_m = 0.0;
        while range_m <= range_max_m {
            if self.is_wall(walk.cell) {
                return Some(Hit { range_m, incidence_rad: walk.incidence_rad() });
            }
            range_m = walk.step();
        }
        None
    }
}

/// A ray on its way from cell to cell.
struct Walk {
    frame: GridFrame,
    from: Point2<f64>,
    direction: Vector2<f64>,
    cell: Cell,
    /// How fast the ray goes across the border that it crossed last, in 0..=1.
    across: f64,
}

impl Walk {
    fn new(frame: GridFrame, from: Point2<f64>, direction: Vector2<f64>) -> Self {
        Self { frame, from, direction, cell: frame.cell_at(from), across: 1.0 }
    }

    /// Angle between the ray and the normal of the border that it crossed last, in radians.
    fn incidence_rad(&self) -> f64 {
        self.across.clamp(0.0, 1.0).acos()
    }

    /// Goes into the next cell; how far from the start its border is, in metres.
    fn step(&mut self) -> f64 {
        let low = self.frame.corner_of(self.cell);
        let high = self.frame.corner_of(Cell { x: self.cell.x + 1, y: self.cell.y + 1 });
        let to_side_m = distance_m(self.from.x, self.direction.x, low.x, high.x);
        let to_end_m = distance_m(self.from.y, self.direction.y, low.y, high.y);
        if to_side_m <= to_end_m {
            self.cell.x += if self.direction.x < 0.0 { -1 } else { 1 };
            self.across = self.direction.x.abs();
            to_side_m
        } else {
            self.cell.y += if self.direction.y < 0.0 { -1 } else { 1 };
            self.across = self.direction.y.abs();
            to_end_m
        }
    }
}

/// Distance along the ray to the border that it leaves the cell through, on one axis.
fn distance_m(from: f64, direction: f64, low: f64, high: f64) -> f64 {
    if direction == 0.0 {
        return f64::INFINITY;
    }
    (if direction < 0.0 { low } else { high } - from) / direction
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::building::tests::any_building;
    use proptest::prelude::*;
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};

    #[test]
    fn four_walls() {
        let room = Building::from_drawing("#####\n#   #\n#   #\n#####", 1.0).expect("a drawing");
        let from = Point2::new(1.5, 2.25);
        let ranges =
            [0.0, FRAC_PI_2, PI, -FRAC_PI_2].map(|bearing| room.range_m(from, bearing, 9.0));
        for (range_m, expected_m) in ranges.into_iter().zip([2.5, 0.75, 0.5, 1.25]) {
            let range_m = range_m.expect("a wall all around");
            assert!((range_m - expected_m).abs() < 1e-12, "{range_m} is not {expected_m}");
        }
        let slanted_m = room.range_m(from, FRAC_PI_4, 9.0).expect("a wall");
        assert!((slanted_m - 0.75 * 2.0_f64.sqrt()).abs() < 1e-12, "{slanted_m} to the upper wall");
        assert_eq!(room.range_m(from, 0.0, 2.4), None, "beyond the range");
        assert_eq!(room.range_m(Point2::new(0.5, 0.5), 0.0, 9.0), Some(0.0), "within a wall");
    }

    #[test]
    fn incidence_is_measured_from_the_normal() {
        let room = Building::from_drawing("#####\n#   #\n#   #\n#####", 1.0).expect("a drawing");
        let from = Point2::new(1.5, 2.25);
        let incidence_rad =
            |bearing_rad: f64| room.hit(from, bearing_rad, 9.0).expect("a wall").incidence_rad;
        assert!(incidence_rad(0.0) < 1e-6, "head-on");
        assert!((incidence_rad(0.2) - 0.2).abs() < 1e-9, "the far wall, a little aslant");
        assert!((incidence_rad(FRAC_PI_2 - 0.3) - 0.3).abs() < 1e-9, "the upper wall");
    }

    #[test]
    fn nothing_is_hit_outside() {
        let field = Building::from_drawing("...\n.#.", 1.0).expect("a drawing");
        assert_eq!(field.range_m(Point2::new(0.5, 1.5), 0.0, 1.0e3), None, "off the drawing");
        assert_eq!(field.range_m(Point2::new(-5.0, 0.5), 0.0, 10.0), Some(6.0), "from outside");
    }

    proptest! {
        /// The definition, sampled: no wall before the hit, wall behind its border.
        #[test]
        fn hits_the_first_wall(
            building in any_building(),
            (x_m, y_m) in (0.01_f64..6.0, 0.01_f64..6.0),
            bearing_rad in 0.0..TAU,
        ) {
            const STEP_M: f64 = 0.003;
            const RANGE_MAX_M: f64 = 9.0;
            let from = Point2::new(x_m, y_m);
            let direction = Vector2::new(bearing_rad.cos(), bearing_rad.sin());
            let is_wall = |range_m: f64| {
                building.is_wall(building.info().frame.cell_at(from + direction * range_m))
            };
            let hit_m = building.range_m(from, bearing_rad, RANGE_MAX_M);
            let free_m = hit_m.unwrap_or(RANGE_MAX_M) - 1e-9;
            let n_steps = (0_u16..3000).take_while(|&i| f64::from(i) * STEP_M < free_m);
            prop_assert!(!n_steps.into_iter().any(|i| is_wall(f64::from(i) * STEP_M)));
            if let Some(hit_m) = hit_m {
                prop_assert!(is_wall(hit_m + 1e-9) || is_wall(hit_m), "free at {hit_m} m");
            }
        }
    }
}
