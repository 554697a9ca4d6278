//! The network that ships, on places of floors that it was not trained on.

use meetpoint_occupancy::{Examination, Network, SonarModel};

use crate::commands::train::{HELD_OUT_SEED, N_HELD_OUT, N_WAYS_HELD_OUT, report, report_ways};
use crate::training::{simulated, simulated_ways};

/// Prints three tables.
pub(super) fn print() -> anyhow::Result<()> {
    let places = simulated(N_HELD_OUT, HELD_OUT_SEED + 1)?;
    let examination = Examination::new(&Network::shipped(), &places);
    report(&examination, &[("network that ships", &examination)]);
    let ways = simulated_ways(N_WAYS_HELD_OUT, HELD_OUT_SEED + 1)?;
    let (shipped, by_ways) = (Network::shipped(), Network::by_ways());
    let networks = [
        ("network that ships", &shipped, SonarModel::INDOOR),
        ("network trained on ways", &by_ways, SonarModel::BY_WAYS),
    ];
    report_ways(&ways, &networks);
    Ok(())
}
