//! Maps that grow as batches arrive: one actor a map, over the journal.

mod actor;
mod actors;
mod checkpoint;
mod decisions;
mod map_state;
mod placements;
mod relaxations;
mod sensing;
mod snapshot;
mod topology;
mod versions;

pub(crate) use actors::{Actors, Replacement};
pub(crate) use decisions::Decisions;
pub(crate) use map_state::MapState;
pub(crate) use placements::Placements;
pub(crate) use sensing::Sensing;
pub(crate) use topology::free_space;
