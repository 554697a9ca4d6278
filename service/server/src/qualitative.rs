//! Robots that explore as they are told, step by step: read from the journal, computed when they are asked
//! for, kept for the next question.

mod decision;
mod explored;
mod eye;

pub(crate) use decision::{Begun, Decided, Decision};
pub(crate) use explored::Explored;
