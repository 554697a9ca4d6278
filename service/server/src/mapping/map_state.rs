//! All that mapping knows of one map: a pure function of the journal, entry by entry.

use std::collections::BTreeMap;
use std::sync::Arc;

use meetpoint_geometry::Pose;
use meetpoint_occupancy::Grid;
use meetpoint_proto::v1;
use meetpoint_storage::{
    JournalEntry, JournalEvent, JournalSeq, PoseRecord, SessionId, TrajectoryOrigin,
};
use meetpoint_tracking::{Estimate, LiveMap, SensorKind, SessionConfig, SessionKey};
use prost::Message;

use super::decisions::Decisions;
use super::placements::Place;
use super::relaxations::Relaxations;
use super::sensing::Sensing;
use crate::convert::{import, observation, pose, sensor, sensor::DeclaredSensor, session};
use crate::error::Error;

/// A map as it grows.
pub(crate) struct MapState {
    /// What readings are taken to mean.
    pub(super) sensing: Arc<Sensing>,
    /// The same where nobody decided about the map.
    pub(super) service_sensing: Arc<Sensing>,
    pub(super) resolution_m: f64,
    /// Where robots are known to have been, and where merges put sessions.
    pub(super) decisions: Decisions,
    /// The site's frame: sessions of known start, and merged ones.
    pub(super) site: LiveMap,
    /// Frames of sessions of unknown start: each in its own, or in that of one it was merged with.
    pub(super) unplaced: BTreeMap<SessionId, LiveMap>,
    /// Sessions that have not ended.
    pub(super) sessions: BTreeMap<SessionId, OpenSession>,
    /// Poses since the last snapshot.
    pub(super) poses: BTreeMap<SessionId, NewPoses>,
    /// Journal entries up to this one are in.
    pub(super) position: JournalSeq,
    /// Scans since the last snapshot.
    pub(super) n_scans_since_snapshot: u64,
}

/// A session that sends.
#[derive(Debug)]
pub(super) struct OpenSession {
    pub(super) declaration: Vec<u8>,
    pub(super) sensors: Vec<DeclaredSensor>,
    /// Where its own frame lies, in which its trajectory is.
    pub(super) place: Place,
    pub(super) mapped_through: u64,
    /// Poses of its trajectory so far.
    pub(super) n_poses: u64,
}

/// Poses to be written, and where they stand in the trajectory.
#[derive(Debug)]
pub(super) struct NewPoses {
    pub(super) origin: TrajectoryOrigin,
    pub(super) first_index: u64,
    pub(super) poses: Vec<PoseRecord>,
}

/// What an entry did.
#[derive(Debug, Default)]
pub(crate) struct Applied {
    /// The session it belongs to.
    pub(crate) session: Option<SessionId>,
    /// Batches of that session up to this number are in.
    pub(crate) mapped_through: u64,
    /// The newest pose.
    pub(crate) correction: Option<v1::PoseCorrection>,
    /// When it came in, by the service's clock, nanoseconds since 1970.
    pub(crate) receive_time_ns: i64,
    /// Scans mapped, of lasers and sonars.
    pub(crate) n_scans: u64,
    /// Time that the robot's clock advanced, nanoseconds.
    pub(crate) advanced_ns: i64,
    /// A session ended: the map is complete as far as it is concerned.
    pub(crate) ended: bool,
    /// A map that was made elsewhere was taken in.
    pub(crate) imported: bool,
}

impl MapState {
    /// An empty map, to be drawn by these decisions.
    ///
    /// # Errors
    /// [`Error::Internal`] for a resolution that no map can have.
    pub(crate) fn new(
        service_sensing: &Arc<Sensing>,
        resolution_m: f64,
        decisions: Decisions,
    ) -> Result<Self, Error> {
        let sensing = decisions.sensing(service_sensing)?;
        Ok(Self {
            site: sensing.empty_map(resolution_m)?,
            sensing,
            service_sensing: service_sensing.clone(),
            resolution_m,
            decisions,
            unplaced: BTreeMap::new(),
            sessions: BTreeMap::new(),
            poses: BTreeMap::new(),
            position: JournalSeq(0),
            n_scans_since_snapshot: 0,
        })
    }

    /// The site's grid.
    pub(super) fn grid(&self) -> &Grid {
        self.site.grid()
    }

    /// The grid of the map's frame, or that of a session that is not placed, if anything is mapped in it.
    pub(super) fn grid_in(&self, frame: Option<SessionId>) -> Option<&Grid> {
        match frame {
            None => Some(self.grid()),
            Some(frame) => self.unplaced.get(&frame).map(LiveMap::grid),
        }
    }

    /// The place in the journal up to which everything is in.
    pub(crate) fn position(&self) -> JournalSeq {
        self.position
    }

    /// True if there is nothing that the last snapshot lacks.
    pub(crate) fn is_saved(&self) -> bool {
        self.n_scans_since_snapshot == 0 && self.poses.values().all(|new| new.poses.is_empty())
    }

    /// Scans since the last snapshot.
    pub(crate) fn n_scans_since_snapshot(&self) -> u64 {
        self.n_scans_since_snapshot
    }

    /// The poses of a session since the last snapshot, in the session's frame.
    pub(crate) fn poses_of(&self, session: SessionId) -> &[PoseRecord] {
        self.poses.get(&session).map_or(&[], |new| &new.poses)
    }

    /// How far each open session is.
    pub(crate) fn progress(&self) -> impl Iterator<Item = (SessionId, u64)> + '_ {
        self.sessions.iter().map(|(&id, session)| (id, session.mapped_through))
    }

    /// Takes the next entry in.
    ///
    /// # Errors
    /// [`Error::Internal`] if the journal holds what ingest never lets through.
    pub(crate) fn apply(&mut self, entry: JournalEntry) -> Result<Applied, Error> {
        let JournalEntry { seq, receive_time_ns, event } = entry;
        let applied = match event {
            JournalEvent::SessionOpened { session, declaration, map_from_session } => {
                self.open(session, declaration, map_from_session.map(pose::from_record))?;
                Applied { session: Some(session), ..Applied::default() }
            }
            JournalEvent::Batch { session, number, payload, rejected } => {
                self.batch(session, number, &payload, &rejected)?
            }
            JournalEvent::Skipped { session, from: _, through } => self.skip(session, through),
            JournalEvent::SessionClosed { session } | JournalEvent::SessionFenced { session } => {
                self.end(session)
            }
            JournalEvent::MapImported { payload } => self.import(&payload)?,
            JournalEvent::MappingParametersDecided { payload } => {
                self.decide_parameters(payload, seq)?;
                Applied::default()
            }
            // What was decided is in from the beginning, or the job that draws by it replaces this map.
            JournalEvent::SessionsRelaxed { .. }
            | JournalEvent::VersionPublished { .. }
            | JournalEvent::CostDecided { .. }
            | JournalEvent::ClosureSwitched { .. }
            | JournalEvent::MergeDecided { .. }
            | JournalEvent::HypothesisDecided { .. }
            | JournalEvent::ExplorationDecided { .. }
            | JournalEvent::MapCreated => Applied::default(),
        };
        self.position = seq;
        self.n_scans_since_snapshot += applied.n_scans;
        Ok(Applied { receive_time_ns, ..applied })
    }

    /// The site becomes the imported map. Sessions that are open draw on it from now on; by the
    /// rules of importing none has drawn before.
    fn import(&mut self, payload: &[u8]) -> Result<Applied, Error> {
        let raster = import::recorded(payload)?.raster;
        let tiles = Grid::from_raster(&raster);
        let tiles = tiles.tiles().map(|(index, tile)| (index, tile.clone()));
        let state = self.site.state_bytes();
        self.site = self.sensing.restored_map(self.resolution_m, tiles, &state)?;
        Ok(Applied { imported: true, ..Applied::default() })
    }

    /// Parameters that nothing was drawn by yet hold from now on; others when a job draws the map by them.
    fn decide_parameters(&mut self, payload: Vec<u8>, seq: JournalSeq) -> Result<(), Error> {
        let is_untouched = self.sessions.is_empty()
            && self.unplaced.is_empty()
            && self.grid().tiles().next().is_none();
        if is_untouched && self.decisions.through() < seq {
            self.decisions = self.decisions.clone().with_parameters(payload, seq);
            self.sensing = self.decisions.sensing(&self.service_sensing)?;
            self.site = self.sensing.empty_map(self.resolution_m)?;
        }
        Ok(())
    }

    fn open(
        &mut self,
        id: SessionId,
        declaration: Vec<u8>,
        declared: Option<Pose>,
    ) -> Result<(), Error> {
        let sensors = sensor::sensors(&session::declaration(&declaration)?.sensors)?;
        let place = self.decisions.place(id, declared);
        let config = SessionConfig {
            map_from_start: place.frame_from_session,
            sensors: sensors.iter().map(|declared| declared.sensor.clone()).collect(),
        };
        let map = match place.frame {
            None => &mut self.site,
            Some(frame) => {
                let new = self.sensing.empty_map(self.resolution_m)?;
                self.unplaced.entry(frame).or_insert(new)
            }
        };
        map.open_session(key(id), config);
        let open = OpenSession { declaration, sensors, place, mapped_through: 0, n_poses: 0 };
        self.sessions.insert(id, open);
        Ok(())
    }

    fn batch(
        &mut self,
        id: SessionId,
        number: u64,
        payload: &[u8],
        rejected: &[u32],
    ) -> Result<Applied, Error> {
        let batch = v1::Batch::decode(payload).map_err(Error::internal)?;
        let open = self
            .sessions
            .get_mut(&id)
            .ok_or_else(|| Error::internal(format!("batch {number} of a session not open")))?;
        let map = drawn_on(&mut self.site, &mut self.unplaced, open.place);
        let relaxations = self.decisions.relaxations();
        let origin = origin(relaxations, id, &open.sensors);
        let first_index = open.n_poses;
        let new = self.poses.entry(id).or_insert(NewPoses { origin, first_index, poses: vec![] });
        let mut applied =
            Applied { session: Some(id), mapped_through: number, ..Applied::default() };
        let (mut first_ns, mut last_ns) = (i64::MAX, i64::MIN);
        for (index, wire) in (0_u32..).zip(batch.observations) {
            if rejected.contains(&index) {
                continue;
            }
            applied.n_scans += u64::from(is_scan(&wire));
            let Some(observation) = observation::observation(wire, &open.sensors) else { continue };
            first_ns = first_ns.min(observation.stamp_ns);
            last_ns = last_ns.max(observation.stamp_ns);
            let index = new.first_index + new.poses.len() as u64;
            let estimate = match relaxations.pose(id, index) {
                Some(pose) => {
                    map.apply_at(key(id), &observation, open.place.frame_from_session * pose)
                }
                None => map.apply(key(id), &observation),
            };
            if let Some(estimate) = estimate {
                new.poses.push(pose_record(&estimate, open.place));
                applied.correction = Some(correction(number, &estimate, open));
            }
        }
        open.n_poses = new.first_index + new.poses.len() as u64;
        open.mapped_through = number;
        applied.advanced_ns = last_ns.saturating_sub(first_ns).max(0);
        Ok(applied)
    }

    fn skip(&mut self, id: SessionId, through: u64) -> Applied {
        if let Some(open) = self.sessions.get_mut(&id) {
            open.mapped_through = through;
            drawn_on(&mut self.site, &mut self.unplaced, open.place).break_odometry(key(id));
        }
        Applied { session: Some(id), mapped_through: through, ..Applied::default() }
    }

    fn end(&mut self, id: SessionId) -> Applied {
        let mut mapped_through = 0;
        if let Some(open) = self.sessions.remove(&id) {
            mapped_through = open.mapped_through;
            drawn_on(&mut self.site, &mut self.unplaced, open.place).close_session(key(id));
        }
        Applied { session: Some(id), mapped_through, ended: true, ..Applied::default() }
    }
}

/// The map that a session is drawn on.
fn drawn_on<'a>(
    site: &'a mut LiveMap,
    unplaced: &'a mut BTreeMap<SessionId, LiveMap>,
    place: Place,
) -> &'a mut LiveMap {
    place.frame.and_then(|frame| unplaced.get_mut(&frame)).unwrap_or(site)
}

fn is_scan(wire: &v1::Observation) -> bool {
    use v1::observation::Kind;
    matches!(wire.kind, Some(Kind::LaserScan(_) | Kind::SonarScan(_)))
}

pub(super) fn key(id: SessionId) -> SessionKey {
    SessionKey(id.0.as_u128())
}

/// What the poses of a session are computed from.
fn origin(
    relaxations: &Relaxations,
    id: SessionId,
    sensors: &[DeclaredSensor],
) -> TrajectoryOrigin {
    let is_matched = |declared: &DeclaredSensor| {
        matches!(declared.sensor.kind, SensorKind::Laser(_) | SensorKind::SonarRing(_))
    };
    if relaxations.has(id) {
        TrajectoryOrigin::Relaxation
    } else if sensors.iter().any(is_matched) {
        TrajectoryOrigin::Tracking
    } else {
        TrajectoryOrigin::Odometry
    }
}

/// Stored poses are robot poses in the session's frame.
fn pose_record(estimate: &Estimate, place: Place) -> PoseRecord {
    let session_from_frame = place.frame_from_session.inverse();
    let Pose { x_m, y_m, theta_rad } = session_from_frame * estimate.map_from_robot;
    PoseRecord {
        stamp_ns: estimate.stamp_ns,
        sensor: estimate.sensor.and_then(|sensor| u8::try_from(sensor).ok()),
        lost: estimate.lost,
        drawn: estimate.drawn,
        x_m,
        y_m,
        theta_rad,
    }
}

fn correction(number: u64, estimate: &Estimate, open: &OpenSession) -> v1::PoseCorrection {
    let sensor = estimate.sensor.and_then(|sensor| open.sensors.get(sensor));
    v1::PoseCorrection {
        batch_number: number,
        stamp_ns: estimate.stamp_ns,
        sensor_id: sensor.map_or_else(String::new, |declared| declared.id.clone()),
        map_from_robot: Some(pose::to_wire(estimate.map_from_robot)),
        map_from_odometry: Some(pose::to_wire(estimate.map_from_odometry)),
        lost: estimate.lost,
        frame_session: open.place.frame.map(|frame| frame.0.to_string()).unwrap_or_default(),
    }
}
