//! The first pass over a recording: what must be known of the whole before a session can be
//! opened, and what a person wants to know of the file.

use std::{
    collections::BTreeMap,
    io::{self, BufRead},
};

use meetpoint_client::v1::{self, sensor};
use meetpoint_geometry::Pose;

use super::{
    account::{Account, BadLines, Reading},
    carmen::{self, BadLine, Laser, LaserTag, Message, Parameters, Scan},
    lines::{Line, Lines},
};

/// Sensors that a session may declare.
const LASERS_MAX: usize = 16;
/// Different tags that are counted one by one; the rest share a line.
const TAGS_MAX: usize = 40;
/// Two poses of a `ROBOTLASER` line agree on where the laser sits if they stay this close to
/// what the first line said, in metres and in radians: their digits are rounded.
const MOUNT_SLACK: f64 = 0.01;

/// A laser of a recording, as it is declared to the service.
#[derive(Clone, Debug)]
pub(crate) struct DeclaredLaser {
    /// What its lines have in common.
    pub(crate) laser: Laser,
    /// The declaration.
    pub(crate) sensor: v1::Sensor,
    /// Readings at or beyond it are no return, in metres.
    pub(crate) range_max_m: f32,
}

/// What the first pass found.
#[derive(Clone, Debug)]
pub(crate) struct Survey {
    /// For people.
    pub(crate) account: Account,
    /// In order of appearance; without those whose scans come twice.
    pub(crate) lasers: Vec<DeclaredLaser>,
}

impl Survey {
    /// The declared laser of a scan. `None` if its scans are not sent.
    pub(crate) fn laser(&self, laser: &Laser) -> Option<&DeclaredLaser> {
        self.lasers.iter().find(|declared| declared.laser == *laser)
    }
}

/// Reads a recording from beginning to end.
pub(crate) fn survey(mut lines: Lines<impl BufRead>) -> Survey {
    let mut pass = Pass::default();
    let mut hasher = blake3::Hasher::new();
    let broken_off = loop {
        match lines.next() {
            Ok(Some(Line::Whole(line))) => {
                hasher.update(line).update(b"\n");
                let read = carmen::parse(line).and_then(|message| pass.take(message));
                pass.judge(lines.number(), read);
            }
            Ok(Some(Line::TooLong)) => pass.judge(lines.number(), Err(BadLine::TooLong)),
            Ok(None) => break None,
            Err(error) => break Some(describe(&error, lines.number())),
        }
    };
    pass.finish(hasher.finalize(), lines.number(), broken_off)
}

/// Why a file cannot be read beyond that many lines.
pub(super) fn describe(error: &io::Error, n_lines: u64) -> String {
    match error.kind() {
        io::ErrorKind::UnexpectedEof => {
            format!("the file ends within its compression after line {n_lines}")
        }
        _ => format!("unreadable after line {n_lines}: {error}"),
    }
}

/// A laser as far as it is known.
struct Seen {
    laser: Laser,
    stamps_ns: Vec<i64>,
    /// Where two poses a line say it sits; `None` once they contradict each other.
    mount: Option<Pose>,
}

#[derive(Default)]
struct Pass {
    parameters: Parameters,
    seen: Vec<Seen>,
    skipped: BTreeMap<String, u64>,
    bad: BadLines,
}

impl Pass {
    fn take(&mut self, message: Message<'_>) -> Result<(), BadLine> {
        match message {
            Message::Empty | Message::Odometry { .. } => Ok(()),
            Message::Parameter { name, value } => {
                if !self.parameters.note(name, value) {
                    self.skip("PARAM", 1);
                }
                Ok(())
            }
            Message::Other(tag) => {
                self.skip(tag, 1);
                Ok(())
            }
            Message::Scan(scan) => self.see(&scan),
        }
    }

    fn judge(&mut self, number: u64, read: Result<(), BadLine>) {
        if let Err(reason) = read {
            self.bad.note(None, number, &reason);
        }
    }

    fn skip(&mut self, tag: &str, n: u64) {
        let known = self.skipped.contains_key(tag) || self.skipped.len() < TAGS_MAX;
        let name = if known { tag } else { "other tags" };
        *self.skipped.entry(name.to_owned()).or_default() += n;
    }

    fn see(&mut self, scan: &Scan) -> Result<(), BadLine> {
        let Some(seen) = self.seen.iter_mut().find(|seen| seen.laser == scan.laser) else {
            if self.seen.len() == LASERS_MAX {
                return Err(BadLine::TooManyLasers(LASERS_MAX));
            }
            self.seen.push(Seen {
                laser: scan.laser,
                stamps_ns: vec![scan.stamp_ns],
                mount: scan.robot_from_laser,
            });
            return Ok(());
        };
        seen.stamps_ns.push(scan.stamp_ns);
        if let (Some(one), Some(other)) = (seen.mount, scan.robot_from_laser) {
            let step = one.step_to(other);
            if MOUNT_SLACK < step.distance_m() || MOUNT_SLACK < step.theta_rad.abs() {
                seen.mount = None;
            }
        }
        Ok(())
    }

    fn finish(
        mut self,
        content_hash: blake3::Hash,
        n_lines: u64,
        broken_off: Option<String>,
    ) -> Survey {
        let seen = std::mem::take(&mut self.seen);
        let twice = |tag| match tag {
            LaserTag::Raw(n) => seen.iter().any(|seen| seen.laser.tag == LaserTag::Robot(n)),
            _ => false,
        };
        let (repeated, used): (Vec<_>, Vec<_>) =
            seen.iter().partition(|seen| twice(seen.laser.tag));
        for seen in repeated {
            let name = format!("{} (its scans come in ROBOTLASER too)", seen.laser.tag.name());
            self.skip(&name, seen.stamps_ns.len() as u64);
        }
        let mut lasers: Vec<DeclaredLaser> = Vec::new();
        for seen in &used {
            let n_before =
                lasers.iter().filter(|before| before.laser.tag == seen.laser.tag).count();
            lasers.push(declare(seen, n_before, &self.parameters));
        }
        let stamps_ns = used.iter().flat_map(|seen| &seen.stamps_ns).copied().collect();
        let Self { skipped, bad, .. } = self;
        let reading = Reading::Scan;
        let account =
            Account { content_hash, reading, stamps_ns, n_lines, skipped, bad, broken_off };
        Survey { account, lasers }
    }
}

/// The declaration of a laser; `n_before` lasers of the same tag have other beams.
fn declare(seen: &Seen, n_before: usize, parameters: &Parameters) -> DeclaredLaser {
    let Laser { tag, n_beams, .. } = seen.laser;
    let carmen::Beams { angle_min_rad, angle_increment_rad, range_max_m } =
        parameters.beams(&seen.laser);
    let id = match n_before {
        0 => tag.sensor_id(),
        n => format!("{}_{}", tag.sensor_id(), n + 1),
    };
    let mount = parameters.robot_from_laser(tag).or(seen.mount);
    let robot_from_sensor =
        mount.map(|Pose { x_m, y_m, theta_rad }| v1::Pose { x_m, y_m, theta_rad });
    let geometry = v1::LaserGeometry {
        angle_min_rad,
        angle_increment_rad,
        n_beams,
        range_min_m: 0.0,
        range_max_m,
    };
    let kind = Some(sensor::Kind::Laser(geometry));
    #[expect(clippy::cast_possible_truncation, reason = "metres to a rounding below a micrometre")]
    let range_max_m = range_max_m as f32;
    DeclaredLaser {
        laser: seen.laser,
        sensor: v1::Sensor { id, robot_from_sensor, kind },
        range_max_m,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn survey_of(text: &str) -> Survey {
        survey(Lines::new(text.as_bytes()))
    }

    #[test]
    fn lasers_skipped_and_bad_lines_are_told() {
        let found = survey_of(
            "# a comment\n\
             PARAM robot_frontlaser_offset 0.3 0 h 0\n\
             FLASER 2 1 2 0 0 0 0 0 0 5.5 h 0\n\
             FLASER 3 1 2 3 0 0 0 0 0 0 4.5 h 0\n\
             FLASER 2 1 2 0 0\n\
             SYNC x 1 h 1\n\
             ODOM 0 0 0 0 0 0 9 h 9\n",
        );
        let ids: Vec<_> = found.lasers.iter().map(|laser| laser.sensor.id.as_str()).collect();
        assert_eq!(ids, ["front_laser", "front_laser_2"], "one a geometry");
        let mount = found.lasers[0].sensor.robot_from_sensor.expect("PARAM said so");
        assert_eq!(mount.x_m, 0.3, "forward");
        assert_eq!(
            found.account.stamps_span_ns(),
            Some((4_500_000_000, 5_500_000_000)),
            "of the scans"
        );
        assert_eq!(found.account.skipped, BTreeMap::from([("SYNC".to_owned(), 1)]), "by tag");
        assert_eq!(
            (found.account.bad.n, found.account.bad.first[0].line),
            (1, 5),
            "with the line's number"
        );
        assert_eq!(found.account.n_lines, 7, "all");
    }

    #[test]
    fn scans_that_come_twice_are_sent_once() {
        let found = survey_of(
            "RAWLASER1 0 -1 2 1 30 0 0 3 1 2 3 0 5 h 5\n\
             ROBOTLASER1 0 -1 2 1 30 0 0 3 1 2 3 0 0.2 0 0 0 0 0 0 0 0 0 0 5 h 5\n\
             ROBOTLASER1 0 -1 2 1 30 0 0 3 1 2 3 0 1.2 0 0 1 0 0 0 0 0 0 0 6 h 6\n",
        );
        assert_eq!(found.lasers.len(), 1, "the one with odometry");
        let sensor = &found.lasers[0].sensor;
        assert_eq!(sensor.id, "robot_laser_1", "the one with odometry");
        let mount = sensor.robot_from_sensor.expect("both lines agree");
        assert!((mount.x_m - 0.2).abs() < 1e-9, "from the two poses: {mount:?}");
        assert_eq!(found.account.skipped.values().sum::<u64>(), 1, "counted");
    }

    #[test]
    fn poses_that_contradict_each_other_say_nothing_of_the_laser() {
        let found = survey_of(
            "ROBOTLASER1 0 -1 2 1 30 0 0 3 1 2 3 0 0.2 0 0 0 0 0 0 0 0 0 0 5 h 5\n\
             ROBOTLASER1 0 -1 2 1 30 0 0 3 1 2 3 0 1.2 0 1 1 0 0 0 0 0 0 0 6 h 6\n",
        );
        assert_eq!(found.lasers[0].sensor.robot_from_sensor, None, "at the robot's origin");
    }

    #[test]
    fn the_same_content_has_the_same_hash() {
        let one = survey_of("ODOM 0 0 0 0 0 0 9 h 9\n").account.content_hash;
        assert_eq!(one, survey_of("ODOM 0 0 0 0 0 0 9 h 9").account.content_hash, "same lines");
        assert_ne!(one, survey_of("ODOM 0 0 0 0 0 0 8 h 9").account.content_hash, "another stamp");
    }

    #[test]
    fn a_compressed_file_that_is_cut_gives_what_stands_before() {
        use flate2::{Compression, write::GzEncoder};
        use std::io::Write;
        let lines = (0..2000).map(|i| format!("FLASER 1 {i} 0 0 0 {i} 0 0 {i}.5 h 0"));
        let text = lines.collect::<Vec<_>>().join("\n");
        let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
        encoder.write_all(text.as_bytes()).expect("memory");
        let whole = encoder.finish().expect("memory");
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("cut.log.gz");
        std::fs::write(&path, &whole[..whole.len() / 2]).expect("a free disk");
        let found = survey(crate::replay::lines::open(&path).expect("it is there"));
        let reason = found.account.broken_off.expect("the end is missing");
        assert!(reason.starts_with("the file ends within its compression"), "{reason}");
        let n_scans = found.account.stamps_ns.len();
        assert!((100..2000).contains(&n_scans), "{n_scans} scans before the cut");
    }
}
