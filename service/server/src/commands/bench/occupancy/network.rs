//! The network that ships, on places of floors that it was not trained on.

use meetpoint_occupancy::{Examination, Network};

use crate::commands::train::{HELD_OUT_SEED, N_HELD_OUT, report};
use crate::training::simulated;

/// Prints two tables.
pub(super) fn print() -> anyhow::Result<()> {
    let places = simulated(N_HELD_OUT, HELD_OUT_SEED + 1)?;
    let examination = Examination::new(&Network::shipped(), &places);
    report(&examination, &[("network that ships", &examination)]);
    Ok(())
}
