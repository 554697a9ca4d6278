//! How the beams of a laser point, where the line does not say.

use std::{collections::BTreeMap, f64::consts::PI};

use meetpoint_geometry::Pose;

use super::{BadLine, Laser, LaserTag};

/// Range assumed where the log names none, in metres: what CARMEN assumes for a SICK LMS.
const RANGE_MAX_M: f64 = 80.0;
/// The same for the only other laser that old lines are known from, a Hokuyo URG (from csm).
const HOKUYO_RANGE_MAX_M: f64 = 4.0;
/// The longest range that a session may declare, in metres.
const DECLARED_RANGE_MAX_M: f64 = 1000.0;
/// A line repeats a full turn at most once, with room for rounded angles.
const SPAN_MAX_RAD: f64 = 2.0 * PI + 0.02;

/// How the beams of a laser point and reach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Beams {
    /// Direction of beam 0 in the laser's frame, in radians.
    pub(crate) angle_min_rad: f64,
    /// From one beam to the next, in radians.
    pub(crate) angle_increment_rad: f64,
    /// Readings at or beyond it are no return, in metres.
    pub(crate) range_max_m: f64,
}

impl Beams {
    /// Refuses what no laser does.
    pub(super) fn check(&self, n_beams: u32) -> Result<(), BadLine> {
        let span_rad = self.angle_increment_rad.abs() * f64::from(n_beams - 1);
        if !(span_rad <= SPAN_MAX_RAD && self.angle_min_rad.abs() <= SPAN_MAX_RAD) {
            return Err(BadLine::WrongBeams("more than a full turn"));
        }
        if !(0.0 < self.range_max_m && self.range_max_m <= DECLARED_RANGE_MAX_M) {
            return Err(BadLine::WrongBeams("maximum range not above 0 and up to 1000 m"));
        }
        Ok(())
    }
}

/// The settings of the robot's software that the log repeats; the first of a name counts.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Parameters(BTreeMap<String, f64>);

/// The settings that matter here.
const KNOWN: [&str; 5] = [
    "robot_frontlaser_offset",
    "robot_rearlaser_offset",
    "laser_front_laser_resolution",
    "robot_front_laser_max",
    "robot_rear_laser_max",
];

impl Parameters {
    /// Keeps a setting if it matters here and is a number. True if so.
    pub(crate) fn note(&mut self, name: &str, value: &str) -> bool {
        let Ok(number) = value.parse::<f64>() else { return false };
        let known = KNOWN.contains(&name) && number.is_finite();
        if known {
            self.0.entry(name.to_owned()).or_insert(number);
        }
        known
    }

    /// The beams of a laser: those that its lines describe, or those that CARMEN assumes from
    /// their number.
    pub(crate) fn beams(&self, laser: &Laser) -> Beams {
        laser.beams.unwrap_or_else(|| self.assumed(laser))
    }

    /// Where a laser sits, if the settings say so; facing backwards for the rear one.
    pub(crate) fn robot_from_laser(&self, tag: LaserTag) -> Option<Pose> {
        match tag {
            LaserTag::Front => {
                self.0.get("robot_frontlaser_offset").map(|&x_m| Pose::new(x_m, 0.0, 0.0))
            }
            LaserTag::Rear => {
                let x_m = self.0.get("robot_rearlaser_offset").copied().unwrap_or(0.0);
                Some(Pose::new(x_m, 0.0, PI))
            }
            LaserTag::Raw(_) | LaserTag::Robot(_) => None,
        }
    }

    fn assumed(&self, laser: &Laser) -> Beams {
        let n_beams = laser.n_beams;
        let (start_deg, step_deg) = match n_beams {
            180 | 181 => (-90.0, 1.0),
            360 | 361 => (-90.0, 0.5),
            400 | 401 => (-50.0, 0.25),
            769 => (-135.0, 270.0 / 768.0),
            n => (-90.0, 180.0 / f64::from(n.saturating_sub(1).max(1))),
        };
        let (name, range_max_m) = match (laser.tag, n_beams) {
            (LaserTag::Rear, _) => ("robot_rear_laser_max", RANGE_MAX_M),
            (_, 769) => ("robot_front_laser_max", HOKUYO_RANGE_MAX_M),
            _ => ("robot_front_laser_max", RANGE_MAX_M),
        };
        let range_max_m = self.positive(name, DECLARED_RANGE_MAX_M).unwrap_or(range_max_m);
        let step_max_deg = SPAN_MAX_RAD.to_degrees() / f64::from(n_beams);
        let step_deg =
            self.positive("laser_front_laser_resolution", step_max_deg).unwrap_or(step_deg);
        Beams {
            angle_min_rad: f64::to_radians(start_deg),
            angle_increment_rad: f64::to_radians(step_deg),
            range_max_m,
        }
    }

    /// A setting, if it is above 0 and at most `limit`.
    fn positive(&self, name: &str, limit: f64) -> Option<f64> {
        self.0.get(name).copied().filter(|&value| 0.0 < value && value <= limit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn front(n_beams: u32) -> Laser {
        Laser { tag: LaserTag::Front, n_beams, beams: None }
    }

    #[test]
    fn the_number_of_beams_tells_their_angles() {
        for (n_beams, first_deg, last_deg) in [
            (180, -90.0, 89.0),
            (181, -90.0, 90.0),
            (360, -90.0, 89.5),
            (361, -90.0, 90.0),
            (401, -50.0, 50.0),
            (769, -135.0, 135.0),
            (91, -90.0, 90.0),
        ] {
            let beams = Parameters::default().beams(&front(n_beams));
            let last_rad = beams.angle_min_rad + beams.angle_increment_rad * f64::from(n_beams - 1);
            assert!((beams.angle_min_rad.to_degrees() - first_deg).abs() < 1e-9, "{n_beams}");
            assert!((last_rad.to_degrees() - last_deg).abs() < 1e-9, "{n_beams}: {last_rad}");
            assert_eq!(beams.check(n_beams), Ok(()), "{n_beams}");
        }
    }

    #[test]
    fn settings_of_the_log_count_and_nonsense_does_not() {
        let mut parameters = Parameters::default();
        assert!(parameters.note("robot_frontlaser_offset", "0.25"), "known");
        assert!(!parameters.note("robot_frontlaser_offset", "wide"), "not a number");
        assert!(!parameters.note("robot_name", "7"), "does not matter here");
        assert!(parameters.note("robot_front_laser_max", "50"), "known");
        assert!(parameters.note("laser_front_laser_resolution", "720"), "known, and nonsense");
        let beams = parameters.beams(&front(180));
        assert_eq!(beams.range_max_m, 50.0, "as set");
        assert!((beams.angle_increment_rad.to_degrees() - 1.0).abs() < 1e-9, "as assumed");
        let mount = parameters.robot_from_laser(LaserTag::Front).expect("it was set");
        assert_eq!(mount, Pose::new(0.25, 0.0, 0.0), "forward");
        let rear = parameters.robot_from_laser(LaserTag::Rear).expect("always turned");
        assert_eq!(rear, Pose::new(0.0, 0.0, PI), "facing backwards");
    }

    #[test]
    fn impossible_beams_are_refused() {
        let good = Beams { angle_min_rad: -1.0, angle_increment_rad: 0.01, range_max_m: 30.0 };
        assert!(good.check(200).is_ok(), "a laser");
        assert!(good.check(2000).is_err(), "three turns");
        assert!(Beams { range_max_m: 0.0, ..good }.check(200).is_err(), "blind");
        assert!(Beams { range_max_m: 1e9, ..good }.check(200).is_err(), "beyond what is declared");
    }
}
