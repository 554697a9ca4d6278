//! The second pass over a CARMEN log: its observations, cut into numbered batches.

use std::io::{self, BufRead};

use meetpoint_client::v1::{LaserScan, Observation, OdometryPose, observation::Kind};
use meetpoint_geometry::Pose;

use super::{
    carmen::{self, Message, Scan},
    cutter::{CutBatch, Cutter},
    lines::{Line, Lines},
    section::Section,
    survey::Survey,
};

/// A reading this close below the maximum is no return: drivers round. Metres.
const NO_RETURN_SLACK_M: f32 = 0.01;
/// Readings that stand for no return in public logs whatever the maximum, in metres.
const NO_RETURN_M: [f32; 1] = [50.0];

/// Gives the batches of a recording in order.
pub(crate) struct Batches<'a, R> {
    lines: Lines<R>,
    survey: &'a Survey,
    section: Section,
    cutter: Cutter,
    ended: bool,
}

impl<'a, R: BufRead> Batches<'a, R> {
    /// The batches of the part `section` of a log that was surveyed before.
    pub(crate) fn new(lines: Lines<R>, survey: &'a Survey, section: Section) -> Self {
        Self { lines, survey, section, cutter: Cutter::default(), ended: false }
    }

    /// What comes behind the last line: an error, if that is not where the survey saw the end.
    fn end(&mut self, read: io::Result<()>) -> Option<io::Result<CutBatch>> {
        self.ended = true;
        let account = &self.survey.account;
        if let (Err(error), None) = (read, &account.broken_off) {
            return Some(Err(error));
        }
        let n_lines = self.lines.number();
        if n_lines != account.n_lines {
            return Some(Err(io::Error::other(format!(
                "the recording has {n_lines} lines and had {} a moment ago",
                account.n_lines
            ))));
        }
        self.cutter.cut().map(Ok)
    }
}

impl<R: BufRead> Iterator for Batches<'_, R> {
    type Item = io::Result<CutBatch>;

    fn next(&mut self) -> Option<io::Result<CutBatch>> {
        while !self.ended {
            match self.lines.next() {
                Ok(Some(Line::Whole(line))) => {
                    let taken = take(line, self.survey, &self.section, &mut self.cutter);
                    let full = taken.and_then(|stamp_ns| self.cutter.cut_if_full(stamp_ns));
                    if let Some(batch) = full {
                        return Some(Ok(batch));
                    }
                }
                Ok(Some(Line::TooLong)) => {}
                Ok(None) => return self.end(Ok(())),
                Err(error) => return self.end(Err(error)),
            }
        }
        None
    }
}

/// Takes in a line. Its stamp, if it belongs to the section and is sent.
fn take(line: &[u8], survey: &Survey, section: &Section, cutter: &mut Cutter) -> Option<i64> {
    match carmen::parse(line) {
        Ok(Message::Odometry { stamp_ns, pose }) if section.contains(stamp_ns) => {
            cutter.push(odometry_observation(stamp_ns, pose));
            Some(stamp_ns)
        }
        Ok(Message::Scan(scan)) if section.contains(scan.stamp_ns) => {
            let stamp_ns = scan.stamp_ns;
            take_scan(scan, survey, cutter);
            Some(stamp_ns)
        }
        _ => None,
    }
}

/// Takes in a scan and the odometry of its line, which goes first.
fn take_scan(scan: Scan, survey: &Survey, cutter: &mut Cutter) {
    let Some(declared) = survey.laser(&scan.laser) else { return };
    let Scan { stamp_ns, mut ranges_m, remissions, odometry, .. } = scan;
    let range_max_m = declared.range_max_m;
    for range_m in &mut ranges_m {
        if range_max_m - NO_RETURN_SLACK_M <= *range_m || NO_RETURN_M.contains(range_m) {
            *range_m = f32::INFINITY;
        }
    }
    // One strength a beam, or none.
    let intensities = if remissions.len() == ranges_m.len() { remissions } else { Vec::new() };
    if let Some(pose) = odometry {
        cutter.push(odometry_observation(stamp_ns, pose));
    }
    let n_values = ranges_m.len() + intensities.len();
    let scan = Observation {
        stamp_ns,
        sensor_id: declared.sensor.id.clone(),
        kind: Some(Kind::LaserScan(LaserScan { ranges_m, intensities })),
        ..Observation::default()
    };
    cutter.push_reading(scan, n_values);
}

fn odometry_observation(stamp_ns: i64, pose: Pose) -> Observation {
    let Pose { x_m, y_m, theta_rad } = pose;
    let pose = meetpoint_client::v1::Pose { x_m, y_m, theta_rad };
    let odometry = OdometryPose { odometry_from_robot: Some(pose) };
    Observation { stamp_ns, kind: Some(Kind::OdometryPose(odometry)), ..Observation::default() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::replay::{cutter::READINGS_MAX, section::Place, survey::survey};
    use proptest::prelude::*;

    /// A log of scans every tenth of a second, with odometry lines between them.
    fn log(n_scans: u32) -> String {
        let lines = (0..n_scans).flat_map(|i| {
            let t = f64::from(i) * 0.1;
            let later = t + 0.01;
            [
                format!("ODOM {t} 0 0 0 0 0 {t:.6} h 0"),
                format!("FLASER 3 1 50 79.995 0 0 0 {t} 0 0 {later:.6} h 0"),
            ]
        });
        lines.collect::<Vec<_>>().join("\n")
    }

    fn cut(text: &str, from: Option<Place>, to: Option<Place>) -> Vec<CutBatch> {
        let survey = survey(Lines::new(text.as_bytes()));
        let section = Section::new(from, to, survey.account.stamps_span_ns().unwrap_or_default());
        Batches::new(Lines::new(text.as_bytes()), &survey, section)
            .collect::<io::Result<_>>()
            .expect("the text is still the same")
    }

    #[test]
    fn odometry_goes_before_its_scan_and_no_return_is_infinite() {
        let batches = cut(&log(1), None, None);
        let [line, odometry, scan] = &batches[0].batch.observations[..] else {
            panic!("three observations: {batches:?}")
        };
        assert_eq!(line.stamp_ns, 0, "the ODOM line");
        assert_eq!(odometry.stamp_ns, scan.stamp_ns, "one line, one stamp");
        assert!(matches!(odometry.kind, Some(Kind::OdometryPose(_))), "{odometry:?}");
        let Some(Kind::LaserScan(laser_scan)) = &scan.kind else { panic!("{scan:?}") };
        assert_eq!(laser_scan.ranges_m, [1.0, f32::INFINITY, f32::INFINITY], "50 and the maximum");
        assert_eq!(scan.sensor_id, "front_laser", "as declared");
    }

    #[test]
    fn batches_hold_about_a_second() {
        let batches = cut(&log(100), None, None);
        assert_eq!(batches.iter().map(|batch| batch.n_readings).sum::<u64>(), 100, "all scans");
        assert!((8..=12).contains(&batches.len()), "{} batches of 10 s", batches.len());
    }

    #[test]
    fn a_section_is_cut_out() {
        let batches = cut(&log(100), Some(Place::Seconds(2.0)), Some(Place::Fraction(0.5)));
        let n_scans: u64 = batches.iter().map(|batch| batch.n_readings).sum();
        assert!((29..=31).contains(&n_scans), "{n_scans} scans from 2 s to 4.95 s");
    }

    #[test]
    fn a_recording_that_changed_is_not_taken_for_its_end() {
        let survey = survey(Lines::new(log(9).as_bytes()));
        let shorter = log(8);
        let section = Section::new(None, None, (0, 0));
        let mut batches = Batches::new(Lines::new(shorter.as_bytes()), &survey, section);
        let last = batches.next().expect("something");
        let error = last.expect_err("two lines are missing");
        assert_eq!(error.to_string(), "the recording has 16 lines and had 18 a moment ago", "why");
        assert!(batches.next().is_none(), "and nothing more");
    }

    proptest! {
        #[test]
        fn batches_are_the_observations_in_order_and_numbered(n_scans in 0_u32..80) {
            let batches = cut(&log(n_scans), None, None);
            let mut stamps_ns = Vec::new();
            for (batch, number) in batches.iter().zip(1..) {
                prop_assert_eq!(batch.batch.number, number);
                prop_assert!(batch.n_readings <= READINGS_MAX as u64);
                stamps_ns.extend(batch.batch.observations.iter().map(|o| o.stamp_ns));
            }
            let whole = log(n_scans);
            let expected: Vec<_> = whole
                .lines()
                .filter_map(|line| match carmen::parse(line.as_bytes()) {
                    Ok(Message::Odometry { stamp_ns, .. }) => Some(vec![stamp_ns]),
                    Ok(Message::Scan(scan)) => Some(vec![scan.stamp_ns; 2]),
                    _ => None,
                })
                .flatten()
                .collect();
            prop_assert_eq!(stamps_ns, expected);
        }

        #[test]
        fn no_file_can_make_it_panic(bytes in prop::collection::vec(any::<u8>(), 0..2000)) {
            let survey = survey(Lines::new(&bytes[..]));
            let section = Section::new(None, Some(Place::Fraction(0.5)), (i64::MIN, i64::MAX));
            Batches::new(Lines::new(&bytes[..]), &survey, section).for_each(drop);
        }

        #[test]
        fn no_damage_to_a_log_can_make_it_panic(
            changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..60),
        ) {
            let mut bytes = log(20).into_bytes();
            for (place, byte) in changes {
                let place = place.index(bytes.len());
                bytes[place] = byte;
            }
            let survey = survey(Lines::new(&bytes[..]));
            let section = Section::new(None, None, survey.account.stamps_span_ns().unwrap_or_default());
            let batches: Vec<_> = Batches::new(Lines::new(&bytes[..]), &survey, section)
                .collect::<io::Result<_>>()
                .expect("the same bytes twice");
            let n_scans: u64 = batches.iter().map(|batch| batch.n_readings).sum();
            prop_assert_eq!(n_scans, survey.account.stamps_ns.len() as u64);
        }
    }
}
