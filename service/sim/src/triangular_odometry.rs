//! Odometry whose errors are triangular and proportional to the motion, with a steady part.
//!
//! The density of the triangular distribution of width `w` around 0 is
//!
//! ```text
//! f(x) = max(0, 1/w - |x|/w²)
//! ```
//!
//! with standard deviation `w / sqrt(6)`. A command leads from one place to the next: a turn on the
//! spot, and a straight way. One draw of each error holds for a whole command, so that errors are
//! proportional to it however finely the way is recorded: for a step of length `d` and turn `a`,
//!
//! ```text
//! length   d (scale + e1)
//! turn     a (1 + drift_per_rad + e2)  +  d (drift_per_m + e3)
//! ```
//!
//! S. Thrun, W. Burgard and D. Fox, "A probabilistic approach to concurrent mapping and
//! localization for mobile robots", Machine Learning 31 (1998), section 2.1 and footnote 1.

use meetpoint_geometry::Pose;
use rand::{Rng, RngExt};

/// A number from the triangular distribution around 0 of width `width`, in its unit; 0 for width 0.
pub fn triangular(width: f64, rng: &mut impl Rng) -> f64 {
    // The sum of two equal uniform variables is triangular.
    width * (rng.random::<f64>() - rng.random::<f64>())
}

/// How odometry errs: a steady part, and widths of the random part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriangularError {
    /// Metres measured for a metre driven; 1 is right.
    pub scale: f64,
    /// Radians gained with every metre driven.
    pub drift_rad_per_m: f64,
    /// Radians gained with every radian turned.
    pub drift_rad_per_rad: f64,
    /// Width of the error of length, in metres for a metre driven.
    pub length_width_per_m: f64,
    /// Width of the error of heading, in radians for a metre driven.
    pub heading_width_rad_per_m: f64,
    /// Width of the error of heading, in radians for a radian turned.
    pub turn_width_rad_per_rad: f64,
}

impl TriangularError {
    /// Odometry that never errs.
    pub const NONE: Self = Self {
        scale: 1.0,
        drift_rad_per_m: 0.0,
        drift_rad_per_rad: 0.0,
        length_width_per_m: 0.0,
        heading_width_rad_per_m: 0.0,
        turn_width_rad_per_rad: 0.0,
    };

    /// Draws the error of one command, over a floor that turns the robot by `floor_rad_per_m` more
    /// than its wheels tell of.
    pub(crate) fn command(&self, floor_rad_per_m: f64, rng: &mut impl Rng) -> CommandError {
        CommandError {
            scale: self.scale + triangular(self.length_width_per_m, rng),
            turn_rad_per_m: self.drift_rad_per_m
                + floor_rad_per_m
                + triangular(self.heading_width_rad_per_m, rng),
            turn_rad_per_rad: self.drift_rad_per_rad + triangular(self.turn_width_rad_per_rad, rng),
        }
    }
}

/// The error of one command.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CommandError {
    scale: f64,
    turn_rad_per_m: f64,
    turn_rad_per_rad: f64,
}

impl CommandError {
    /// What odometry measures of a true step. What is added to its turn happens evenly along it.
    pub(crate) fn measured(&self, step: Pose) -> Pose {
        let turned_rad =
            step.distance_m() * self.turn_rad_per_m + step.theta_rad * self.turn_rad_per_rad;
        let (sin, cos) = (turned_rad / 2.0).sin_cos();
        let (x_m, y_m) = (self.scale * step.x_m, self.scale * step.y_m);
        Pose::new(cos * x_m - sin * y_m, sin * x_m + cos * y_m, step.theta_rad + turned_rad)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn triangular_as_its_density_says() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let width = 0.4;
        let draws: Vec<f64> = (0..20_000).map(|_| triangular(width, &mut rng)).collect();
        let share_below =
            |x: f64| draws.iter().filter(|&&draw| draw < x).count() as f64 / draws.len() as f64;
        // The distribution function below 0: (w + x)² / 2w².
        for x in [-0.4_f64, -0.3, -0.2, -0.1, 0.0] {
            let expected = (width + x).powi(2) / (2.0 * width * width);
            assert!((share_below(x) - expected).abs() < 0.015, "{} below {x}", share_below(x));
            assert!((share_below(-x) - (1.0 - expected)).abs() < 0.015, "symmetric at {x}");
        }
    }

    #[test]
    fn errors_do_not_depend_on_how_finely_a_command_is_cut() {
        let error = TriangularError {
            scale: 1.02,
            drift_rad_per_m: 0.003,
            length_width_per_m: 0.05,
            heading_width_rad_per_m: 0.01,
            ..TriangularError::NONE
        };
        let command = error.command(0.002, &mut ChaCha8Rng::seed_from_u64(3));
        let end = |n_steps: u32| {
            let step = Pose::new(12.0 / f64::from(n_steps), 0.0, 0.0);
            (0..n_steps).fold(Pose::IDENTITY, |pose, _| pose * command.measured(step))
        };
        let apart = end(10).step_to(end(1000));
        assert!(apart.distance_m() < 0.01, "{} m", apart.distance_m());
        assert!(apart.theta_rad.abs() < 1e-9, "{} rad", apart.theta_rad);
    }
}
