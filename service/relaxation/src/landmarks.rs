//! Landmarks of a map of probabilities: its peaks, each with the weight around it.
//!
//! The highest node first, with all of its kind's weight within a radius, which is then taken off;
//! and so on, until no place has weight enough left. Time: nodes times landmarks.

use meetpoint_geometry::{Point2, Vector2};
use nalgebra::Matrix2;

use crate::landmark::{Landmark, LandmarkKind};
use crate::landmark_map::LandmarkMap;
use crate::perception::single;

/// Tunables of [`LandmarkMap::landmarks`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PeakParams {
    /// Weight within this distance of a peak belongs to it, in metres.
    pub radius_m: f64,
    /// Peaks with less weight are not told, in (0, 1].
    pub certainty_min: f64,
}

impl PeakParams {
    /// Half of the least distance of two places that a person would mark, and an even chance.
    pub const BUTTON: Self = Self { radius_m: 2.0, certainty_min: 0.5 };
}

/// More landmarks than this are not looked for: maps that no E-step has sharpened have peaks
/// everywhere.
const N_LANDMARKS_MAX: usize = 1_000;

impl LandmarkMap {
    /// Landmarks by kind, the highest peak first.
    pub fn landmarks(&self, params: &PeakParams) -> Vec<Landmark> {
        let kinds = (0..).zip(self.kinds());
        let of_kind = |(kind, _)| self.peaks(kind, params);
        kinds.flat_map(of_kind).take(N_LANDMARKS_MAX).collect()
    }

    fn peaks(&self, kind: usize, params: &PeakParams) -> Vec<Landmark> {
        let window = self.grid().window();
        let mut left: Vec<f32> = self.layer(kind).weights().to_vec();
        let mut landmarks = Vec::new();
        // A peak has at least an even part of its landmark's weight.
        let nodes_m2 = std::f64::consts::PI * params.radius_m.powi(2) / self.grid().node_area_m2();
        let peak_min = single(params.certainty_min / (nodes_m2 + 9.0));
        while landmarks.len() < N_LANDMARKS_MAX {
            let mut highest = (0.0_f32, None);
            for (node, &weight) in window.nodes().zip(&left) {
                if weight > highest.0 {
                    highest = (weight, Some(node));
                }
            }
            let (weight, Some(peak)) = highest else { break };
            if weight < peak_min {
                break;
            }
            let around = self.taken_around(peak, params.radius_m, &mut left);
            let found = landmark(&around, self.grid().node_area_m2(), self.kinds()[kind]);
            landmarks.extend(found.filter(|found| found.certainty >= params.certainty_min));
        }
        landmarks
    }

    /// The weights around a node, which are taken off.
    fn taken_around(
        &self,
        peak: (i32, i32),
        radius_m: f64,
        left: &mut [f32],
    ) -> Vec<(Point2<f64>, f64)> {
        let center = self.grid().point_of(peak.0, peak.1);
        let mut around = Vec::new();
        for ((x, y), left) in self.grid().window().nodes().zip(left) {
            let point = self.grid().point_of(x, y);
            if (point - center).norm() <= radius_m || (x, y) == peak {
                around.push((point, f64::from(std::mem::take(left))));
            }
        }
        around
    }
}

/// Weight, mean and covariance, which is never less than a node's own.
fn landmark(
    around: &[(Point2<f64>, f64)],
    node_area_m2: f64,
    kind: LandmarkKind,
) -> Option<Landmark> {
    let sum: f64 = around.iter().map(|(_, weight)| weight).sum();
    if sum <= 0.0 {
        return None;
    }
    let weighed = around.iter().map(|(point, weight)| point.coords * (weight / sum));
    let position = Point2::from(weighed.fold(Vector2::zeros(), |sum, point| sum + point));
    let mut covariance_m2 = Matrix2::identity() * (node_area_m2 / 12.0);
    for (point, weight) in around {
        let off = point - position;
        covariance_m2 += off * off.transpose() * (weight / sum);
    }
    Some(Landmark { position, covariance_m2, kind, certainty: sum.min(1.0) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::landmark::Kinds;
    use crate::pose_grid::{Area, PoseGrid};

    #[test]
    fn landmarks_come_back() {
        let area = Area { min: Point2::new(-10.0, -10.0), max: Point2::new(20.0, 10.0) };
        let grid = PoseGrid::new(area, 0.5, 72).expect("a grid");
        let landmark = |x, y, certainty, kind| Landmark {
            position: Point2::new(x, y),
            covariance_m2: Matrix2::identity() * 0.25,
            kind,
            certainty,
        };
        let (alike, known) = (LandmarkKind::Type(0), LandmarkKind::Identity(7));
        let given = [
            landmark(-3.2, 4.1, 0.9, alike),
            landmark(7.7, -2.6, 0.8, alike),
            landmark(8.3, -2.1, 0.7, known),
            landmark(0.0, 0.0, 0.3, alike),
        ];
        let kinds = Kinds::from_kinds(vec![alike, known]);
        let map = LandmarkMap::from_landmarks(grid, kinds, &given);
        let found = map.landmarks(&PeakParams::BUTTON);
        assert_eq!(found.len(), 3, "the fourth is too unsure: {found:?}");
        for (found, given) in found.iter().zip(&given) {
            assert_eq!(found.kind, given.kind, "kinds in order");
            assert!((found.position - given.position).norm() < 0.1, "{found:?}");
            assert!((found.certainty - given.certainty).abs() < 0.05, "{found:?}");
            let off = (found.covariance_m2 - given.covariance_m2).norm();
            assert!(off < 0.12, "as wide as it was: {found:?}");
        }
    }
}
