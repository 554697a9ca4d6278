//! Data to train the sonar network on: places in a building of which it is known whether they are wall, and
//! what simulated rings hear of them.

mod ground;
mod places;
mod tour;
mod ways;

pub(crate) use ground::Ground;
pub(crate) use places::{Share, declared, places, simulated};
pub(crate) use tour::tour;
pub(crate) use ways::{firings, heard_places, simulated_ways};
