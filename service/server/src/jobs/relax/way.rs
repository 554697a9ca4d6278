//! The way of a session out of its batches: its course, and the scans along it where they are wanted.

use std::sync::Arc;

use meetpoint_proto::v1;
use meetpoint_storage::{BatchPayload, SessionRecord};
use meetpoint_tracking::{SensorKind, TravelLaser};
use prost::Message;
use v1::observation::Kind;

use super::course::{Course, CourseReader};
use crate::convert::{sensor, session};
use crate::error::Error;

/// A session's way.
#[derive(Debug)]
pub(super) struct Way {
    pub(super) course: Course,
    pub(super) lasers: Vec<TravelLaser>,
    /// In the order of arrival; none where they are not wanted.
    pub(super) scans: Vec<WayScan>,
}

/// A laser scan along a way.
#[derive(Clone, Debug)]
pub(super) struct WayScan {
    /// Its place among the course's moments.
    pub(super) moment: usize,
    /// Its place among the way's lasers.
    pub(super) laser: usize,
    /// One range a beam in metres, as REP 117 reads them.
    pub(super) ranges_m: Arc<[f32]>,
}

/// Reads a session's batches, one after the other.
pub(super) struct WayReader {
    course: CourseReader,
    /// Names of the lasers, in their order.
    names: Vec<String>,
    lasers: Vec<TravelLaser>,
    scans: Vec<WayScan>,
    /// Bytes that ranges still may take; `None` if scans are not wanted.
    bytes_left: Option<usize>,
    /// Why reading was given up.
    problem: Option<String>,
}

impl Way {
    /// What the scans take in memory.
    pub(super) fn n_scan_bytes(&self) -> usize {
        self.scans.iter().map(|scan| size_of_val(&*scan.ranges_m)).sum()
    }
}

impl WayReader {
    /// Begins to read a session; `scans_bytes_max` is how much its scans may take in memory, `None` if
    /// they are not wanted.
    ///
    /// # Errors
    /// [`Error::Internal`] for a session that could not have been opened.
    pub(super) fn new(
        record: &SessionRecord,
        scans_bytes_max: Option<usize>,
    ) -> Result<Self, Error> {
        let declared = session::declaration(&record.declaration)?.sensors;
        let course = CourseReader::new(&declared)?;
        let (mut names, mut lasers) = (Vec::new(), Vec::new());
        for sensor in sensor::sensors(&declared)? {
            let &SensorKind::Laser(geometry) = &sensor.sensor.kind else { continue };
            names.push(sensor.id);
            lasers
                .push(TravelLaser { robot_from_sensor: sensor.sensor.robot_from_sensor, geometry });
        }
        let scans = Vec::new();
        Ok(Self { course, names, lasers, scans, bytes_left: scans_bytes_max, problem: None })
    }

    /// Reads batches, as far as they are not rejected.
    ///
    /// # Errors
    /// [`Error::Internal`] for bytes that are no batch.
    pub(super) fn read(&mut self, batches: Vec<BatchPayload>) -> Result<(), Error> {
        for BatchPayload { number: _, payload, rejected } in batches {
            let batch = v1::Batch::decode(payload.as_slice()).map_err(Error::internal)?;
            for (index, mut observation) in (0_u32..).zip(batch.observations) {
                if !rejected.contains(&index) {
                    self.keep_scan(&mut observation);
                    self.course.read(observation);
                }
            }
        }
        Ok(())
    }

    /// Takes the ranges out of a scan that is wanted.
    fn keep_scan(&mut self, observation: &mut v1::Observation) {
        let (Some(bytes_left), Some(Kind::LaserScan(scan))) =
            (&mut self.bytes_left, &mut observation.kind)
        else {
            return;
        };
        let Some(laser) = self.names.iter().position(|name| *name == observation.sensor_id) else {
            return;
        };
        let n_bytes = size_of_val(scan.ranges_m.as_slice());
        match bytes_left.checked_sub(n_bytes) {
            Some(left) => *bytes_left = left,
            None => {
                self.problem.get_or_insert_with(|| {
                    let n_scans = self.scans.len();
                    format!("{n_scans} of its scans fill the memory that a job may take for them")
                });
                return;
            }
        }
        let ranges_m = std::mem::take(&mut scan.ranges_m).into();
        self.scans.push(WayScan { moment: self.course.n_moments(), laser, ranges_m });
    }

    /// The whole way.
    ///
    /// # Errors
    /// What was too much, for people.
    pub(super) fn finish(self) -> Result<Way, String> {
        let Self { course, lasers, scans, problem, .. } = self;
        match problem {
            Some(problem) => Err(problem),
            None => Ok(Way { course: course.finish(), lasers, scans }),
        }
    }
}
