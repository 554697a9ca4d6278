//! One robot's run: its velocities and sightings, in order of time.

use std::collections::BTreeMap;

use meetpoint_client::v1::{self, sensor};

use super::{
    barcodes::{Barcodes, Subject},
    folder::{Folder, RobotFiles},
    row::{self, MeasurementRow, OdometryRow},
    table,
};
use crate::replay::account::{Account, BadLines, Reading};

/// The camera's name in a session.
pub(super) const CAMERA: &str = "camera";
/// The files do not say how far the camera sees; it is declared as the farthest sighting of a landmark,
/// rounded up to a multiple of this, in metres.
const RANGE_STEP_M: f64 = 0.5;
/// Nor how wide it sees; likewise, in radians.
const HALF_FIELD_OF_VIEW_STEP_RAD: f64 = 0.05;

/// One robot's run.
#[derive(Clone, Debug)]
pub(crate) struct Run {
    /// For people.
    pub(crate) account: Account,
    /// The camera.
    pub(crate) sensor: v1::Sensor,
    /// Ascending stamps; velocities go before sightings of the same time.
    pub(super) notices: Vec<Notice>,
}

/// Something noticed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Notice {
    /// Velocities.
    Odometry(OdometryRow),
    /// A landmark.
    Sighting(Sighting),
}

/// A landmark, seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sighting {
    /// Unique within the run.
    pub(super) stamp_ns: i64,
    /// The landmark's subject number; `None` if it is to be forgotten.
    pub(super) subject: Option<u32>,
    /// Metres.
    pub(super) range_m: f64,
    /// Radians.
    pub(super) bearing_rad: f64,
}

impl Notice {
    /// When.
    pub(super) fn stamp_ns(&self) -> i64 {
        match self {
            Self::Odometry(row) => row.stamp_ns,
            Self::Sighting(sighting) => sighting.stamp_ns,
        }
    }
}

impl Run {
    /// Reads a robot's files; with `anonymous`, who was seen is forgotten.
    ///
    /// # Errors
    ///
    /// If a file cannot be opened, is too long, or leaves in doubt whose a barcode is.
    pub(crate) fn read(
        folder: &Folder,
        robot: &RobotFiles,
        anonymous: bool,
    ) -> anyhow::Result<Self> {
        let mut hasher = blake3::Hasher::new();
        let mut bad = BadLines::default();
        let barcodes = Barcodes::read(&folder.barcodes, &mut hasher)?;
        let odometry = table::read(&robot.odometry, row::odometry, &mut hasher, &mut bad)?;
        let measured = table::read(&robot.measurement, row::measurement, &mut hasher, &mut bad)?;
        hasher.update(&[u8::from(anonymous)]);
        let (sightings, skipped) = sightings(measured.rows, &barcodes, anonymous);
        let account = Account {
            content_hash: hasher.finalize(),
            reading: Reading::Sighting,
            stamps_ns: sightings.iter().map(|sighting| sighting.stamp_ns).collect(),
            n_lines: odometry.n_lines + measured.n_lines,
            skipped,
            bad,
            broken_off: odometry.broken_off.or(measured.broken_off),
        };
        let sensor = camera(&sightings);
        let velocities = odometry.rows.into_iter().map(Notice::Odometry);
        let mut notices: Vec<_> =
            velocities.chain(sightings.into_iter().map(Notice::Sighting)).collect();
        // Stable: what is equal stays in the order of the files, velocities first.
        notices.sort_by_key(Notice::stamp_ns);
        Ok(Self { account, sensor, notices })
    }
}

/// The sightings of landmarks in order of time, and what was left out.
fn sightings(
    mut rows: Vec<MeasurementRow>,
    barcodes: &Barcodes,
    anonymous: bool,
) -> (Vec<Sighting>, BTreeMap<String, u64>) {
    rows.sort_by_key(|row| row.stamp_ns);
    let mut sightings: Vec<Sighting> = Vec::with_capacity(rows.len());
    let mut skipped = BTreeMap::new();
    for MeasurementRow { stamp_ns, barcode, range_m, bearing_rad } in rows {
        let number = match barcodes.subject(barcode) {
            Some(Subject::Landmark(number)) => number,
            Some(Subject::Robot) => {
                *skipped.entry("sightings of other robots".to_owned()).or_default() += 1;
                continue;
            }
            None => {
                *skipped.entry("sightings of unknown barcodes".to_owned()).or_default() += 1;
                continue;
            }
        };
        // One picture may show several landmarks, but a stamp is unique within a sensor: those behind
        // the first come a nanosecond later each. The files count milliseconds.
        let after_last = sightings.last().map(|last| last.stamp_ns.saturating_add(1));
        let stamp_ns = after_last.map_or(stamp_ns, |after_ns| stamp_ns.max(after_ns));
        let subject = (!anonymous).then_some(number);
        sightings.push(Sighting { stamp_ns, subject, range_m, bearing_rad });
    }
    (sightings, skipped)
}

/// The camera's declaration: it sees as far and as wide as it did.
fn camera(sightings: &[Sighting]) -> v1::Sensor {
    let farthest_m = sightings.iter().map(|sighting| sighting.range_m).fold(0.0, f64::max);
    let widest_rad =
        sightings.iter().map(|sighting| sighting.bearing_rad.abs()).fold(0.0, f64::max);
    let detector = v1::LandmarkDetector {
        range_max_m: rounded_up(farthest_m, RANGE_STEP_M, f64::INFINITY),
        half_field_of_view_rad: rounded_up(
            widest_rad,
            HALF_FIELD_OF_VIEW_STEP_RAD,
            std::f64::consts::PI,
        ),
    };
    let kind = Some(sensor::Kind::LandmarkDetector(detector));
    // Its authors aligned the camera with the robot's frame.
    v1::Sensor { id: CAMERA.to_owned(), robot_from_sensor: None, kind }
}

/// The smallest multiple of `step` above 0 that is not below `value`; at most `limit`.
fn rounded_up(value: f64, step: f64, limit: f64) -> f64 {
    ((value / step).ceil().max(1.0) * step).max(value).min(limit)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A folder of robot 1 with these lines, read.
    fn run(odometry: &str, measurement: &str, anonymous: bool) -> Run {
        let folder = tempfile::tempdir().expect("a folder");
        for (name, text) in [
            ("Barcodes.dat", "1 5\n2 14\n6 63\n7 81\n"),
            ("Robot1_Odometry.dat", odometry),
            ("Robot1_Measurement.dat", measurement),
        ] {
            std::fs::write(folder.path().join(name), text).expect("a free disk");
        }
        let folder = Folder::open(folder.path()).expect("a good folder");
        Run::read(&folder, &folder.robots[0], anonymous).expect("good files")
    }

    #[test]
    fn landmarks_are_kept_and_the_rest_is_counted() {
        let measurement = "1.5 63 3.1 0.2\n1.5 14 2 0\n1.5 43 2 0\n1.5 81 4 -0.31\n2 63 oops 0\n";
        let run = run("1.0 0.1 0\n1.5 0.2 0.5\n", measurement, false);
        let stamps_ns: Vec<i64> = run.notices.iter().map(Notice::stamp_ns).collect();
        let expected = [1_000_000_000, 1_500_000_000, 1_500_000_000, 1_500_000_001];
        assert_eq!(stamps_ns, expected, "velocities first; one picture, two stamps");
        let Notice::Sighting(last) = run.notices[3] else { panic!("{:?}", run.notices) };
        assert_eq!(last.subject, Some(7), "by its barcode");
        let skipped = [("sightings of other robots", 1), ("sightings of unknown barcodes", 1)];
        let skipped = skipped.map(|(what, n)| (what.to_owned(), n));
        assert_eq!(run.account.skipped, BTreeMap::from(skipped), "told");
        let bad = &run.account.bad;
        assert_eq!((bad.n, bad.first[0].line), (1, 5), "told with its number");
        let Some(sensor::Kind::LandmarkDetector(camera)) = run.sensor.kind else {
            panic!("{:?}", run.sensor)
        };
        assert_eq!(camera.range_max_m, 4.0, "as far as it saw");
        assert!((camera.half_field_of_view_rad - 0.35).abs() < 1e-12, "rounded up: {camera:?}");
    }

    #[test]
    fn anonymous_landmarks_are_another_recording() {
        let [one, other] = [false, true].map(|anonymous| run("1 0 0\n", "1 63 3 0\n", anonymous));
        assert_ne!(one.account.content_hash, other.account.content_hash, "another session");
        let Notice::Sighting(seen) = other.notices[1] else { panic!("{:?}", other.notices) };
        assert_eq!(seen.subject, None, "forgotten");
    }

    #[test]
    fn lines_in_any_order_come_out_in_order_of_time() {
        let sorted = run("1 0 0\n2 0 0\n", "1.5 63 3 0\n2.5 81 3 0\n", false);
        let mixed = run("2 0 0\n1 0 0\n", "2.5 81 3 0\n1.5 63 3 0\n", false);
        assert_eq!(sorted.notices, mixed.notices, "as they happened");
    }

    #[test]
    fn rounding_up() {
        assert_eq!(rounded_up(8.632, 0.5, f64::INFINITY), 9.0, "up");
        assert_eq!(rounded_up(8.5, 0.5, f64::INFINITY), 8.5, "a multiple stays");
        assert_eq!(rounded_up(0.0, 0.5, f64::INFINITY), 0.5, "never nothing");
        let pi = std::f64::consts::PI;
        assert_eq!(rounded_up(3.12, 0.05, pi), pi, "at most half a turn");
    }
}
