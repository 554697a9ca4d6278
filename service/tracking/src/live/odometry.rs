//! A robot's own reckoning: poses as they arrive, or velocities integrated between their stamps.

use meetpoint_geometry::Pose;

/// Poses that are kept to interpolate between.
const N_RECENT_MAX: usize = 8;

/// The farthest that a pose is extrapolated from the last two, in nanoseconds: half a second.
const EXTRAPOLATION_MAX_NS: i64 = 500_000_000;

/// Velocity in the robot's own frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Velocity {
    /// Metres a second.
    pub forward_m_per_s: f64,
    /// Metres a second.
    pub left_m_per_s: f64,
    /// Radians a second, counter-clockwise.
    pub turn_rad_per_s: f64,
}

impl Velocity {
    /// The step that this velocity makes in some seconds: an arc.
    fn step(self, seconds: f64) -> Pose {
        let turn = self.turn_rad_per_s * seconds;
        let (along, across) = if turn.abs() < 1e-9 {
            (1.0, 0.0)
        } else {
            (turn.sin() / turn, (1.0 - turn.cos()) / turn)
        };
        let (forward, left) = (self.forward_m_per_s * seconds, self.left_m_per_s * seconds);
        Pose::new(forward * along - left * across, forward * across + left * along, turn)
    }
}

/// The recent past of a robot's odometry.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Odometry {
    /// Stamps in nanoseconds and poses, in order of arrival.
    pub(crate) recent: Vec<(i64, Pose)>,
    /// In force since the last of `recent`, if the robot sends velocities.
    pub(crate) velocity: Option<Velocity>,
}

impl Odometry {
    /// Takes a pose. One that is not finite is not taken.
    pub fn add_pose(&mut self, stamp_ns: i64, pose: Pose) {
        if pose.is_finite() {
            self.velocity = None;
            self.push(stamp_ns, Pose::new(pose.x_m, pose.y_m, pose.theta_rad));
        }
    }

    /// Takes a velocity, in force from `stamp_ns` on. One that leads to no finite pose is not
    /// taken.
    pub fn add_velocity(&mut self, stamp_ns: i64, velocity: Velocity) {
        let pose = self.pose_at(stamp_ns).unwrap_or(Pose::IDENTITY);
        if velocity.step(1.0).is_finite() {
            self.push(stamp_ns, pose);
            self.velocity = Some(velocity);
        }
    }

    fn push(&mut self, stamp_ns: i64, pose: Pose) {
        if self.recent.len() == N_RECENT_MAX {
            self.recent.remove(0);
        }
        self.recent.push((stamp_ns, pose));
    }

    /// The pose at a moment: as it came if one came with this very stamp, else by the velocity in
    /// force, else between the two latest that enclose it, else onwards from the last two if that
    /// is not far, else the last. `None` if none ever came.
    pub fn pose_at(&self, stamp_ns: i64) -> Option<Pose> {
        let &(last_ns, last) = self.recent.last()?;
        if let Some((_, pose)) = self.recent.iter().rev().find(|(at_ns, _)| *at_ns == stamp_ns) {
            return Some(*pose);
        }
        if let Some(velocity) = self.velocity {
            let pose = last * velocity.step(seconds_between(last_ns, stamp_ns).max(0.0));
            return Some(if pose.is_finite() { pose } else { last });
        }
        let pairs = || self.recent.windows(2).map(|pair| (pair[0], pair[1])).rev();
        let between = pairs().find(|((a, _), (b, _))| (*a..*b).contains(&stamp_ns));
        let ahead = || {
            pairs().next().filter(|((a, _), (b, _))| {
                *a < *b && *b < stamp_ns && stamp_ns.saturating_sub(*b) <= EXTRAPOLATION_MAX_NS
            })
        };
        let Some(((a_ns, a), (b_ns, b))) = between.or_else(ahead) else { return Some(last) };
        let pose = a.interpolate(b, seconds_between(a_ns, stamp_ns) / seconds_between(a_ns, b_ns));
        Some(if pose.is_finite() { pose } else { last })
    }

    /// Forgets everything: what comes next is not chained to what came before.
    pub(crate) fn clear(&mut self) {
        *self = Self::default();
    }
}

/// Seconds from one stamp to another, negative backwards.
pub(crate) fn seconds_between(from_ns: i64, to_ns: i64) -> f64 {
    to_ns.saturating_sub(from_ns) as f64 * 1e-9
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    const SECOND_NS: i64 = 1_000_000_000;

    fn along_x(stamps_and_x_m: &[(i64, f64)]) -> Odometry {
        let mut odometry = Odometry::default();
        for &(stamp_ns, x_m) in stamps_and_x_m {
            odometry.add_pose(stamp_ns, Pose::new(x_m, 0.0, 0.0));
        }
        odometry
    }

    fn x_m(odometry: &Odometry, stamp_ns: i64) -> f64 {
        odometry.pose_at(stamp_ns).expect("some odometry came").x_m
    }

    #[test]
    fn takes_its_own_stamp_as_it_is() {
        let odometry = along_x(&[(10, 1.0), (30, 3.0), (20, 7.0)]);
        assert_eq!(x_m(&odometry, 20), 7.0, "the pose of that stamp, though it ran backwards");
        assert_eq!(x_m(&odometry, 15), 1.5, "between two that enclose it");
    }

    #[test]
    fn goes_on_for_half_a_second_only() {
        let odometry = along_x(&[(0, 0.0), (SECOND_NS, 1.0)]);
        assert_eq!(x_m(&odometry, SECOND_NS * 3 / 2), 1.5, "half a second on");
        assert_eq!(x_m(&odometry, SECOND_NS * 2), 1.0, "no farther than the last");
        assert_eq!(Odometry::default().pose_at(0), None, "nothing came");
    }

    #[test]
    fn velocities_make_arcs() {
        let mut odometry = Odometry::default();
        let velocity =
            Velocity { forward_m_per_s: PI / 2.0, left_m_per_s: 0.0, turn_rad_per_s: PI / 2.0 };
        odometry.add_velocity(0, velocity);
        let pose = odometry.pose_at(SECOND_NS).expect("a velocity is in force");
        let expected = Pose::new(1.0, 1.0, PI / 2.0);
        assert!(expected.step_to(pose).distance_m() < 1e-9, "a quarter of a circle of radius 1 m");
        odometry.add_velocity(SECOND_NS, Velocity { turn_rad_per_s: f64::NAN, ..velocity });
        assert!(odometry.pose_at(SECOND_NS * 2).expect("still").is_finite(), "NaN is not taken");
    }
}
