//! The way of a session out of its batches: its course, and the scans along it where they are wanted.

use std::sync::Arc;

use meetpoint_proto::v1;
use meetpoint_storage::{BatchPayload, SessionId, SessionRecord};
use meetpoint_tracking::{SensorKind, TravelLaser};
use prost::Message;
use v1::observation::Kind;

use super::super::running::Stopped;
use super::super::workbench::Workbench;
use super::course::{Course, CourseReader};
use crate::convert::{sensor, session};
use crate::{error::Error, service::Service};

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

/// Batches of a session read at a time: at most 16 MiB.
const N_BATCHES_READ: u32 = 16;

/// Reads a session's batches, one after the other.
struct WayReader {
    session: SessionId,
    /// Batches up to this one are read...
    through: u64,
    /// ...from this one on.
    next: u64,
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

/// The way of a session out of the journal up to a batch, while the service has time; what was too much
/// for it, for people, if its scans take more than `scans_bytes_max`. Without a limit they are not kept.
pub(super) async fn way(
    (service, bench): (&Service, &Workbench),
    record: &SessionRecord,
    through: u64,
    scans_bytes_max: Option<usize>,
) -> Result<Result<Way, String>, Stopped> {
    let mut reader = WayReader::new(record, through, scans_bytes_max)?;
    while let Some(batches) = reader.next(service).await? {
        reader = bench.slice(move || reader.read(batches)).await??;
    }
    Ok(reader.finish())
}

/// The same at once, for somebody who waits.
pub(super) async fn way_now(
    service: &Service,
    record: &SessionRecord,
    through: u64,
    scans_bytes_max: Option<usize>,
) -> Result<Result<Way, String>, Error> {
    let mut reader = WayReader::new(record, through, scans_bytes_max)?;
    while let Some(batches) = reader.next(service).await? {
        let read = tokio::task::spawn_blocking(move || reader.read(batches));
        reader = read.await.map_err(Error::internal)??;
    }
    Ok(reader.finish())
}

impl WayReader {
    /// Begins to read a session; [`Error::Internal`] if it could not have been opened.
    fn new(
        record: &SessionRecord,
        through: u64,
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
        Ok(Self {
            session: record.id,
            through,
            next: 1,
            course,
            names,
            lasers,
            scans,
            bytes_left: scans_bytes_max,
            problem: None,
        })
    }

    /// The next batches; `None` after the last.
    async fn next(&mut self, service: &Service) -> Result<Option<Vec<BatchPayload>>, Error> {
        let read = service.store.session_batches(self.session, self.next, N_BATCHES_READ);
        let mut batches = read.await?;
        batches.retain(|batch| batch.number <= self.through);
        let Some(last) = batches.last() else { return Ok(None) };
        self.next = last.number + 1;
        Ok(Some(batches))
    }

    /// Reads batches, as far as they are not rejected; [`Error::Internal`] for bytes that are no batch.
    fn read(mut self, batches: Vec<BatchPayload>) -> Result<Self, Error> {
        for BatchPayload { number: _, payload, rejected } in batches {
            let batch = v1::Batch::decode(payload.as_slice()).map_err(Error::internal)?;
            for (index, mut observation) in (0_u32..).zip(batch.observations) {
                if !rejected.contains(&index) {
                    self.keep_scan(&mut observation);
                    self.course.read(observation);
                }
            }
        }
        Ok(self)
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

    /// The whole way, or what was too much, for people.
    fn finish(self) -> Result<Way, String> {
        let Self { course, lasers, scans, problem, .. } = self;
        match problem {
            Some(problem) => Err(problem),
            None => Ok(Way { course: course.finish(), lasers, scans }),
        }
    }
}
