//! Maps of places that fit what robots told of their travels: read from the journal, computed when
//! they are asked for, kept for the next question.

mod assertion;
mod place_map;
mod travelled;
mod travels;
mod tree;

pub(crate) use assertion::{Assertion, hypothesis_id};
pub(crate) use place_map::{Around, DrawnPlace, drawn_place};
pub(crate) use travelled::{Moment, Travelled, Visit};
pub(crate) use travels::Travels;
pub(crate) use tree::Tree;
