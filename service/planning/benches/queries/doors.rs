//! What closing one arc costs, as a share of making all tables.

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use meetpoint_planning::{ArcCost, Plans, Scratch};

use crate::building::Building;
use crate::pairs::Pairs;
use crate::plan::free_space;

/// Pairs compared with tables made afresh.
const N_PAIRS: usize = 1000;

/// Closes every arc in turn, and prints a line.
pub(crate) fn close_each(path: &Path, radius_m: f64) -> Result<(), Box<dyn Error>> {
    let building = Building::new(free_space(path)?, radius_m)?;
    let Building { plans, space, .. } = &building;
    let mut arcs = building.arcs.clone();
    let mut shares = vec![];
    for arc in 0..arcs.len() {
        arcs[arc] = ArcCost::Closed;
        let start = Instant::now();
        let closed = plans.with_costs(space.clone(), &arcs);
        let share = start.elapsed().as_secs_f64() / building.tabulating.as_secs_f64();
        shares.push(share * 100.0);
        if arc == arcs.len() / 2 {
            check(&building, &closed, &arcs)?;
        }
        arcs[arc] = ArcCost::Open(0);
    }
    shares.sort_by(f64::total_cmp);
    let at = |percent: usize| {
        shares.get(shares.len().saturating_sub(1) * percent / 100).copied().unwrap_or(f64::NAN)
    };
    println!(
        "| {} | {} | {:.0} ms | {:.2} % | {:.2} % | {:.2} % |",
        path.file_stem().unwrap_or_default().to_string_lossy(),
        arcs.len(),
        building.tabulating.as_secs_f64() * 1e3,
        at(50),
        at(90),
        at(100),
    );
    Ok(())
}

/// Whether the answers are those of tables made afresh.
fn check(building: &Building, closed: &Plans, arcs: &[ArcCost]) -> Result<(), Box<dyn Error>> {
    let afresh = building.tables(arcs);
    let mut scratch = Scratch::default();
    for (from, to) in Pairs::new(&building.space).draw(N_PAIRS, |_, _| true) {
        let [a, b] = [closed, &afresh].map(|plans| plans.cost(from, to, &mut scratch));
        if a != b {
            return Err(format!("from {from} to {to}: {a} after the change, {b} afresh").into());
        }
    }
    Ok(())
}
