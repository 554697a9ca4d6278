//! What was found, as tables of Markdown.

use std::fmt::Write as _;

use crate::comparison::{Comparison, GraphKind, MODES};
use crate::map::Map;

/// Maps by name, the graph as it is and pruned.
type Found = [(String, [Comparison; 2])];

fn kind(comparison: &Comparison) -> &'static str {
    match comparison.kind {
        GraphKind::Regular => "regular",
        GraphKind::Pruned => "pruned",
    }
}

/// Graphs, and the work of planning in them.
pub(crate) fn of_graphs(found: &Found) -> String {
    let mut table = String::from(
        "| map | graph | cells | regions | cycles | triplets | mean path, cells | regions \
         | backups, grid | topological | factor | paper, bytes a cell | triplet | exact |\n\
         |---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for (name, comparison) in rows(found) {
        let bytes = comparison.n_bytes.map(|n| n as f64 / comparison.n_cells as f64);
        let _ = writeln!(
            table,
            "| {name} | {} | {} | {} | {} | {} | {:.1} | {:.2} | {:.2e} | {:.0} | {:.2e} \
             | {:.1} | {:.1} | {:.1} |",
            kind(comparison),
            comparison.n_cells,
            comparison.n_regions,
            comparison.n_cycles,
            comparison.n_triplets,
            comparison.mean_path_cells,
            comparison.mean_plan_regions,
            comparison.grid_backups,
            comparison.topological_backups,
            comparison.grid_backups / comparison.topological_backups,
            bytes[0],
            bytes[1],
            bytes[2],
        );
    }
    table
}

/// Losses against shortest paths of the grid.
pub(crate) fn of_losses(found: &Found) -> String {
    let mut table = String::from(
        "| map | graph | mode | pairs | mean shortest path, m | followed, m | loss, topological \
         | triplet | total | largest, m | loss-free |\n|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for (name, comparison) in rows(found) {
        for (mode, tally) in MODES.iter().zip(&comparison.tallies) {
            let sums = &tally.all;
            let cell_m = comparison.resolution_m;
            let loss = sums.topological_loss + sums.triplet_loss;
            let _ = writeln!(
                table,
                "| {name} | {} | {mode} | {} | {:.2} | {:.2} | {:.3} % | {:.3} % | {:.3} % \
                 | {:.2} | {:.1} % |",
                kind(comparison),
                sums.n_pairs,
                sums.mean_cells() * cell_m,
                sums.mean_cells() * cell_m * (1.0 + loss / sums.optimum),
                sums.percent(sums.topological_loss),
                sums.percent(sums.triplet_loss),
                sums.percent(loss),
                sums.worst * cell_m,
                100.0 * sums.n_loss_free as f64 / sums.n_pairs as f64,
            );
        }
    }
    table
}

fn rows(found: &Found) -> impl Iterator<Item = (&str, &Comparison)> {
    found.iter().flat_map(|(name, both)| both.iter().map(move |one| (name.as_str(), one)))
}

/// Loss against path length, as figures 18 to 20.
pub(crate) fn of_lengths(map: &Map, comparisons: &[Comparison]) -> String {
    let mut table = format!(
        "| {}, shortest path, m | pairs | graph | paper, topological | triplet | total \
         | mode triplet, total |\n|---|---|---|---|---|---|---|\n",
        map.name
    );
    for comparison in comparisons {
        let [paper, triplet, _] = &comparison.tallies;
        let width_m = paper.bin_cells * map.resolution_m;
        for (at, (bin, better)) in paper.bins.iter().zip(&triplet.bins).enumerate() {
            if bin.n_pairs == 0 {
                continue;
            }
            let _ = writeln!(
                table,
                "| {:.0} to {:.0} | {} | {} | {:.3} % | {:.3} % | {:.3} % | {:.3} % |",
                at as f64 * width_m,
                (at + 1) as f64 * width_m,
                bin.n_pairs,
                kind(comparison),
                bin.percent(bin.topological_loss),
                bin.percent(bin.triplet_loss),
                bin.percent(bin.topological_loss + bin.triplet_loss),
                better.percent(better.topological_loss + better.triplet_loss),
            );
        }
    }
    table
}
