//! Angles, in radians, counter-clockwise (REP 103).

use std::f64::consts::{PI, TAU};

/// The same direction within (−π, π]. NaN and infinities give NaN.
///
/// An angle already in that range comes back bit for bit.
#[must_use]
pub fn wrap_angle(angle_rad: f64) -> f64 {
    if -PI < angle_rad && angle_rad <= PI {
        return angle_rad;
    }
    let wrapped = angle_rad.rem_euclid(TAU);
    if wrapped > PI { wrapped - TAU } else { wrapped }
}

/// The turn from `from_rad` to `to_rad` by the shorter way, in (−π, π].
#[must_use]
pub fn angle_between(from_rad: f64, to_rad: f64) -> f64 {
    wrap_angle(to_rad - from_rad)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn half_a_turn_is_plus_pi() {
        assert_eq!(wrap_angle(-PI), PI, "the range is open below");
        assert_eq!(wrap_angle(3.0 * PI), PI, "odd multiples of pi");
    }

    proptest! {
        #[test]
        fn keeps_the_direction(angle_rad in -1.0e4_f64..1.0e4) {
            let wrapped = wrap_angle(angle_rad);
            prop_assert!(-PI < wrapped && wrapped <= PI);
            prop_assert!((wrapped.sin() - angle_rad.sin()).abs() < 1e-9);
            prop_assert!((wrapped.cos() - angle_rad.cos()).abs() < 1e-9);
        }
    }
}
