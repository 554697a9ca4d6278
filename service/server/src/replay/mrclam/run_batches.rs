//! The second pass over a robot's run: its observations, cut into numbered batches.

use meetpoint_client::v1::{LandmarkSighting, Observation, OdometryVelocity, observation::Kind};

use super::{
    row::OdometryRow,
    run::{CAMERA, Notice, Run, Sighting},
};
use crate::replay::{
    cutter::{CutBatch, Cutter},
    section::Section,
};

/// Numbers of a sighting.
const SIGHTING_VALUES: usize = 2;

/// Gives the batches of a run in order.
pub(crate) struct RunBatches<'a> {
    notices: std::slice::Iter<'a, Notice>,
    section: Section,
    cutter: Cutter,
}

impl<'a> RunBatches<'a> {
    /// The batches of the part `section` of a run.
    pub(crate) fn new(run: &'a Run, section: Section) -> Self {
        Self { notices: run.notices.iter(), section, cutter: Cutter::default() }
    }
}

impl Iterator for RunBatches<'_> {
    type Item = CutBatch;

    fn next(&mut self) -> Option<CutBatch> {
        let Self { notices, section, cutter } = self;
        for notice in notices.filter(|notice| section.contains(notice.stamp_ns())) {
            let stamp_ns = notice.stamp_ns();
            // Velocities come all the time, sightings do not: a batch must not wait for one.
            cutter.begin_span(stamp_ns);
            match notice {
                Notice::Odometry(row) => cutter.push(velocity(row)),
                Notice::Sighting(seen) => cutter.push_reading(sighting(seen), SIGHTING_VALUES),
            }
            if let Some(batch) = cutter.cut_if_full(stamp_ns) {
                return Some(batch);
            }
        }
        cutter.cut()
    }
}

fn velocity(row: &OdometryRow) -> Observation {
    let &OdometryRow { stamp_ns, forward_m_per_s, turn_rad_per_s } = row;
    let velocity = OdometryVelocity { forward_m_per_s, left_m_per_s: 0.0, turn_rad_per_s };
    Observation { stamp_ns, kind: Some(Kind::OdometryVelocity(velocity)), ..Observation::default() }
}

fn sighting(seen: &Sighting) -> Observation {
    let &Sighting { stamp_ns, subject, range_m, bearing_rad } = seen;
    let sighting = LandmarkSighting {
        identity: subject.map(|number| number.to_string()),
        landmark_type: String::new(),
        bearing_rad: Some(bearing_rad),
        range_m: Some(range_m),
    };
    Observation {
        stamp_ns,
        sensor_id: CAMERA.to_owned(),
        kind: Some(Kind::LandmarkSighting(sighting)),
        ..Observation::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::replay::{
        account::{Account, BadLines, Reading},
        section::Place,
    };
    use meetpoint_client::v1;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    /// A run with velocities every tenth of a second, and a sighting after every `n`th of them.
    fn run(n_velocities: u32, n: u32) -> Run {
        let mut notices = Vec::new();
        let mut stamps_ns = Vec::new();
        for index in 0..n_velocities {
            let stamp_ns = i64::from(index) * 100_000_000;
            let row = OdometryRow { stamp_ns, forward_m_per_s: 0.1, turn_rad_per_s: 0.0 };
            notices.push(Notice::Odometry(row));
            if index.is_multiple_of(n) {
                let seen = Sighting { stamp_ns, subject: Some(6), range_m: 2.0, bearing_rad: 0.1 };
                notices.push(Notice::Sighting(seen));
                stamps_ns.push(stamp_ns);
            }
        }
        let account = Account {
            content_hash: blake3::hash(b""),
            reading: Reading::Sighting,
            stamps_ns,
            n_lines: 0,
            skipped: BTreeMap::new(),
            bad: BadLines::default(),
            broken_off: None,
        };
        Run { account, sensor: v1::Sensor::default(), notices }
    }

    fn cut(run: &Run, from: Option<Place>, to: Option<Place>) -> Vec<CutBatch> {
        let stamps_ns = run.account.stamps_span_ns().unwrap_or_default();
        RunBatches::new(run, Section::new(from, to, stamps_ns)).collect()
    }

    #[test]
    fn batches_hold_about_a_second_even_without_sightings() {
        let batches = cut(&run(100, 1000), None, None);
        assert!((8..=12).contains(&batches.len()), "{} batches of 10 s", batches.len());
        assert_eq!(batches.iter().map(|batch| batch.n_readings).sum::<u64>(), 1, "at the start");
    }

    #[test]
    fn a_section_is_cut_out() {
        let batches = cut(&run(101, 1), Some(Place::Seconds(2.0)), Some(Place::Fraction(0.5)));
        let n_readings: u64 = batches.iter().map(|batch| batch.n_readings).sum();
        assert_eq!(n_readings, 30, "from 2 s on and before 5 s");
    }

    #[test]
    fn identities_are_subject_numbers() {
        let batches = cut(&run(1, 1), None, None);
        let [velocity, sighting] = &batches[0].batch.observations[..] else {
            panic!("two observations: {batches:?}")
        };
        assert!(matches!(velocity.kind, Some(Kind::OdometryVelocity(_))), "{velocity:?}");
        let Some(Kind::LandmarkSighting(seen)) = &sighting.kind else { panic!("{sighting:?}") };
        assert_eq!(seen.identity.as_deref(), Some("6"), "who");
        assert_eq!((seen.range_m, seen.bearing_rad), (Some(2.0), Some(0.1)), "where");
        assert_eq!(sighting.sensor_id, CAMERA, "as declared");
    }

    proptest! {
        #[test]
        fn batches_are_the_notices_in_order_and_numbered(n in 0_u32..200, every in 1_u32..20) {
            let run = run(n, every);
            let batches = cut(&run, None, None);
            let numbers: Vec<u64> = batches.iter().map(|batch| batch.batch.number).collect();
            prop_assert_eq!(numbers, (1..=batches.len() as u64).collect::<Vec<_>>());
            let observations = batches.iter().flat_map(|batch| &batch.batch.observations);
            let stamps_ns: Vec<i64> = observations.map(|observation| observation.stamp_ns).collect();
            let expected: Vec<i64> = run.notices.iter().map(Notice::stamp_ns).collect();
            prop_assert_eq!(stamps_ns, expected);
        }
    }
}
