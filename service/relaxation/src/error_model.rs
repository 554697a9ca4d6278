//! How much a robot's odometry and its sightings err, in the Gaussian form that least squares need.

use meetpoint_geometry::Pose;
use nalgebra::{Matrix2, Matrix3, Rotation2, Vector3};

use crate::calibration::Calibration;
use crate::motion::Motion;
use crate::travel::Sighting;

/// Standard deviations of all that errs.
///
/// What errs at random adds up as variance along the way, so that nothing depends on how finely it
/// is cut; what errs steadily over a way between two steps and otherwise over the next grows with
/// the way's length; what errs steadily over the whole travel is the [`Calibration`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorModel {
    /// Of the length measured, in metres after one metre, at random.
    pub distance_std_m: f64,
    /// Of the length measured, as a share of it, for each way anew.
    pub distance_share_std: f64,
    /// Of the heading, in radians after one metre, at random.
    pub heading_std_rad: f64,
    /// Of the heading, in radians for each metre, for each way anew: carpets and slopes.
    pub way_turn_std_per_m: f64,
    /// Of a turn, as a share of it.
    pub turn_share_std: f64,
    /// Of a landmark's place when it is seen, in metres, at any distance: the person presses the
    /// button a little early or late.
    pub sighting_std_m: f64,
    /// Of a landmark's distance, as a share of it.
    pub range_share_std: f64,
    /// Of a landmark's direction, in radians.
    pub bearing_std_rad: f64,
    /// Of the odometry's scale.
    pub scale_std: f64,
    /// Of the heading's steady drift, in radians a metre.
    pub turn_per_m_std: f64,
    /// Of the steady error of turns, as a share of them.
    pub turn_per_rad_std: f64,
}

impl ErrorModel {
    /// Wheels on carpet and tiles that nobody calibrated, landmarks marked by a person with a
    /// button: a drift of a degree a metre is not unheard of, two degrees are.
    pub const BUTTON: Self = Self {
        distance_std_m: 0.02,
        distance_share_std: 0.05,
        heading_std_rad: 0.01,
        way_turn_std_per_m: 0.005,
        turn_share_std: 0.06,
        sighting_std_m: 0.25,
        range_share_std: 0.1,
        bearing_std_rad: 0.1,
        scale_std: 0.03,
        turn_per_m_std: 0.012,
        turn_per_rad_std: 0.05,
    };

    /// Wheels on a smooth floor, landmarks that a camera measures from a few metres away: a pixel is a
    /// thousandth of a radian, but a picture is taken up to a tenth of a second beside odometry, which
    /// is 0.015 where the robot turns.
    pub const CAMERA: Self = Self {
        distance_std_m: 0.03,
        distance_share_std: 0.05,
        heading_std_rad: 0.05,
        way_turn_std_per_m: 0.05,
        turn_share_std: 0.1,
        sighting_std_m: 0.03,
        range_share_std: 0.03,
        bearing_std_rad: 0.015,
        scale_std: 0.05,
        turn_per_m_std: 0.02,
        turn_per_rad_std: 0.1,
    };

    /// The same from one sighting to the next, where it is asked which landmark it is: wheels follow
    /// late, which errs by much in a second and takes itself back in the next; directions seen at one
    /// moment err together, as the heading does, and hardly against each other; distances err by as
    /// much as a twentieth, more to one side. Where the evidence of the five robots of MRCLAM 6 with
    /// known landmarks, a step a second, is about the greatest: fitted to these robots, but for
    /// distances, which were compared with motion capture (0.05 to 0.06 of the distance), and on no
    /// others. What these five show with it is how well the search does, not how well the model
    /// would do elsewhere.
    pub const CAMERA_STEPS: Self = Self {
        distance_std_m: 0.12,
        distance_share_std: 0.2,
        heading_std_rad: 0.12,
        way_turn_std_per_m: 0.03,
        turn_share_std: 0.4,
        sighting_std_m: 0.03,
        range_share_std: 0.06,
        bearing_std_rad: 0.005,
        scale_std: 0.05,
        turn_per_m_std: 0.03,
        turn_per_rad_std: 0.1,
    };

    /// Precision of a way's calibration.
    pub(crate) fn calibration_precision(&self) -> Vector3<f64> {
        Vector3::new(self.scale_std, self.turn_per_m_std, self.turn_per_rad_std)
            .map(|std| 1.0 / (std * std))
    }

    /// Covariance of where a landmark is, seen from the robot, in square metres.
    pub(crate) fn sighting_covariance(&self, sighting: &Sighting) -> Matrix2<f64> {
        let along = self.range_share_std * sighting.range_m;
        let across = self.bearing_std_rad * sighting.range_m;
        let turn = Rotation2::new(sighting.bearing_rad).into_inner();
        let spread = Matrix2::new(along * along, 0.0, 0.0, across * across);
        turn * spread * turn.transpose() + Matrix2::identity() * self.sighting_std_m.powi(2)
    }
}

/// A way from one step to another, with what is not known of it.
#[derive(Clone, Debug)]
pub(crate) struct Way {
    /// The pose at its end seen from its beginning.
    pub(crate) displacement: Pose,
    /// Of x, y (metres) and heading (radians) at its end.
    pub(crate) covariance: Matrix3<f64>,
    /// Change of the displacement with scale, turn per metre and turn per radian.
    pub(crate) by_calibration: Matrix3<f64>,
}

impl Way {
    /// The way along `motion` with odometry corrected by `calibration`.
    pub(crate) fn new(motion: &Motion, calibration: &Calibration, model: &ErrorModel) -> Self {
        let mut end = Pose::IDENTITY;
        let mut covariance = Matrix3::zeros();
        let mut by_calibration = Matrix3::zeros();
        for &leg in motion.legs() {
            let step = calibration.corrected(leg);
            let (sin, cos) = end.theta_rad.sin_cos();
            let turned = [cos * step.x_m - sin * step.y_m, sin * step.x_m + cos * step.y_m];
            // Of the new end by the old one, and by length and turn of the leg.
            let mut by_end = Matrix3::identity();
            by_end[(0, 2)] = -turned[1];
            by_end[(1, 2)] = turned[0];
            let length_m = step.distance_m();
            let by_length =
                Vector3::new(turned[0], turned[1], 0.0) / length_m.max(f64::MIN_POSITIVE);
            // What is added to the turn bends the leg by its half.
            let by_turn = Vector3::new(-turned[1] / 2.0, turned[0] / 2.0, 1.0);
            covariance = by_end * covariance * by_end.transpose()
                + by_length * by_length.transpose() * (model.distance_std_m.powi(2) * length_m)
                + by_turn * by_turn.transpose() * (model.heading_std_rad.powi(2) * length_m);
            let by_leg = Matrix3::from_columns(&[
                by_length * leg.distance_m()
                    + by_turn * (leg.distance_m() * calibration.turn_per_m),
                by_turn * length_m,
                by_turn * leg.theta_rad,
            ]);
            by_calibration = by_end * by_calibration + by_leg;
            end = end * step;
        }
        for (column, std) in
            [model.distance_share_std, model.way_turn_std_per_m, model.turn_share_std]
                .into_iter()
                .enumerate()
        {
            let by = by_calibration.column(column) * std;
            covariance += by * by.transpose();
        }
        covariance += Matrix3::identity() * LEAST_STD.powi(2);
        Self { displacement: end, covariance, by_calibration }
    }
}

/// Even a robot that stands is not known better than this, in metres and radians.
const LEAST_STD: f64 = 1e-3;

#[cfg(test)]
mod tests {
    use super::*;

    fn ell() -> Motion {
        let mut legs = vec![Pose::new(0.5, 0.0, 0.02); 10];
        legs.push(Pose::new(0.0, 0.0, 1.3));
        legs.extend([Pose::new(0.5, 0.05, -0.01); 20]);
        Motion::new(legs)
    }

    #[test]
    fn change_with_calibration_is_that_of_small_changes() {
        let model = ErrorModel::BUTTON;
        let at = Calibration { scale: 1.02, turn_per_m: 0.01, turn_per_rad: -0.03 };
        let way = Way::new(&ell(), &at, &model);
        let small = 1e-6;
        let changed = [
            Calibration { scale: at.scale + small, ..at },
            Calibration { turn_per_m: at.turn_per_m + small, ..at },
            Calibration { turn_per_rad: at.turn_per_rad + small, ..at },
        ];
        for (column, changed) in changed.iter().enumerate() {
            let end = ell().displacement(changed);
            let found = [
                (end.x_m - way.displacement.x_m) / small,
                (end.y_m - way.displacement.y_m) / small,
                (end.theta_rad - way.displacement.theta_rad) / small,
            ];
            for (row, &found) in found.iter().enumerate() {
                let told = way.by_calibration[(row, column)];
                assert!((told - found).abs() < 1e-3, "({row}, {column}): {told}, {found}");
            }
        }
    }

    #[test]
    fn variance_does_not_depend_on_the_cut() {
        let way = |n: u32| {
            let legs = vec![Pose::new(10.0 / f64::from(n), 0.0, 0.0); n as usize];
            Way::new(&Motion::new(legs), &Calibration::NONE, &ErrorModel::BUTTON).covariance
        };
        let (coarse, fine) = (way(50), way(500));
        assert!((coarse - fine).norm() < 0.03 * fine.norm(), "{coarse} {fine}");
    }
}
