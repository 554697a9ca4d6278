//! The travel of an explorer: every place where it arrived, as it looked then, whatever the explorer made of it.
//!
//! Which places are the same is left to the tree of maps (HSSH 2004, Fig. 4), to which a travel of
//! gateways in their order says enough: no heading is in it, so that none needs a compass. Ways there
//! and back of rehearsals are travels like any other.

use meetpoint_geometry::{Pose, angle_between, wrap_angle};

use super::arrival::Arrival;
use crate::edge_records::TravelRecord;
use crate::observation::Observation;

/// An arrival at a place.
#[derive(Clone, Debug, PartialEq)]
pub struct Stop {
    /// The gateway by which the place before was left, clockwise from the one where the robot had come
    /// in; 0 of the first.
    pub turn: u8,
    /// What was seen, its star read from where the robot came in.
    pub seen: Observation,
    /// What was measured on the way here.
    pub record: TravelRecord,
}

/// All arrivals so far, in order.
#[derive(Clone, Debug, Default)]
pub struct Itinerary {
    stops: Vec<Stop>,
    /// Directions of the last place, in the robot's frame of headings as it is now.
    directions_rad: Vec<f64>,
    turn: u8,
    /// Where odometry had the robot at the last stop.
    odometry_from_robot: Option<Pose>,
}

impl Itinerary {
    /// The arrivals, in order.
    pub fn stops(&self) -> &[Stop] {
        &self.stops
    }

    pub(crate) fn arrived(&mut self, arrival: &Arrival) {
        let measured = arrival.traversal;
        let record = TravelRecord {
            length_m: measured.map(|traversal| traversal.length_m.max(0.0)),
            turned_rad: measured.map(|traversal| traversal.turned_rad),
            moved: None,
        };
        let turn = std::mem::take(&mut self.turn);
        self.stops.push(Stop { turn, seen: arrival.observation(), record });
        self.directions_rad =
            arrival.directions.iter().map(|direction| direction.heading_rad).collect();
    }

    /// The robot leaves the last place in about this direction.
    pub(crate) fn left(&mut self, heading_rad: f64) {
        let off_rad =
            |index: &u8| angle_between(self.directions_rad[usize::from(*index)], heading_rad).abs();
        // At most 32 directions, as a star has.
        let indices = (0_u8..).take(self.directions_rad.len());
        self.turn = indices.min_by(|a, b| off_rad(a).total_cmp(&off_rad(b))).unwrap_or(0);
    }

    /// Headings are said in a frame from now on that is turned counter-clockwise by so much.
    pub(crate) fn turn_frame(&mut self, by_rad: f64) {
        for heading_rad in &mut self.directions_rad {
            *heading_rad = wrap_angle(*heading_rad - by_rad);
        }
    }

    /// Says where odometry has the robot, who has just taken in a reading: where it stopped, if it did.
    pub(crate) fn stopped_at(&mut self, n_stops_before: usize, odometry_from_robot: Pose) {
        if self.stops.len() <= n_stops_before {
            return;
        }
        let before = self.odometry_from_robot.replace(odometry_from_robot);
        if let (Some(stop), Some(before)) = (self.stops.last_mut(), before) {
            stop.record.moved = Some(before.step_to(odometry_from_robot));
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use super::*;

    fn left_by(itinerary: &mut Itinerary, heading_rad: f64) -> u8 {
        itinerary.left(heading_rad);
        itinerary.turn
    }

    #[test]
    fn turns_are_told_by_the_nearest_direction_in_the_frame_of_now() {
        // Clockwise from behind: south, west, north, east.
        let directions_rad = vec![-FRAC_PI_2, PI, FRAC_PI_2, 0.0];
        let mut itinerary = Itinerary { directions_rad, ..Itinerary::default() };
        assert_eq!(left_by(&mut itinerary, 1.4), 2, "about straight on");
        assert_eq!(left_by(&mut itinerary, -3.0), 1, "to the left, across the cut of angles");
        itinerary.turn_frame(0.5);
        assert_eq!(left_by(&mut itinerary, -0.5), 3, "east is called so now");
        assert_eq!(left_by(&mut itinerary, -0.5 - FRAC_PI_2), 0, "and this is back");
    }
}
