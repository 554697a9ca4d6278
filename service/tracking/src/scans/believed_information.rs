//! What is believed of the information that walls give about a pose.
//!
//! Walls whose directions err by a little seem to say a little of where along them one is, and many
//! walls of a corridor, or many pairs of scans taken in it, together seem to say much: they hold one
//! another wherever they happen to lie along it. As much of the information as that is not believed.

use nalgebra::{Matrix3, Vector3};

/// Deviation of the directions of walls, in radians: what a centimetre makes over half a metre.
const DIRECTION_STD_RAD: f64 = 0.03;

/// Information about x, y and theta less what walls of wrong directions would give; not negative in any
/// direction.
pub(crate) fn believed_information(information: &Matrix3<f64>) -> Matrix3<f64> {
    let seeming = DIRECTION_STD_RAD.powi(2) * (information[(0, 0)] + information[(1, 1)]);
    let mut eigen = (information - Matrix3::from_diagonal(&Vector3::new(seeming, seeming, 0.0)))
        .symmetric_eigen();
    eigen.eigenvalues.apply(|value| *value = value.max(0.0));
    eigen.recompose()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Information of walls about the origin, each by the direction of its normal.
    fn of_walls(normals_rad: &[f64]) -> Matrix3<f64> {
        let normal = |angle: &f64| Vector3::new(angle.cos(), angle.sin(), 0.5);
        let of_wall = |angle: &f64| normal(angle) * normal(angle).transpose();
        normals_rad.iter().map(of_wall).sum()
    }

    #[test]
    fn a_corridor_says_nothing_of_where_along_it_one_is() {
        let corridor: Vec<f64> =
            (0..60).map(|at| 0.02 * f64::from(at % 3 - 1) + std::f64::consts::FRAC_PI_2).collect();
        let seeming = of_walls(&corridor);
        let believed = believed_information(&seeming);
        assert!(0.01 < seeming[(0, 0)], "it seems to: {seeming}");
        assert!(believed[(0, 0)].abs() < 1e-9, "along: {believed}");
        assert!(0.99 * seeming[(1, 1)] < believed[(1, 1)], "across: {believed}");
    }

    #[test]
    fn a_corner_says_what_it_seems_to_say() {
        let corner = of_walls(&[0.0, 0.3, 1.5, 1.6]);
        let kept = believed_information(&corner) - corner;
        assert!(kept.abs().max() < 0.01 * corner.max(), "{kept}");
    }
}
