//! A map as it grows: one grid, and the sessions that draw it.

use std::collections::BTreeMap;
use std::sync::Arc;

use meetpoint_geometry::{GridFrame, InvalidResolution, Pose};
use meetpoint_occupancy::{Grid, LaserGeometry, ScanMarks, Tile, TileIndex};

use crate::field::Field;
use crate::matcher::Chart;
use crate::observation::{
    Estimate, Observation, ObservationKind, SensorKind, SessionConfig, SessionKey,
};
use crate::odometry::Velocity;
use crate::params::MappingParams;
use crate::points::scan_points;
use crate::state::{InvalidState, StateReader, StateWriter};
use crate::tracker::Tracker;

/// First byte of a stored state: the format that follows.
const FORMAT: u8 = 1;

/// A growing map and the sessions on it.
///
/// The same calls in the same order give the same bits, also if the map was stored and restored in
/// between.
#[derive(Debug)]
pub struct LiveMap {
    params: MappingParams,
    grid: Grid,
    /// Invariant: the field of `grid`.
    field: Field,
    sessions: BTreeMap<SessionKey, Tracker>,
    n_drawn: u64,
    marks: ScanMarks,
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
        Self { params, grid, field, sessions: BTreeMap::new(), n_drawn: 0, marks }
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
                None
            }
            &ObservationKind::OdometryVelocity {
                forward_m_per_s,
                left_m_per_s,
                turn_rad_per_s,
            } => {
                let velocity = Velocity { forward_m_per_s, left_m_per_s, turn_rad_per_s };
                tracker.odometry.add_velocity(stamp_ns, velocity);
                None
            }
            ObservationKind::LaserScan { sensor, ranges_m } => {
                let declared = tracker.config.sensors.get(*sensor)?;
                let SensorKind::Laser(geometry) = declared.kind else { return None };
                let robot_from_sensor = declared.robot_from_sensor;
                self.apply_scan(key, stamp_ns, *sensor, (robot_from_sensor, geometry), ranges_m)
            }
            ObservationKind::SonarScan { sensor }
            | ObservationKind::LandmarkSighting { sensor } => {
                Some(estimate_by_odometry(tracker, stamp_ns, Some(*sensor)))
            }
            ObservationKind::Mark => Some(estimate_by_odometry(tracker, stamp_ns, None)),
        }
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
        if tracked.draw {
            let map_from_sensor = tracked.map_from_robot * robot_from_sensor;
            let model = &self.params.beam_model;
            self.grid.insert_scan(map_from_sensor, &geometry, ranges_m, model, &mut self.marks);
            self.field.update(&self.grid, self.marks.changed());
            self.n_drawn += 1;
        }
        let mut estimate = estimate_by_odometry(tracker, stamp_ns, Some(sensor));
        estimate.drawn = tracked.draw;
        Some(estimate)
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
