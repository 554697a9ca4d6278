//! How tables grow with the map: a plan laid side by side.

use std::error::Error;
use std::path::Path;

use meetpoint_geometry::GridInfo;
use meetpoint_planning::Scratch;
use meetpoint_topology::FreeSpace;

use crate::building::Building;
use crate::pairs::Pairs;
use crate::plan::free_space;
use crate::sample::Sample;

/// Free cells up to which the map grows.
const N_CELLS_MAX: usize = 10_000_000;
/// Steps of growth: the side doubles.
const SIDES: [u32; 5] = [1, 2, 3, 4, 8];
/// Queries timed at every size.
const N_PAIRS: usize = 5000;
/// Cells of a row or column that the plans are joined by, at the middle of their sides.
const DOOR_CELLS: u32 = 20;

/// Prints a line for every size.
pub(crate) fn grow(path: &Path, radius_m: f64) -> Result<(), Box<dyn Error>> {
    let plan = free_space(path)?;
    println!(
        "| cells | gates | nodes | regions found | tables | a cell | bytes a cell | mean | p99 |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for side in SIDES {
        let n_free = plan.is_free().iter().filter(|&&is_free| is_free).count();
        if N_CELLS_MAX < n_free * (side * side) as usize {
            break;
        }
        let building = Building::new(tiled(&plan, side), radius_m)?;
        let size = building.plans.size();
        let mut scratch = Scratch::default();
        let region = |cell: usize| building.plans.partition().region_at(cell);
        let pairs =
            Pairs::new(&building.space).draw(N_PAIRS, |from, to| region(from) != region(to));
        let sample = Sample::of(&pairs, |from, to| building.plans.cost(from, to, &mut scratch));
        println!(
            "| {} | {} | {} | {:.2} s | {:.2} s | {:.2} us | {:.0} | {:.2} us | {:.2} us |",
            size.n_cells,
            size.n_gates,
            size.n_nodes,
            building.segmenting.as_secs_f64(),
            building.tabulating.as_secs_f64(),
            building.tabulating.as_secs_f64() * 1e6 / size.n_cells.max(1) as f64,
            building.bytes_a_cell(),
            sample.mean_us(),
            sample.percentile_us(99),
        );
    }
    Ok(())
}

/// `side` by `side` copies of a plan, joined by corridors cut through everything from the middle of
/// a plan to the middle of the next.
fn tiled(plan: &FreeSpace, side: u32) -> FreeSpace {
    let info = plan.info();
    let (width, height) = (info.width, info.height);
    let mut is_free = vec![false; (width * side * height * side) as usize];
    for y in 0..height * side {
        for x in 0..width * side {
            let from = (y % height * width + x % width) as usize;
            let is_corridor = 1 < side
                && ((y % height).abs_diff(height / 2) < DOOR_CELLS / 2
                    || (x % width).abs_diff(width / 2) < DOOR_CELLS / 2);
            is_free[(y * width * side + x) as usize] = plan.is_free()[from] || is_corridor;
        }
    }
    FreeSpace::from_cells(GridInfo { width: width * side, height: height * side, ..info }, &is_free)
}
