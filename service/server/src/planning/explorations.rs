//! Explorations that go on: their values are kept, so that the next question costs what changed.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use meetpoint_occupancy::Grid;
use meetpoint_planning::{Exploration, ExplorationParams};
use meetpoint_storage::{MapId, SessionId};

/// Explorations that are kept: frames times radii of robots.
const N_KEPT: usize = 4;
/// Larger ones are not kept, in cells: some 40 bytes each, so 160 MB.
const N_CELLS_KEPT: usize = 4 << 20;

/// An exploration that questions share, one after the other.
pub(super) type KeptExploration = Arc<tokio::sync::Mutex<Exploration>>;

/// A map, the session in whose frame it is or none for the map's, the bits of a radius, and whether it was heard only.
type Key = (MapId, Option<SessionId>, u64, bool);

/// The explorations asked for lately, newest last.
#[derive(Default)]
pub(crate) struct Explorations(Mutex<VecDeque<(Key, KeptExploration)>>);

impl Explorations {
    /// The exploration of a map, or of the frame of a session of it, as its grid is now, by robots of a radius, in metres.
    pub(crate) fn of(
        &self,
        map: &MapId,
        frame: Option<SessionId>,
        (grid, radius_m): (&Grid, f64),
    ) -> KeptExploration {
        let is_heard = is_heard(grid);
        let key = (map.clone(), frame, radius_m.to_bits(), is_heard);
        let mut kept = self.kept();
        let place = kept.iter().position(|(other, _)| *other == key);
        let found = place.and_then(|place| kept.remove(place)).unwrap_or_else(|| {
            let costs = if is_heard { ExplorationParams::HEARD } else { ExplorationParams::INDOOR };
            let params = ExplorationParams { radius_m, ..costs };
            (key, Arc::new(tokio::sync::Mutex::new(Exploration::new(params))))
        });
        let exploration = found.1.clone();
        kept.push_back(found);
        while N_KEPT < kept.len() {
            kept.pop_front();
        }
        exploration
    }

    /// Forgets an exploration if it is too large to be kept.
    pub(crate) fn forget_large(&self, exploration: &KeptExploration, n_cells: usize) {
        if N_CELLS_KEPT < n_cells {
            self.kept().retain(|(_, other)| !Arc::ptr_eq(other, exploration));
        }
    }

    /// A panic while the lock was held cannot leave the table half changed.
    fn kept(&self) -> MutexGuard<'_, VecDeque<(Key, KeptExploration)>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// True if no laser ever looked at any cell, so that walls waver.
fn is_heard(grid: &Grid) -> bool {
    let mut tiles = grid.tiles();
    tiles.all(|(_, tile)| {
        let mut cells = tile.log_odds().iter().enumerate();
        cells.all(|(index, log_odds)| log_odds.is_nan() || tile.is_heard(index))
    })
}
