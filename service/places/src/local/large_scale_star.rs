//! The large-scale star: distinctive states and directed paths of a place, and turns.
//!
//! HSSH 2004, section III-C and Fig. 3 (f): each directed fragment of the small-scale star becomes a
//! distinctive state on a directed path, in the same order. "Right" and "left" follow from the
//! order, without any angle: to the right lie the states from one's own on to that which faces the
//! other way on the same path.

use std::fmt;

use crate::local::small_scale_star::{SmallScaleStar, TravelLaw};

/// A distinctive state: at a place, facing along a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct DState {
    /// Which path of the place, counted from 1.
    pub path: u8,
    /// Which direction of it: downstream (+) or upstream.
    pub is_plus: bool,
    /// Whether the path ends at the place in this direction.
    pub ends: bool,
}

/// The distinctive states of a place, clockwise.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct LargeScaleStar {
    small: SmallScaleStar,
    states: Vec<DState>,
}

impl LargeScaleStar {
    /// The states, clockwise.
    pub fn states(&self) -> &[DState] {
        &self.states
    }

    /// States that a right turn from the state at `from` may lead to, as one meets them.
    pub fn turns_right(&self, from: usize) -> Vec<usize> {
        self.small.right_of(from)
    }

    /// States that a left turn from the state at `from` may lead to, as one meets them.
    pub fn turns_left(&self, from: usize) -> Vec<usize> {
        self.small.left_of(from)
    }

    /// The state that faces the other way on the same path.
    ///
    /// # Panics
    /// If `from` is not below the number of states.
    pub fn turned_around(&self, from: usize) -> usize {
        let DState { path, .. } = self.states[from];
        let is_other = |&at: &usize| at != from && self.states[at].path == path;
        (0..self.states.len()).find(is_other).unwrap_or(from)
    }
}

impl From<SmallScaleStar> for LargeScaleStar {
    fn from(small: SmallScaleStar) -> Self {
        let states = small.fragments().iter().map(|tuple| DState {
            path: tuple.fragment,
            is_plus: tuple.is_plus,
            ends: !matches!(tuple.law, TravelLaw::By(_)),
        });
        Self { states: states.collect(), small }
    }
}

/// As in Fig. 3 (f) of the paper, paths that end in parentheses: `(ds3, (Pa3+))`.
impl fmt::Display for LargeScaleStar {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (at, &DState { path, is_plus, ends }) in self.states.iter().enumerate() {
            let before = if at == 0 { "" } else { "\n" };
            let sign = if is_plus { '+' } else { '-' };
            let path = format!("Pa{path}{sign}");
            let path = if ends { format!("({path})") } else { path };
            write!(f, "{before}(ds{}, {path})", at + 1)?;
        }
        Ok(())
    }
}
