//! A building as a network of corridors: places, and straight corridors that join them.

use meetpoint_geometry::{Point2, angle_between};

use crate::landmark_drive::Waypoint;
use crate::landmark_travel::Landmark;

/// Where two corridors meet and no other, a bend less than this is no landmark, in radians: nobody
/// takes it for a corner.
const BEND_MIN_RAD: f64 = 0.5;

/// Places and the corridors between them.
#[derive(Clone, Debug, PartialEq)]
pub struct Corridors {
    places: Vec<Point2<f64>>,
    /// Invariant: both ends are places, and not the same.
    corridors: Vec<[usize; 2]>,
}

/// A corridor that does not join two places.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InvalidCorridor {
    /// Its ends.
    pub ends: [usize; 2],
    /// Places there are.
    pub n_places: usize,
}

impl std::fmt::Display for InvalidCorridor {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { ends: [a, b], n_places } = self;
        write!(f, "a corridor from place {a} to place {b} does not join two of {n_places} places")
    }
}

impl std::error::Error for InvalidCorridor {}

impl Corridors {
    /// A network of places in the building's frame, in metres, and corridors between two of them.
    ///
    /// # Errors
    /// If a corridor has an end that is no place, or both ends at one.
    pub fn new(
        places: Vec<Point2<f64>>,
        corridors: Vec<[usize; 2]>,
    ) -> Result<Self, InvalidCorridor> {
        let n_places = places.len();
        let is_invalid = |&&[a, b]: &&[usize; 2]| a == b || n_places <= a.max(b);
        match corridors.iter().find(is_invalid) {
            Some(&ends) => Err(InvalidCorridor { ends, n_places }),
            None => Ok(Self { places, corridors }),
        }
    }

    /// Places in the building's frame, in metres.
    pub fn places(&self) -> &[Point2<f64>] {
        &self.places
    }

    /// Corridors by their two ends, as indices of places.
    pub fn corridors(&self) -> &[[usize; 2]] {
        &self.corridors
    }

    /// Places at the other ends of the corridors of `place`, in the order of the corridors.
    pub fn neighbours(&self, place: usize) -> impl Iterator<Item = usize> {
        self.corridors.iter().filter_map(move |&[a, b]| {
            if a == place {
                Some(b)
            } else if b == place {
                Some(a)
            } else {
                None
            }
        })
    }

    /// Length of the straight way between two places, in metres.
    pub fn distance_m(&self, a: usize, b: usize) -> f64 {
        (self.places[b] - self.places[a]).norm()
    }

    /// True if every place can be reached from every other.
    pub fn is_connected(&self) -> bool {
        self.distances_m(0, None).iter().all(|distance_m| distance_m.is_finite())
    }

    /// For every corridor, the length of the shortest loop that it is part of, in metres; `+inf` if
    /// it is part of none.
    pub fn loop_lengths_m(&self) -> Vec<f64> {
        let round_m =
            |&[a, b]: &[usize; 2]| self.distance_m(a, b) + self.distances_m(a, Some([a, b]))[b];
        self.corridors.iter().map(round_m).collect()
    }

    /// Shortest ways from `start` to all places without the corridor `left_out`, in metres; `+inf`
    /// where there is none. Relaxed until nothing changes: buildings are small.
    fn distances_m(&self, start: usize, left_out: Option<[usize; 2]>) -> Vec<f64> {
        let mut distances_m = vec![f64::INFINITY; self.places.len()];
        if let Some(distance_m) = distances_m.get_mut(start) {
            *distance_m = 0.0;
        }
        let open = || self.corridors.iter().filter(|&&corridor| Some(corridor) != left_out);
        let mut has_changed = true;
        while has_changed {
            has_changed = false;
            for (a, b) in open().flat_map(|&[a, b]| [(a, b), (b, a)]) {
                let distance_m = distances_m[a] + self.distance_m(a, b);
                if distance_m < distances_m[b] {
                    distances_m[b] = distance_m;
                    has_changed = true;
                }
            }
        }
        distances_m
    }

    /// True where a person would press the button: at junctions, corners and dead ends, but not
    /// where one corridor goes on almost straight.
    pub fn is_landmark(&self, place: usize) -> bool {
        let neighbours: Vec<usize> = self.neighbours(place).collect();
        let &[a, b] = neighbours.as_slice() else { return !neighbours.is_empty() };
        BEND_MIN_RAD <= angle_between(self.heading_rad(a, place), self.heading_rad(place, b)).abs()
    }

    fn heading_rad(&self, from: usize, to: usize) -> f64 {
        let way = self.places[to] - self.places[from];
        way.y.atan2(way.x)
    }

    /// The index among landmarks of every place that is one.
    fn landmark_indices(&self) -> Vec<Option<usize>> {
        let mut n_landmarks = 0;
        let index = |place| {
            self.is_landmark(place).then(|| {
                n_landmarks += 1;
                n_landmarks - 1
            })
        };
        (0..self.places.len()).map(index).collect()
    }

    /// Landmarks in the order of their places, all of type 0.
    pub fn landmarks(&self) -> Vec<Landmark> {
        let landmark = |place| Landmark { position: self.places[place], landmark_type: 0 };
        (0..self.places.len()).filter(|&place| self.is_landmark(place)).map(landmark).collect()
    }

    /// A walk from place to place as waypoints, with the landmarks of [`Self::landmarks`].
    ///
    /// # Panics
    /// If the walk names a place that is not there.
    pub fn waypoints(&self, walk: &[usize]) -> Vec<Waypoint> {
        let landmarks = self.landmark_indices();
        let waypoint = |&place: &usize| Waypoint {
            position: self.places[place],
            landmark: landmarks[place],
            floor_rad_per_m: 0.0,
        };
        walk.iter().map(waypoint).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square of 10 m with a dead end of 5 m at its first corner and a place in the middle of its
    /// last side.
    fn square() -> Corridors {
        let points = [(0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0), (0.0, 5.0), (-5.0, 0.0)];
        let places = points.iter().map(|&(x, y)| Point2::new(x, y)).collect();
        Corridors::new(places, vec![[0, 1], [1, 2], [2, 3], [3, 4], [4, 0], [0, 5]])
            .expect("all places are there")
    }

    #[test]
    fn landmarks_are_junctions_corners_and_dead_ends() {
        let is_landmark: Vec<bool> = (0..6).map(|place| square().is_landmark(place)).collect();
        assert_eq!(is_landmark, [true, true, true, true, false, true], "4 goes straight on");
        let seen: Vec<_> = square().waypoints(&[4, 5]).iter().map(|w| w.landmark).collect();
        assert_eq!(seen, [None, Some(4)], "indices count landmarks, not places");
        assert_eq!(square().landmarks().len(), 5, "as many as places that are landmarks");
    }

    #[test]
    fn loops_are_as_long_as_they_are() {
        let lengths_m = square().loop_lengths_m();
        assert_eq!(lengths_m, [40.0, 40.0, 40.0, 40.0, 40.0, f64::INFINITY], "and a dead end");
        assert!(square().is_connected(), "all in one piece");
        let places = square().places().to_vec();
        let apart = Corridors::new(places, vec![[0, 1], [2, 3]]).expect("all places are there");
        assert!(!apart.is_connected(), "two pieces");
    }

    #[test]
    fn corridors_join_two_places() {
        let places = vec![Point2::origin(); 2];
        for ends in [[0, 2], [1, 1]] {
            let error = Corridors::new(places.clone(), vec![ends]);
            assert_eq!(error, Err(InvalidCorridor { ends, n_places: 2 }), "{ends:?}");
        }
    }
}
