//! A whole environment, of which everything is known: what a robot would see in it.

use crate::drawing::{Drawn, InvalidDrawing, read};
use crate::observation::Observation;
use crate::place_map::{Gateway, PlaceId, PlaceMap};
use crate::star::{ControlLaw, Opening, Star};
use crate::travel::{Step, Travel};

/// A whole environment with names for its places.
///
/// Gateways are numbered clockwise from the uppermost of the drawing. A path passes a place
/// straight on, and ends where there is no way straight on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct World {
    names: Vec<char>,
    map: PlaceMap,
}

/// What is wrong with a route.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InvalidRoute {
    /// No place is called that, or the route is empty.
    #[error("no place `{0}`")]
    NoSuchPlace(String),
    /// Not exactly one way leads there directly.
    #[error("{n_ways} ways from `{from}` to `{to}`, where a route needs one")]
    Ways {
        /// A place of the route.
        from: char,
        /// The next one.
        to: char,
        /// How many ways there are between them.
        n_ways: usize,
    },
}

impl World {
    /// The world of a drawing: letters and digits are places, `-` and `|` ways, `+` bends,
    /// `#` bridges.
    ///
    /// # Errors
    /// [`InvalidDrawing`] with the place in the drawing.
    pub fn from_drawing(drawing: &str) -> Result<Self, InvalidDrawing> {
        let drawn = read(drawing)?;
        let mut map = PlaceMap::default();
        for place in &drawn {
            map.add_place(&Observation::from(star(place)));
        }
        for (id, place) in (0..).map(PlaceId).zip(&drawn) {
            for (side, way) in place.ways.iter().enumerate() {
                let Some((to, arrival_side)) = *way else { continue };
                let here = Gateway { place: id, index: index(place, side) };
                let there = map.places().nth(to).map_or(id, |(id, _)| id);
                let there = Gateway { place: there, index: index(&drawn[to], arrival_side) };
                // Each way is drawn once and found from both of its ends.
                if here < there {
                    map.link(here, there);
                }
            }
        }
        Ok(Self { names: drawn.iter().map(|place| place.name).collect(), map })
    }

    /// All places and ways.
    pub fn map(&self) -> &PlaceMap {
        &self.map
    }

    /// The name of a place.
    pub fn name(&self, id: PlaceId) -> Option<char> {
        self.names.get(id.0 as usize).copied()
    }

    /// The place of that name.
    pub fn place_named(&self, name: char) -> Option<PlaceId> {
        (0..).map(PlaceId).zip(&self.names).find(|&(_, &known)| known == name).map(|(id, _)| id)
    }

    /// Gateway 0 of the first place of a route, and the turns of one who travels from place to
    /// place as their names are written one after the other: `ABCA`.
    ///
    /// # Errors
    /// [`InvalidRoute`] if there is no such place, or not exactly one way to the next.
    pub fn turns(&self, route: &str) -> Result<(Gateway, Vec<u8>), InvalidRoute> {
        let no_such_place = |name: &str| InvalidRoute::NoSuchPlace(name.to_owned());
        let named = |name: char| {
            let place = self.place_named(name).ok_or_else(|| no_such_place(&name.to_string()))?;
            Ok((name, place))
        };
        let places = route.chars().map(named).collect::<Result<Vec<_>, _>>()?;
        let &(_, place) = places.first().ok_or_else(|| no_such_place(""))?;
        let from = Gateway { place, index: 0 };
        let (mut at, mut turns) = (from, Vec::with_capacity(places.len()));
        for pair in places.windows(2) {
            let ((from, here), (to, there)) = (pair[0], pair[1]);
            let n_gateways = self.map.place(here).map_or(0, |place| place.star.n_gateways());
            let leads_there = |&turn: &u8| {
                let arrival = self.map.leads_to(self.map.turned(at, turn));
                arrival.is_some_and(|arrival| arrival.place == there)
            };
            let ways: Vec<u8> = (0..n_gateways).filter(leads_there).collect();
            let [turn] = ways[..] else {
                return Err(InvalidRoute::Ways { from, to, n_ways: ways.len() });
            };
            turns.push(turn);
            at = self.map.leads_to(self.map.turned(at, turn)).unwrap_or(at);
        }
        Ok((from, turns))
    }

    /// What a robot does and sees that stands at `from` and makes these turns.
    pub fn travel(&self, from: Gateway, turns: &[u8]) -> Travel {
        let mut travel = Travel { first: self.map.observation(from), steps: Vec::new() };
        let mut at = from;
        for &turn in turns {
            // Every gateway of a world leads somewhere.
            at = self.map.leads_to(self.map.turned(at, turn)).unwrap_or(at);
            travel.steps.push(Step { turn, seen: self.map.observation(at) });
        }
        travel
    }

    /// What a robot does and sees that travels along a route as [`World::turns`] reads it.
    ///
    /// # Errors
    /// As [`World::turns`].
    pub fn travel_along(&self, route: &str) -> Result<Travel, InvalidRoute> {
        let (from, turns) = self.turns(route)?;
        Ok(self.travel(from, &turns))
    }
}

/// Which gateway of a drawn place is on that side.
fn index(place: &Drawn, side: usize) -> u8 {
    (0..4u8).zip(&place.ways[..side]).filter(|(_, way)| way.is_some()).map(|_| 1).sum()
}

/// The star of a drawn place, from above and clockwise.
///
/// # Panics
/// Never: a drawn place has one to four ways, and those that lie opposite are one path both ways.
fn star(place: &Drawn) -> Star {
    let opening = |side: usize| {
        let (here, opposite) = (index(place, side), (side + 2) % 4);
        let n_gateways = index(place, 4);
        let onward = (index(place, opposite) + n_gateways - here) % n_gateways;
        let continues_after = if place.ways[opposite].is_some() { onward } else { 0 };
        Opening { continues_after, control_law: ControlLaw::Midline }
    };
    let sides = (0..4).filter(|&side| place.ways[side].is_some());
    Star::new(sides.map(opening).collect()).expect("one to four gateways, opposite ones agree")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drawing_is_travelled() {
        let world = World::from_drawing(
            "
            A---B---+
            |   |   |
            |   C---D
            +-------+",
        );
        assert_eq!(
            world,
            Err(InvalidDrawing::Lost { place: 'A', row: 5, column: 21 }),
            "D has no way downward"
        );
        let world = World::from_drawing(
            "
            A---B---+
            |   |   |
            +---C---D",
        )
        .expect("a drawing");
        let travel = world.travel_along("ABCDBA").expect("a route");
        assert_eq!(travel.to_string(), "ab 0:aab 2:abb 1:ab 1:aba 2:ab", "as seen on arrival");
        let n_paths = world.map().n_paths();
        assert_eq!(n_paths, 3, "ABD with its bend, ACD with its bend, and BC between them");
    }

    #[test]
    fn errors_name_the_place() {
        let error = |text: &str| World::from_drawing(text).expect_err("nonsense").to_string();
        assert_eq!(error(""), "a drawing without places");
        assert_eq!(error("A-A"), "two places are called `A`");
        assert_eq!(error("A B"), "no way leads from place `A`");
        assert_eq!(error("A--"), "the way from place `A` is lost in row 1, column 4");
        let world = World::from_drawing("A-B").expect("a drawing");
        let error = |route: &str| world.travel_along(route).expect_err("nonsense").to_string();
        assert_eq!(error("AC"), "no place `C`");
        assert_eq!(error("AA"), "0 ways from `A` to `A`, where a route needs one");
    }
}
