//! The state of a live map as bytes: little-endian, exact bits, no padding.

use std::sync::Arc;

use meetpoint_geometry::Pose;
use meetpoint_occupancy::{LaserGeometry, SonarRing};

use crate::live::observation::{Sensor, SensorKind, SessionConfig, SessionKey};
use crate::live::odometry::{Odometry, Velocity};
use crate::live::tracker::{TrackState, Tracker};
use crate::position::wall_orientation::WallOrientation;

/// Bytes that are no state of a live map.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum InvalidState {
    /// The cells' edge is no length.
    #[error("a resolution of {0} m is not a positive length")]
    Resolution(f64),
    /// The first byte names no known format.
    #[error("state format {0} is not known")]
    Format(u8),
    /// The bytes end too early.
    #[error("the state ends after {0} bytes, in the middle of something")]
    Short(usize),
    /// There are more bytes than the state needs.
    #[error("{0} bytes follow the state's end")]
    Surplus(usize),
    /// A tag names no known variant.
    #[error("tag {0} is not known")]
    Tag(u8),
}

/// Writes a state.
pub(crate) struct StateWriter {
    bytes: Vec<u8>,
}

impl StateWriter {
    pub(crate) fn new(format: u8) -> Self {
        Self { bytes: vec![format] }
    }

    pub(crate) fn into_bytes(self) -> Vec<u8> {
        self.bytes
    }

    fn write_u8(&mut self, number: u8) {
        self.bytes.push(number);
    }

    fn write_u32(&mut self, number: u32) {
        self.bytes.extend_from_slice(&number.to_le_bytes());
    }

    pub(crate) fn write_u64(&mut self, number: u64) {
        self.bytes.extend_from_slice(&number.to_le_bytes());
    }

    fn write_i64(&mut self, number: i64) {
        self.bytes.extend_from_slice(&number.to_le_bytes());
    }

    fn write_f64(&mut self, number: f64) {
        self.bytes.extend_from_slice(&number.to_le_bytes());
    }

    fn write_pose(&mut self, pose: Pose) {
        self.write_f64(pose.x_m);
        self.write_f64(pose.y_m);
        self.write_f64(pose.theta_rad);
    }

    fn write_option<T>(&mut self, option: Option<T>, write: impl FnOnce(&mut Self, T)) {
        self.write_u8(u8::from(option.is_some()));
        if let Some(value) = option {
            write(self, value);
        }
    }

    pub(crate) fn write_session(&mut self, key: SessionKey, tracker: &Tracker) {
        let Tracker { config, odometry, state } = tracker;
        self.bytes.extend_from_slice(&key.0.to_le_bytes());
        self.write_config(config);
        self.write_odometry(odometry);
        self.write_track(state);
    }

    fn write_config(&mut self, config: &SessionConfig) {
        let SessionConfig { map_from_start, sensors } = config;
        self.write_pose(*map_from_start);
        self.write_u64(sensors.len() as u64);
        for Sensor { robot_from_sensor, kind } in sensors {
            self.write_pose(*robot_from_sensor);
            match kind {
                SensorKind::Laser(geometry) => {
                    self.write_u8(0);
                    self.write_laser(geometry);
                }
                SensorKind::SonarRing(ring) => {
                    self.write_u8(1);
                    self.write_sonar_ring(ring);
                }
                SensorKind::LandmarkDetector => self.write_u8(2),
            }
        }
    }

    fn write_laser(&mut self, geometry: &LaserGeometry) {
        let &LaserGeometry {
            angle_min_rad,
            angle_increment_rad,
            n_beams,
            range_min_m,
            range_max_m,
        } = geometry;
        self.write_f64(angle_min_rad);
        self.write_f64(angle_increment_rad);
        self.write_u32(n_beams);
        self.write_f64(range_min_m);
        self.write_f64(range_max_m);
    }

    fn write_sonar_ring(&mut self, ring: &SonarRing) {
        let SonarRing { robot_from_transducer, cone_rad, range_min_m, range_max_m } = ring;
        self.write_u64(robot_from_transducer.len() as u64);
        for pose in robot_from_transducer {
            self.write_pose(*pose);
        }
        self.write_f64(*cone_rad);
        self.write_f64(*range_min_m);
        self.write_f64(*range_max_m);
    }

    fn write_odometry(&mut self, odometry: &Odometry) {
        let Odometry { recent, velocity } = odometry;
        self.write_u64(recent.len() as u64);
        for (stamp_ns, pose) in recent {
            self.write_i64(*stamp_ns);
            self.write_pose(*pose);
        }
        self.write_option(*velocity, |writer, velocity| {
            writer.write_f64(velocity.forward_m_per_s);
            writer.write_f64(velocity.left_m_per_s);
            writer.write_f64(velocity.turn_rad_per_s);
        });
    }

    fn write_track(&mut self, state: &TrackState) {
        let &TrackState {
            map_from_robot,
            odometry_from_robot,
            stamp_ns,
            last_step,
            drawn_at,
            heard_at,
            usual,
            agreement,
            n_lost,
            adrift,
            walls,
        } = state;
        self.write_pose(map_from_robot);
        self.write_option(odometry_from_robot, Self::write_pose);
        self.write_option(stamp_ns, Self::write_i64);
        self.write_option(last_step, |writer, (step, seconds)| {
            writer.write_pose(step);
            writer.write_f64(seconds);
        });
        self.write_option(drawn_at, Self::write_pose);
        self.write_option(heard_at, Self::write_pose);
        self.write_option(usual, Self::write_f64);
        self.write_f64(agreement);
        self.write_u32(n_lost);
        self.write_u8(u8::from(adrift));
        self.write_walls(walls);
    }

    fn write_walls(&mut self, walls: WallOrientation) {
        let WallOrientation { heading_rad2, n_walls, sum: [x, y], resultant } = walls;
        for part in [heading_rad2, n_walls, x, y, resultant] {
            self.write_f64(part);
        }
    }
}

/// Reads what [`StateWriter`] wrote.
pub(crate) struct StateReader<'a> {
    all: &'a [u8],
    rest: &'a [u8],
}

impl<'a> StateReader<'a> {
    pub(crate) fn new(format: u8, bytes: &'a [u8]) -> Result<Self, InvalidState> {
        let (&found, rest) = bytes.split_first().ok_or(InvalidState::Short(0))?;
        if found == format {
            Ok(Self { all: bytes, rest })
        } else {
            Err(InvalidState::Format(found))
        }
    }

    pub(crate) fn finish(self) -> Result<(), InvalidState> {
        if self.rest.is_empty() { Ok(()) } else { Err(InvalidState::Surplus(self.rest.len())) }
    }

    fn read<const N: usize>(&mut self) -> Result<[u8; N], InvalidState> {
        let (read, rest) =
            self.rest.split_first_chunk().ok_or(InvalidState::Short(self.all.len()))?;
        self.rest = rest;
        Ok(*read)
    }

    fn read_u8(&mut self) -> Result<u8, InvalidState> {
        let [byte] = self.read()?;
        Ok(byte)
    }

    fn read_bool(&mut self) -> Result<bool, InvalidState> {
        match self.read_u8()? {
            0 => Ok(false),
            1 => Ok(true),
            tag => Err(InvalidState::Tag(tag)),
        }
    }

    fn read_u32(&mut self) -> Result<u32, InvalidState> {
        Ok(u32::from_le_bytes(self.read()?))
    }

    pub(crate) fn read_u64(&mut self) -> Result<u64, InvalidState> {
        Ok(u64::from_le_bytes(self.read()?))
    }

    fn read_i64(&mut self) -> Result<i64, InvalidState> {
        Ok(i64::from_le_bytes(self.read()?))
    }

    fn read_f64(&mut self) -> Result<f64, InvalidState> {
        Ok(f64::from_le_bytes(self.read()?))
    }

    fn read_pose(&mut self) -> Result<Pose, InvalidState> {
        Ok(Pose { x_m: self.read_f64()?, y_m: self.read_f64()?, theta_rad: self.read_f64()? })
    }

    fn read_option<T>(
        &mut self,
        read: impl FnOnce(&mut Self) -> Result<T, InvalidState>,
    ) -> Result<Option<T>, InvalidState> {
        if self.read_bool()? { read(self).map(Some) } else { Ok(None) }
    }

    /// As many as the number that stands here.
    fn read_many<T>(
        &mut self,
        mut read: impl FnMut(&mut Self) -> Result<T, InvalidState>,
    ) -> Result<Vec<T>, InvalidState> {
        let n = self.read_u64()?;
        (0..n).map(|_| read(self)).collect()
    }

    pub(crate) fn read_session(&mut self) -> Result<(SessionKey, Tracker), InvalidState> {
        let key = SessionKey(u128::from_le_bytes(self.read()?));
        let map_from_start = self.read_pose()?;
        let sensors = self.read_many(Self::read_sensor)?;
        let odometry = self.read_odometry()?;
        let state = self.read_track()?;
        Ok((key, Tracker { config: SessionConfig { map_from_start, sensors }, odometry, state }))
    }

    fn read_sensor(&mut self) -> Result<Sensor, InvalidState> {
        let robot_from_sensor = self.read_pose()?;
        let kind = match self.read_u8()? {
            0 => SensorKind::Laser(self.read_laser()?),
            1 => SensorKind::SonarRing(Arc::new(self.read_sonar_ring()?)),
            2 => SensorKind::LandmarkDetector,
            tag => return Err(InvalidState::Tag(tag)),
        };
        Ok(Sensor { robot_from_sensor, kind })
    }

    fn read_laser(&mut self) -> Result<LaserGeometry, InvalidState> {
        Ok(LaserGeometry {
            angle_min_rad: self.read_f64()?,
            angle_increment_rad: self.read_f64()?,
            n_beams: self.read_u32()?,
            range_min_m: self.read_f64()?,
            range_max_m: self.read_f64()?,
        })
    }

    fn read_sonar_ring(&mut self) -> Result<SonarRing, InvalidState> {
        Ok(SonarRing {
            robot_from_transducer: self.read_many(Self::read_pose)?,
            cone_rad: self.read_f64()?,
            range_min_m: self.read_f64()?,
            range_max_m: self.read_f64()?,
        })
    }

    fn read_odometry(&mut self) -> Result<Odometry, InvalidState> {
        let recent = self.read_many(|reader| Ok((reader.read_i64()?, reader.read_pose()?)))?;
        let velocity = self.read_option(|reader| {
            Ok(Velocity {
                forward_m_per_s: reader.read_f64()?,
                left_m_per_s: reader.read_f64()?,
                turn_rad_per_s: reader.read_f64()?,
            })
        })?;
        Ok(Odometry { recent, velocity })
    }

    fn read_walls(&mut self) -> Result<WallOrientation, InvalidState> {
        Ok(WallOrientation {
            heading_rad2: self.read_f64()?,
            n_walls: self.read_f64()?,
            sum: [self.read_f64()?, self.read_f64()?],
            resultant: self.read_f64()?,
        })
    }

    fn read_track(&mut self) -> Result<TrackState, InvalidState> {
        Ok(TrackState {
            map_from_robot: self.read_pose()?,
            odometry_from_robot: self.read_option(Self::read_pose)?,
            stamp_ns: self.read_option(Self::read_i64)?,
            last_step: self.read_option(|reader| Ok((reader.read_pose()?, reader.read_f64()?)))?,
            drawn_at: self.read_option(Self::read_pose)?,
            heard_at: self.read_option(Self::read_pose)?,
            usual: self.read_option(Self::read_f64)?,
            agreement: self.read_f64()?,
            n_lost: self.read_u32()?,
            adrift: self.read_bool()?,
            walls: self.read_walls()?,
        })
    }
}
