//! Causal travel: what a robot did and saw, and nothing of where that was.

use std::fmt;
use std::str::FromStr;

use crate::observation::{Observation, View};
use crate::star::InvalidStar;

/// A turn, a travel, and what the robot saw at its end: the schema "state, action, state" of the
/// Spatial Semantic Hierarchy (HSSH 2004, section II), with places for states.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Step {
    /// The gateway through which the robot left, counted clockwise from the one where it had
    /// come in: 0 is back. At the first place, from the one its star was read from.
    pub turn: u8,
    /// What it saw where it arrived.
    pub seen: Observation,
}

/// The travel of a robot, from place to place.
///
/// Written as what was seen first, then as a turn and what was seen at each step:
/// `ab 1:aba 2:abab@hall`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Travel {
    /// The first place, its star read from any gateway.
    pub first: Observation,
    /// All that followed.
    pub steps: Vec<Step>,
}

/// What is wrong with a written travel.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InvalidTravel {
    /// Nothing is written.
    #[error("a travel begins with the star of a place")]
    Empty,
    /// A step is not a turn and a star.
    #[error("`{0}` is not a turn and a star, such as 1:aba")]
    Step(String),
    /// A star is none.
    #[error("`{0}`: {1}")]
    Star(String, InvalidStar),
    /// A turn to a gateway that the place before does not have.
    #[error("step {step} leaves by gateway {turn} of {n_gateways}")]
    Turn {
        /// Which step, the first being 1.
        step: usize,
        /// The gateway it names.
        turn: u8,
        /// Gateways of the place where it begins.
        n_gateways: u8,
    },
}

impl Travel {
    /// What was seen at visit `visit`, the first being 0.
    pub fn seen(&self, visit: usize) -> Option<&Observation> {
        match visit.checked_sub(1) {
            None => Some(&self.first),
            Some(step) => self.steps.get(step).map(|step| &step.seen),
        }
    }

    /// The turns, in order.
    pub fn turns(&self) -> impl Iterator<Item = u8> {
        self.steps.iter().map(|step| step.turn)
    }
}

fn observation(text: &str) -> Result<Observation, InvalidTravel> {
    let (star, view) = text.split_once('@').map_or((text, None), |(star, view)| (star, Some(view)));
    let star = star.parse().map_err(|error| InvalidTravel::Star(text.to_owned(), error))?;
    let view = view.map(|name| View {
        name: name.trim_end_matches('!').to_owned(),
        is_unique: name.ends_with('!'),
    });
    Ok(Observation { star, view })
}

fn step(text: &str) -> Result<Step, InvalidTravel> {
    let not_a_step = || InvalidTravel::Step(text.to_owned());
    let (turn, seen) = text.split_once(':').ok_or_else(not_a_step)?;
    Ok(Step { turn: turn.parse().map_err(|_| not_a_step())?, seen: observation(seen)? })
}

impl FromStr for Travel {
    type Err = InvalidTravel;

    fn from_str(text: &str) -> Result<Self, InvalidTravel> {
        let mut words = text.split_whitespace();
        let first = observation(words.next().ok_or(InvalidTravel::Empty)?)?;
        let steps = words.map(step).collect::<Result<Vec<_>, _>>()?;
        let mut n_gateways = first.star.n_gateways();
        for (index, step) in steps.iter().enumerate() {
            if n_gateways <= step.turn {
                return Err(InvalidTravel::Turn { step: index + 1, turn: step.turn, n_gateways });
            }
            n_gateways = step.seen.star.n_gateways();
        }
        Ok(Self { first, steps })
    }
}

impl fmt::Display for Travel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.first)?;
        for Step { turn, seen } in &self.steps {
            write!(f, " {turn}:{seen}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_travel_is_read_as_it_is_written() {
        let text = "ab 1:aba> 2:abab@hall 0:a@home!";
        let travel: Travel = text.parse().expect("a travel");
        assert_eq!(travel.to_string(), text, "there and back");
        assert_eq!(travel.seen(3).map(|seen| seen.star.n_gateways()), Some(1), "the last");
        assert_eq!(travel.seen(4), None, "nothing after it");
    }

    #[test]
    fn nonsense_is_refused() {
        let error = |text: &str| text.parse::<Travel>().expect_err("nonsense").to_string();
        assert_eq!(error(" "), "a travel begins with the star of a place");
        assert_eq!(error("ab ab"), "`ab` is not a turn and a star, such as 1:aba");
        assert_eq!(error("ab 2:ab"), "step 1 leaves by gateway 2 of 2");
        assert_eq!(error("aaa"), "`aaa`: path fragment `a` has more than two gateways");
    }
}
