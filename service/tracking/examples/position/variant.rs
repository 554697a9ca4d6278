//! A travel mapped with some sources of information.

use std::error::Error;
use std::sync::Arc;

use meetpoint_geometry::{InvalidResolution, Pose};
use meetpoint_occupancy::{SonarRing, png};
use meetpoint_sim::{ChaCha8Rng, Laser, SonarRing as Sonars};
use meetpoint_tracking::{
    LiveMap, MappingParams, Observation, ObservationKind, PositionParams, Sensor, SensorKind,
    SessionConfig, SessionKey,
};
use rand::SeedableRng;

use super::travel::Travel;

const ROBOT: SessionKey = SessionKey(1);
/// Sonars fire every so many ticks, a laser scans so often: five times a second.
const N_TICKS_PER_FIRING: usize = 4;
/// Edge of a cell of a map drawn from sonar, and from a laser, in metres.
const RESOLUTION_M: [f64; 2] = [0.1, 0.05];

/// What a pose is made from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Variant {
    All,
    NoOdometry,
    NoCorrelation,
    NoWalls,
    Laser,
}

/// How it went.
pub(crate) struct Found {
    pub(crate) final_error_m: f64,
    pub(crate) mean_error_m: f64,
    pub(crate) picture: Vec<u8>,
}

impl Variant {
    pub(crate) const ALL: [Self; 5] =
        [Self::All, Self::NoOdometry, Self::NoCorrelation, Self::NoWalls, Self::Laser];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::All => "sonar",
            Self::NoOdometry => "without odometry",
            Self::NoCorrelation => "without correlation",
            Self::NoWalls => "without walls",
            Self::Laser => "laser",
        }
    }

    fn params(self) -> MappingParams {
        let mut params = MappingParams::INDOOR;
        let position: &mut PositionParams = &mut params.position;
        match self {
            Self::All | Self::Laser => {}
            Self::NoOdometry => {
                (position.odometry_gain_per_m2, position.odometry_gain_per_rad2) = (0.0, 0.0);
            }
            Self::NoCorrelation => position.correlation_gain = 0.0,
            Self::NoWalls => position.wall_gain = 0.0,
        }
        params
    }

    pub(crate) fn run(self, travel: &Travel) -> Result<Found, Box<dyn Error>> {
        let is_laser = self == Self::Laser;
        let resolution_m = RESOLUTION_M[usize::from(is_laser)];
        let mut map = LiveMap::new(self.params(), resolution_m)
            .map_err(|InvalidResolution(edge_m)| format!("cells of {edge_m} m"))?;
        let sensor = if is_laser { laser() } else { ring() };
        let config = SessionConfig { map_from_start: Pose::IDENTITY, sensors: vec![sensor] };
        map.open_session(ROBOT, config);
        let mut rng = ChaCha8Rng::seed_from_u64(2000 + travel.seed);
        let (mut final_error_m, mut sum_m, mut n) = (0.0, 0.0, 0_u32);
        for (index, moment) in travel.moments.iter().enumerate() {
            let stamp_ns = moment.stamp_ns;
            let kind = ObservationKind::OdometryPose(moment.odometry);
            map.apply(ROBOT, &Observation { stamp_ns, kind });
            let is_last = index + 1 == travel.moments.len();
            if !index.is_multiple_of(N_TICKS_PER_FIRING) && !is_last {
                continue;
            }
            let kind = if is_laser {
                let ranges_m = Laser::INDOOR.scan(&travel.building, moment.truth, &mut rng);
                ObservationKind::LaserScan { sensor: 0, ranges_m }
            } else {
                let ranges_m = Sonars::RING_24.scan(&travel.building, moment.truth, &mut rng);
                ObservationKind::SonarScan { sensor: 0, ranges_m }
            };
            if let Some(estimate) = map.apply(ROBOT, &Observation { stamp_ns, kind }) {
                final_error_m = travel.error_m(moment, estimate.map_from_robot);
                sum_m += final_error_m;
                n += 1;
            }
        }
        let mean_error_m = sum_m / f64::from(n.max(1));
        Ok(Found { final_error_m, mean_error_m, picture: png(&map.grid().raster(None)) })
    }
}

fn ring() -> Sensor {
    let sonars = Sonars::RING_24;
    let ring = SonarRing {
        robot_from_transducer: (0..sonars.n_sonars).map(|at| sonars.robot_from_sonar(at)).collect(),
        cone_rad: sonars.cone_rad,
        range_min_m: sonars.range_min_m,
        range_max_m: sonars.range_max_m,
    };
    Sensor { robot_from_sensor: Pose::IDENTITY, kind: SensorKind::SonarRing(Arc::new(ring)) }
}

fn laser() -> Sensor {
    let geometry = Laser::INDOOR.geometry();
    Sensor { robot_from_sensor: Laser::INDOOR.robot_from_laser, kind: SensorKind::Laser(geometry) }
}
