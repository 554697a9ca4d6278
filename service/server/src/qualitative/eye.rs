//! The sensor by which a robot explores: one that looks all around.

use meetpoint_geometry::Pose;
use meetpoint_places::qualitative::Cones;
use meetpoint_storage::SessionId;
use meetpoint_tracking::SensorKind;

use crate::convert::sensor::DeclaredSensor;
use crate::error::Error;

/// A sensor, and how its readings make a ring.
#[derive(Clone, Debug)]
pub(crate) struct Eye {
    sensor: String,
    cones: Cones,
    range_min_m: f64,
    range_max_m: f64,
}

impl Eye {
    /// The sensor of that name; of no name, the first ring of sonars that looks all around, or else the first
    /// laser that does.
    ///
    /// # Errors
    /// [`Error::NoSuchSensor`], [`Error::NotAllAround`].
    pub(crate) fn of(
        session: SessionId,
        sensors: &[DeclaredSensor],
        name: &str,
    ) -> Result<Self, Error> {
        if !name.is_empty() && !sensors.iter().any(|declared| declared.id == name) {
            return Err(Error::NoSuchSensor(name.to_owned()));
        }
        let is_ring =
            |declared: &&DeclaredSensor| matches!(declared.sensor.kind, SensorKind::SonarRing(_));
        let rings = sensors.iter().filter(is_ring);
        let others = sensors.iter().filter(|declared| !is_ring(declared));
        let meant = rings.chain(others).filter(|of| name.is_empty() || of.id == name);
        let mut eyes = meant.filter_map(Self::of_sensor);
        eyes.next().ok_or_else(|| Error::NotAllAround(session.0.to_string()))
    }

    fn of_sensor(declared: &DeclaredSensor) -> Option<Self> {
        let beams: Vec<Pose> = match &declared.sensor.kind {
            SensorKind::SonarRing(ring) => ring.robot_from_transducer.clone(),
            SensorKind::Laser(laser) => {
                let robot_from_laser = declared.sensor.robot_from_sensor;
                let angle_rad =
                    |beam: u32| laser.angle_min_rad + laser.angle_increment_rad * f64::from(beam);
                let beam = |beam| robot_from_laser * Pose::new(0.0, 0.0, angle_rad(beam));
                (0..laser.n_beams).map(beam).collect()
            }
            SensorKind::LandmarkDetector => return None,
        };
        Some(Self {
            sensor: declared.id.clone(),
            cones: Cones::new(&beams)?,
            range_min_m: declared.range_min_m,
            range_max_m: declared.range_max_m,
        })
    }

    /// Its name.
    pub(crate) fn sensor(&self) -> &str {
        &self.sensor
    }

    /// Whether readings are folded.
    pub(crate) fn is_folded(&self) -> bool {
        !self.cones.is_one_to_one()
    }

    /// The ring that readings make, in metres.
    pub(crate) fn ring(&self, ranges_m: &[f32]) -> Vec<f64> {
        self.cones.ring(ranges_m, self.range_min_m, self.range_max_m)
    }
}
