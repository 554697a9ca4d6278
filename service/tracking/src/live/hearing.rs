//! A firing of sonars on a live map: where the robot is by it, and what is drawn.

use meetpoint_geometry::Pose;
use meetpoint_occupancy::Interpretation;

use crate::live::live_map::LiveMap;
use crate::live::observation::{SensorKind, SessionKey};
use crate::position::heard_wall::heard_walls;
use crate::position::sonar_position::sonar_position;

/// Where a firing is thought to have been heard.
#[derive(Clone, Copy, Debug)]
pub(super) enum Heard {
    /// Known from elsewhere.
    AtKnown(Pose),
    /// By odometry, or by what a laser made of it.
    AtPredicted(Pose),
}

impl LiveMap {
    /// Draws a firing of sonars, if the robot moved since the last; whether it did. A robot without a laser is
    /// put where odometry, map and walls have it, and drawn from there. What is no ring of that session is not
    /// drawn.
    pub(super) fn hear(
        &mut self,
        key: SessionKey,
        place: Heard,
        (sensor, ranges_m): (usize, &[f32]),
    ) -> bool {
        let Self { params, grid, networks, .. } = self;
        let Some(tracker) = self.sessions.get_mut(&key) else { return false };
        let ring = tracker.config.sensors.get(sensor).map(|declared| declared.kind.clone());
        let Some(SensorKind::SonarRing(ring)) = ring else { return false };
        let (Heard::AtKnown(predicted) | Heard::AtPredicted(predicted)) = place;
        let of_walls = &params.position.walls;
        let heard_at = tracker.state.heard_at;
        let has_moved = tracker.hears(predicted, &params.sonar);
        if !has_moved && !tracker.state.walls.is_beginning(of_walls) {
            return false;
        }
        let walls_rad = heard_walls(&ring, ranges_m, of_walls);
        for wall_rad in &walls_rad {
            tracker.state.walls.note(predicted.theta_rad + wall_rad, of_walls);
        }
        if !has_moved {
            return false;
        }
        let step = heard_at.map_or(Pose::IDENTITY, |before| before.step_to(predicted));
        tracker.state.walls.drive(step, of_walls);
        let scan = ring.scan(ranges_m);
        let followed = Interpretation::new(&scan, &networks.following, &params.sonar.following);
        let map_from_robot = match place {
            Heard::AtPredicted(predicted) if tracker.is_reckoned() => {
                let direction_rad = tracker.state.walls.known_rad(of_walls);
                let walls_rad: Vec<f64> = direction_rad.map_or_else(Vec::new, |direction_rad| {
                    walls_rad.iter().map(|wall_rad| wall_rad - direction_rad).collect()
                });
                let pose =
                    sonar_position(predicted, grid, (&followed, &walls_rad), &params.position);
                tracker.correct(pose);
                pose
            }
            Heard::AtPredicted(pose) | Heard::AtKnown(pose) => pose,
        };
        grid.insert_followed(map_from_robot, &followed, &params.beam_model);
        let drawn = Interpretation::new(&scan, &networks.drawing, &params.sonar.model);
        grid.insert_sonar(map_from_robot, &drawn, &params.beam_model);
        self.n_drawn += 1;
        true
    }
}
