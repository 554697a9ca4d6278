//! A map as it grows: one grid, and the sessions that draw it.

use std::collections::BTreeMap;
use std::sync::Arc;

use meetpoint_geometry::{GridFrame, InvalidResolution, Pose};
use meetpoint_occupancy::{Grid, LaserGeometry, ScanMarks, Tile, TileIndex};

use crate::live::hearing::Heard;
use crate::live::matcher::Chart;
use crate::live::observation::{
    Estimate, Observation, ObservationKind, SensorKind, SessionConfig, SessionKey,
};
use crate::live::odometry::Velocity;
use crate::live::sonar_networks::SonarNetworks;
use crate::live::state::{InvalidState, StateReader, StateWriter};
use crate::live::tracker::Tracker;
use crate::matching::field::Field;
use crate::matching::points::scan_points;
use crate::params::MappingParams;

/// First byte of a stored state: the format that follows.
const FORMAT: u8 = 3;

/// A growing map and the sessions on it.
///
/// The same calls in the same order give the same bits, also if the map was stored and restored in
/// between.
#[derive(Debug)]
pub struct LiveMap {
    pub(super) params: MappingParams,
    pub(super) grid: Grid,
    /// Invariant: the field of `grid`.
    field: Field,
    pub(super) sessions: BTreeMap<SessionKey, Tracker>,
    pub(super) n_drawn: u64,
    marks: ScanMarks,
    /// Interpret sonars.
    pub(super) networks: SonarNetworks,
}

impl LiveMap {
    /// An empty map with cells of `resolution_m` metres a side.
    ///
    /// # Errors
    /// [`InvalidResolution`] unless it is finite and positive.
    pub fn new(params: MappingParams, resolution_m: f64) -> Result<Self, InvalidResolution> {
        Ok(Self::of_grid(params, Grid::new(GridFrame::new(resolution_m)?)))
    }

    #[expect(clippy::large_types_passed_by_value, reason = "it is kept")]
    fn of_grid(params: MappingParams, grid: Grid) -> Self {
        let field = Field::new(&grid, &params.field);
        let marks = ScanMarks::new();
        let networks = SonarNetworks::shipped();
        Self { params, grid, field, sessions: BTreeMap::new(), n_drawn: 0, marks, networks }
    }

    /// The same, with these networks to interpret sonars from now on instead of those that ship.
    #[must_use]
    pub fn with_networks(self, networks: SonarNetworks) -> Self {
        Self { networks, ..self }
    }

    /// Opens a session; one already open under that key starts afresh.
    pub fn open_session(&mut self, key: SessionKey, config: SessionConfig) {
        self.sessions.insert(key, Tracker::new(config));
    }

    /// Closes a session. What it drew stays.
    pub fn close_session(&mut self, key: SessionKey) {
        self.sessions.remove(&key);
    }

    /// Says that observations are missing here: what the odometry says next is not chained to what
    /// it said before, and the robot is searched for further about.
    pub fn break_odometry(&mut self, key: SessionKey) {
        if let Some(tracker) = self.sessions.get_mut(&key) {
            tracker.break_odometry();
        }
    }

    /// Takes one observation, in the order of arrival, and says where the robot was. `None` for
    /// odometry, for a session that is not open, and for a scan of a sensor that is no laser of
    /// that session. Any numbers may come: what cannot be used moves nothing.
    pub fn apply(&mut self, key: SessionKey, observation: &Observation) -> Option<Estimate> {
        let tracker = self.sessions.get_mut(&key)?;
        let stamp_ns = observation.stamp_ns;
        match &observation.kind {
            ObservationKind::OdometryPose(pose) => {
                tracker.odometry.add_pose(stamp_ns, *pose);
                chain_if_reckoned(tracker, stamp_ns);
                None
            }
            &ObservationKind::OdometryVelocity {
                forward_m_per_s,
                left_m_per_s,
                turn_rad_per_s,
            } => {
                let velocity = Velocity { forward_m_per_s, left_m_per_s, turn_rad_per_s };
                tracker.odometry.add_velocity(stamp_ns, velocity);
                chain_if_reckoned(tracker, stamp_ns);
                None
            }
            ObservationKind::LaserScan { sensor, ranges_m } => {
                let declared = tracker.config.sensors.get(*sensor)?;
                let &SensorKind::Laser(geometry) = &declared.kind else { return None };
                let robot_from_sensor = declared.robot_from_sensor;
                self.apply_scan(key, stamp_ns, *sensor, (robot_from_sensor, geometry), ranges_m)
            }
            ObservationKind::SonarScan { sensor, ranges_m } => {
                reckon_if_reckoned(tracker, stamp_ns);
                let by_odometry = Heard::AtPredicted(tracker.predicted(stamp_ns));
                let drawn = self.hear(key, by_odometry, (*sensor, ranges_m));
                let tracker = self.sessions.get(&key)?;
                Some(Estimate { drawn, ..estimate_by_odometry(tracker, stamp_ns, Some(*sensor)) })
            }
            ObservationKind::LandmarkSighting { sensor } => {
                reckon_if_reckoned(tracker, stamp_ns);
                Some(estimate_by_odometry(tracker, stamp_ns, Some(*sensor)))
            }
            ObservationKind::Mark => {
                reckon_if_reckoned(tracker, stamp_ns);
                Some(estimate_by_odometry(tracker, stamp_ns, None))
            }
        }
    }

    /// Takes one observation at which the robot's pose is known from elsewhere: a scan is drawn there
    /// without being matched, and tracking goes on from it. Of odometry, the pose is not used.
    /// Otherwise as [`LiveMap::apply`]; a pose that is not finite is not believed.
    pub fn apply_at(
        &mut self,
        key: SessionKey,
        observation: &Observation,
        map_from_robot: Pose,
    ) -> Option<Estimate> {
        let stamp_ns = observation.stamp_ns;
        let sensor = match &observation.kind {
            ObservationKind::OdometryPose(_) | ObservationKind::OdometryVelocity { .. } => {
                return self.apply(key, observation);
            }
            _ if !map_from_robot.is_finite() => return self.apply(key, observation),
            ObservationKind::Mark => None,
            ObservationKind::LaserScan { sensor, .. }
            | ObservationKind::SonarScan { sensor, .. }
            | ObservationKind::LandmarkSighting { sensor } => Some(*sensor),
        };
        let tracker = self.sessions.get_mut(&key)?;
        let mut drawn = false;
        if let ObservationKind::LaserScan { sensor, ranges_m } = &observation.kind {
            let declared = tracker.config.sensors.get(*sensor)?;
            let &SensorKind::Laser(geometry) = &declared.kind else { return None };
            let map_from_sensor = map_from_robot * declared.robot_from_sensor;
            drawn = tracker.place(stamp_ns, map_from_robot, &self.params.trust);
            if drawn {
                tracker.state.drawn_at = Some(map_from_robot);
                self.draw(stamp_ns, map_from_sensor, &geometry, ranges_m);
            }
        } else {
            tracker.place(stamp_ns, map_from_robot, &self.params.trust);
        }
        if let ObservationKind::SonarScan { sensor, ranges_m } = &observation.kind {
            drawn = self.hear(key, Heard::AtKnown(map_from_robot), (*sensor, ranges_m));
        }
        let tracker = self.sessions.get(&key)?;
        Some(Estimate { drawn, ..estimate_by_odometry(tracker, stamp_ns, sensor) })
    }

    fn draw(
        &mut self,
        stamp_ns: i64,
        map_from_sensor: Pose,
        geometry: &LaserGeometry,
        ranges_m: &[f32],
    ) {
        let model = &self.params.beam_model;
        self.grid.insert_scan(map_from_sensor, geometry, ranges_m, model, &mut self.marks);
        self.grid.remember(stamp_ns, &self.marks);
        self.field.update(&self.grid, self.marks.changed());
        self.n_drawn += 1;
    }

    fn apply_scan(
        &mut self,
        key: SessionKey,
        stamp_ns: i64,
        sensor: usize,
        (robot_from_sensor, geometry): (Pose, LaserGeometry),
        ranges_m: &[f32],
    ) -> Option<Estimate> {
        let tracker = self.sessions.get_mut(&key)?;
        let limits = (self.params.matching.range_max_m, self.params.matching.gap_m);
        let points = scan_points(robot_from_sensor, &geometry, ranges_m, limits);
        let chart = Chart { grid: &self.grid, field: &self.field };
        let tracked = tracker.track(stamp_ns, &points, chart, &self.params);
        let estimate = estimate_by_odometry(tracker, stamp_ns, Some(sensor));
        if tracked.draw {
            let map_from_sensor = tracked.map_from_robot * robot_from_sensor;
            self.draw(stamp_ns, map_from_sensor, &geometry, ranges_m);
        }
        Some(Estimate { drawn: tracked.draw, ..estimate })
    }

    /// The grid drawn so far. Cloning it is cheap.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Scans drawn so far.
    pub fn n_drawn(&self) -> u64 {
        self.n_drawn
    }

    /// All but the grid's tiles, as bytes: with them, what [`LiveMap::restore`] needs.
    pub fn state_bytes(&self) -> Vec<u8> {
        let mut writer = StateWriter::new(FORMAT);
        writer.write_u64(self.n_drawn);
        writer.write_u64(self.sessions.len() as u64);
        for (key, tracker) in &self.sessions {
            writer.write_session(*key, tracker);
        }
        writer.into_bytes()
    }

    /// The map that had these tiles and this state: it goes on as that one would have, bit for
    /// bit, given the same parameters.
    ///
    /// # Errors
    /// [`InvalidState`] if the resolution is no length, or the bytes are not what
    /// [`LiveMap::state_bytes`] writes.
    pub fn restore(
        params: MappingParams,
        resolution_m: f64,
        tiles: impl IntoIterator<Item = (TileIndex, Arc<Tile>)>,
        state: &[u8],
    ) -> Result<Self, InvalidState> {
        let frame = GridFrame::new(resolution_m)
            .map_err(|InvalidResolution(given_m)| InvalidState::Resolution(given_m))?;
        let mut reader = StateReader::new(FORMAT, state)?;
        let mut map = Self::of_grid(params, Grid::from_tiles(frame, tiles));
        map.n_drawn = reader.read_u64()?;
        for _ in 0..reader.read_u64()? {
            let (key, tracker) = reader.read_session()?;
            map.sessions.insert(key, tracker);
        }
        reader.finish()?;
        Ok(map)
    }
}

/// A session without a laser is where its odometry says, from its start on, but for what its sonars correct.
fn chain_if_reckoned(tracker: &mut Tracker, stamp_ns: i64) {
    if tracker.is_reckoned() {
        tracker.chain_odometry(stamp_ns);
    }
}

fn reckon_if_reckoned(tracker: &mut Tracker, stamp_ns: i64) {
    if tracker.is_reckoned() {
        tracker.reckon(stamp_ns);
    }
}

fn estimate_by_odometry(tracker: &Tracker, stamp_ns: i64, sensor: Option<usize>) -> Estimate {
    let map_from_robot = if tracker.state.stamp_ns == Some(stamp_ns) {
        tracker.state.map_from_robot
    } else {
        tracker.predicted(stamp_ns)
    };
    let odometry = tracker.odometry.pose_at(stamp_ns).unwrap_or(Pose::IDENTITY);
    let correction = map_from_robot * odometry.inverse();
    let map_from_odometry = if correction.is_finite() { correction } else { map_from_robot };
    Estimate {
        stamp_ns,
        sensor,
        map_from_robot,
        map_from_odometry,
        lost: tracker.state.n_lost > 0,
        drawn: false,
    }
}
