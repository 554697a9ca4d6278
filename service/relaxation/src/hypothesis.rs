//! One way to tell which landmark was seen when.

use meetpoint_geometry::{Point2, Pose};

use crate::calibration::Calibration;
use crate::em_state::InvalidState;

/// One way to tell which landmark was seen when, with what follows from it.
#[derive(Clone, Debug, PartialEq)]
pub struct Hypothesis {
    /// By sighting, in the order of the travel: index of the landmark, in the order in which they
    /// are first seen; `None` for false ones.
    pub association: Vec<Option<u32>>,
    /// Logarithm of its probability, up to a constant that all hypotheses share.
    pub log_evidence: f64,
    /// At the steps with sightings.
    pub poses: Vec<Pose>,
    /// By index.
    pub landmarks: Vec<Point2<f64>>,
    /// What undoes the odometry's steady errors.
    pub calibration: Calibration,
}

/// A false sighting, in bytes.
const NONE: u32 = u32::MAX;

impl Hypothesis {
    /// Little-endian: counts of sightings, poses and landmarks, then their numbers.
    pub(crate) fn write(&self, bytes: &mut Vec<u8>) {
        for n in [self.association.len(), self.poses.len(), self.landmarks.len()] {
            bytes.extend((n as u64).to_le_bytes());
        }
        for landmark in &self.association {
            bytes.extend(landmark.unwrap_or(NONE).to_le_bytes());
        }
        let Calibration { scale, turn_per_m, turn_per_rad } = self.calibration;
        let mut numbers = vec![self.log_evidence, scale, turn_per_m, turn_per_rad];
        numbers.extend(self.poses.iter().flat_map(|pose| [pose.x_m, pose.y_m, pose.theta_rad]));
        numbers.extend(self.landmarks.iter().flat_map(|point| [point.x, point.y]));
        bytes.extend(numbers.into_iter().flat_map(f64::to_le_bytes));
    }

    /// What [`Self::write`] wrote of a travel with so many sightings and steps with them.
    pub(crate) fn read(
        bytes: &mut &[u8],
        (n_sightings, n_poses): (usize, usize),
    ) -> Result<Self, InvalidState> {
        let n = [read_u64(bytes)?, read_u64(bytes)?, read_u64(bytes)?];
        let n_landmarks = usize::try_from(n[2]).map_err(|_| InvalidState)?;
        if n[..2] != [n_sightings as u64, n_poses as u64] || n_sightings < n_landmarks {
            return Err(InvalidState);
        }
        let mut association = Vec::with_capacity(n_sightings);
        for _ in 0..n_sightings {
            let landmark = u32::from_le_bytes(taken(bytes)?);
            if landmark != NONE && n_landmarks <= landmark as usize {
                return Err(InvalidState);
            }
            association.push((landmark != NONE).then_some(landmark));
        }
        let log_evidence = read_f64(bytes)?;
        let calibration = Calibration {
            scale: read_f64(bytes)?,
            turn_per_m: read_f64(bytes)?,
            turn_per_rad: read_f64(bytes)?,
        };
        let mut poses = Vec::with_capacity(n_poses);
        for _ in 0..n_poses {
            let (x_m, y_m, theta_rad) = (read_f64(bytes)?, read_f64(bytes)?, read_f64(bytes)?);
            poses.push(Pose { x_m, y_m, theta_rad });
        }
        let mut landmarks = Vec::with_capacity(n_landmarks);
        for _ in 0..n_landmarks {
            landmarks.push(Point2::new(read_f64(bytes)?, read_f64(bytes)?));
        }
        Ok(Self { association, log_evidence, poses, landmarks, calibration })
    }
}

/// The next bytes, taken off.
pub(crate) fn taken<const N: usize>(bytes: &mut &[u8]) -> Result<[u8; N], InvalidState> {
    let (first, rest) = bytes.split_first_chunk().ok_or(InvalidState)?;
    *bytes = rest;
    Ok(*first)
}

pub(crate) fn read_u64(bytes: &mut &[u8]) -> Result<u64, InvalidState> {
    Ok(u64::from_le_bytes(taken(bytes)?))
}

pub(crate) fn read_f64(bytes: &mut &[u8]) -> Result<f64, InvalidState> {
    let number = f64::from_le_bytes(taken(bytes)?);
    if number.is_finite() { Ok(number) } else { Err(InvalidState) }
}
