//! Data to train the sonar network on: places in a building of which it is known whether they are wall, and
//! what simulated rings hear of them.

mod ground;
mod places;

pub(crate) use ground::Ground;
pub(crate) use places::{Share, declared, places, simulated};
