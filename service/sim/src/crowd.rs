//! People who walk by: each goes from one free place to another by lot, and on.

use meetpoint_geometry::Point2;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::building::Building;
use crate::person::Person;
use crate::route::route;

/// People keep this off walls, in metres.
const CLEARANCE_M: f64 = 0.3;
/// Speed of people in corridors, in metres a second.
const SPEED_M_PER_S: f64 = 1.2;
/// Places drawn before a person stays where they are until the next time.
const N_TRIES: usize = 50;

/// People on their ways through one building. The same seed and steps give the same bits.
#[derive(Clone, Debug)]
pub struct Crowd {
    walkers: Vec<Walker>,
    rng: ChaCha8Rng,
}

/// A person, and the way ahead: the next point is the last one.
#[derive(Clone, Debug)]
struct Walker {
    position: Point2<f64>,
    ahead: Vec<Point2<f64>>,
}

impl Crowd {
    /// So many people at free places by lot; fewer if the building has hardly any.
    pub fn new(building: &Building, n_people: usize, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let walkers = (0..n_people).filter_map(|_| {
            let position = free_place(building, &mut rng)?;
            Some(Walker { position, ahead: Vec::new() })
        });
        let walkers = walkers.collect();
        Self { walkers, rng }
    }

    /// Everybody walks on for so many seconds. Ways are found by the doors that are open now.
    pub fn walk(&mut self, building: &Building, seconds: f64) {
        for walker in &mut self.walkers {
            if walker.ahead.is_empty() {
                let way = free_place(building, &mut self.rng)
                    .and_then(|goal| route(building, &[walker.position, goal], CLEARANCE_M));
                walker.ahead = way.unwrap_or_default();
                walker.ahead.reverse();
            }
            walker.walk(SPEED_M_PER_S * seconds.max(0.0));
        }
    }

    /// Where they are now, for [`Building::set_people`].
    pub fn people(&self) -> Vec<Person> {
        let person =
            |walker: &Walker| Person { position: walker.position, radius_m: Person::RADIUS_M };
        self.walkers.iter().map(person).collect()
    }
}

impl Walker {
    fn walk(&mut self, mut length_m: f64) {
        while let Some(next) = self.ahead.last() {
            let step = next - self.position;
            if length_m < step.norm() {
                self.position += step * (length_m / step.norm());
                return;
            }
            length_m -= step.norm();
            self.position = *next;
            self.ahead.pop();
        }
    }
}

fn free_place(building: &Building, rng: &mut ChaCha8Rng) -> Option<Point2<f64>> {
    let info = building.info();
    let edge_m = info.frame.resolution_m();
    let (width_m, height_m) = (edge_m * f64::from(info.width), edge_m * f64::from(info.height));
    let mut places = (0..N_TRIES)
        .map(|_| Point2::new(rng.random::<f64>() * width_m, rng.random::<f64>() * height_m));
    places.find(|&place| building.is_free(place, CLEARANCE_M))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::hall;

    #[test]
    fn people_walk_through_free_space_only() {
        let building = hall().building;
        let mut crowd = Crowd::new(&building, 4, 7);
        assert_eq!(crowd.people().len(), 4, "the hall has room for four");
        let mut walked_m = 0.0;
        for _ in 0..400 {
            let before = crowd.people();
            crowd.walk(&building, 0.1);
            for (person, before) in crowd.people().iter().zip(before) {
                let step_m = (person.position - before.position).norm();
                assert!(step_m <= 0.12 + 1e-9, "{step_m} m in a tenth of a second");
                assert!(building.is_free(person.position, 0.0), "in a wall");
                walked_m += step_m;
            }
        }
        assert!(100.0 < walked_m, "four people walk {walked_m} m in 40 s");
    }
}
