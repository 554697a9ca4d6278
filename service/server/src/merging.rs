//! Sessions of unknown start: what is decided about their merges, and when they are looked at again.

mod asking;
mod deciding;

pub(crate) use asking::keep_asking;
pub(crate) use deciding::{Known, accepting, rejecting, undoing};
