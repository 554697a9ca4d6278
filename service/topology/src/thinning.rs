//! Homotopic thinning in the order of clearance, and what of it must be done again.
//!
//! Cells are peeled off from the walls inwards, a cell only if the topology stays the same: C.
//! Pudney, "Distance-ordered homotopic thinning", Computer Vision and Image Understanding 72
//! (1998). Each cell has one turn, in the order of
//!
//! ```text
//! key(c) = (squared clearance of c, index of c)
//! ```
//!
//! and a cell that was refused is asked again, in the same turn, when a neighbour has gone. So every
//! cell that goes is removed in the turn of some cell, and this is recorded: at the turn of `k`, the
//! cells are on that were never removed, or in a later turn. Where the order or the space changed,
//! only turns are repeated that saw something else than they did before; each tells by its outcome
//! which later turns did, too (U. Acar, G. Blelloch and R. Harper, "Adaptive functional
//! programming", ACM Transactions on Programming Languages and Systems 28 (2006)). The record is then
//! that of thinning afresh, bit for bit. Time O(cells log cells); for a change O(turns that it
//! reaches · log of those).

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::lattice::Lattice;

/// Removed in no turn.
pub(crate) const NEVER: u32 = u32::MAX;

/// A thinning under way. Equal inputs have equal records, however they were come to.
pub(crate) struct Thinning<'a, Kept: Fn(usize, usize) -> bool> {
    pub(crate) lattice: Lattice,
    /// Cells that are there at the beginning.
    pub(crate) is_open: &'a [bool],
    /// Clearance of every cell, in cells squared.
    pub(crate) squared: &'a [u32],
    /// In whose turn every cell is removed, [`NEVER`] if it stays.
    pub(crate) removed_by: &'a mut [u32],
    /// Whether a cell must stay, given also how many neighbours are left.
    pub(crate) is_kept: Kept,
}

/// Turns to be repeated.
struct Agenda {
    /// By key, with the cells that were removed in each before.
    turns: BinaryHeap<Reverse<(u64, Vec<usize>)>>,
    /// Whether a cell's turn is among them.
    has: Vec<bool>,
}

impl<Kept: Fn(usize, usize) -> bool> Thinning<'_, Kept> {
    /// Gives every cell of `cells` its turn; none has been removed yet.
    pub(crate) fn peel(&mut self, cells: impl Iterator<Item = usize>) {
        let mut order: Vec<u64> = cells.map(|index| self.key(index)).collect();
        order.sort_unstable();
        let mut removed = vec![];
        for key in order {
            removed.clear();
            self.turn(key, |_, index| removed.push(index));
        }
    }

    /// Brings the record of a thinning to what it is now, given all cells that came, went, have
    /// another clearance or must stay for other reasons than before; returns the cells whose turn to
    /// go may be another, or none, some more than once.
    pub(crate) fn repeat(&mut self, changed: &[usize]) -> Vec<usize> {
        let has = vec![false; self.removed_by.len()];
        let mut agenda = Agenda { turns: BinaryHeap::new(), has };
        let mut touched = changed.to_vec();
        for &index in changed {
            // A turn at another time is another turn.
            touched.extend(self.forget(index));
        }
        for &index in changed {
            let by = self.removed_by[index];
            if by != NEVER {
                self.put(by as usize, &mut agenda);
            }
        }
        let around = |&index: &usize| self.lattice.around(index).into_iter().chain([index]);
        let mut asked: Vec<usize> = touched.iter().flat_map(around).collect();
        asked.sort_unstable();
        asked.dedup();
        for index in asked {
            self.put_all_that_asked(index, 0, &mut agenda);
        }
        while let Some(Reverse((key, before))) = agenda.turns.pop() {
            agenda.has[owner(key)] = false;
            let mut now = vec![];
            self.turn(key, |thinning, index| {
                let by = thinning.removed_by[index];
                if by != NEVER {
                    thinning.put(by as usize, &mut agenda);
                }
                now.push(index);
            });
            now.sort_unstable();
            let only = |cells: &[usize], others: &[usize]| {
                let differs = |index: &&usize| others.binary_search(index).is_err();
                cells.iter().filter(differs).copied().collect::<Vec<_>>()
            };
            for index in only(&now, &before).into_iter().chain(only(&before, &now)) {
                touched.push(index);
                for asked in self.lattice.around(index).into_iter().chain([index]) {
                    self.put_all_that_asked(asked, key, &mut agenda);
                }
            }
        }
        touched
    }

    fn key(&self, index: usize) -> u64 {
        u64::from(self.squared[index]) << 32 | index as u64
    }

    /// Whether a cell is on in the turn of `key`.
    fn is_on(&self, index: usize, key: u64) -> bool {
        let by = self.removed_by[index];
        self.is_open[index] && (by == NEVER || key < self.key(by as usize))
    }

    /// The turn of one cell; `removing` is told of cells before they go.
    fn turn(&mut self, key: u64, mut removing: impl FnMut(&mut Self, usize)) {
        let owner = owner(key);
        let mut asked = vec![owner];
        while let Some(index) = asked.pop() {
            if !self.is_on(index, key) || !self.is_simple(index, key) {
                continue;
            }
            removing(self, index);
            self.removed_by[index] = u32::try_from(owner).unwrap_or(NEVER);
            let passed = |&neighbor: &usize| self.is_on(neighbor, key) && self.key(neighbor) < key;
            asked.extend(self.lattice.around(index).into_iter().filter(passed));
        }
    }

    /// Whether the cell can go without tearing, joining or emptying anything: its neighbours on
    /// the diagram hang together (8-connected), and so do those off it (4-connected).
    fn is_simple(&self, index: usize, key: u64) -> bool {
        let on = self.lattice.around(index).map(|neighbor| self.is_on(neighbor, key));
        let n_neighbors = on.iter().filter(|&&is_on| is_on).count();
        // Yokoi's connectivity number.
        let crossings =
            [0, 2, 4, 6].iter().filter(|&&at| !on[at] && (on[at + 1] || on[(at + 2) % 8])).count();
        crossings == 1 && !(self.is_kept)(index, n_neighbors)
    }

    /// Puts all turns on the agenda after that of `key` which asked the cell, and so saw its
    /// neighbours: its own, and those in which neighbours went.
    fn put_all_that_asked(&mut self, index: usize, key: u64, agenda: &mut Agenda) {
        if !self.lattice.is_inside(index) {
            return;
        }
        if key < self.key(index) && self.is_open[index] {
            self.put(index, agenda);
        }
        for gone in self.lattice.around(index) {
            let by = self.removed_by[gone];
            if by != NEVER && key < self.key(by as usize) {
                self.put(by as usize, agenda);
            }
        }
    }

    /// Puts the turn of `owner` on the agenda, as if it had not been.
    fn put(&mut self, owner: usize, agenda: &mut Agenda) {
        if !agenda.has[owner] {
            agenda.has[owner] = true;
            agenda.turns.push(Reverse((self.key(owner), self.forget(owner))));
        }
    }

    /// Puts the cells back that were removed in the turn of `owner`: those that hang together with
    /// it. Returns them, ascending.
    fn forget(&mut self, owner: usize) -> Vec<usize> {
        let by = u32::try_from(owner).unwrap_or(NEVER);
        let mut cells = vec![];
        if self.removed_by[owner] == by {
            self.removed_by[owner] = NEVER;
            cells.push(owner);
        }
        let mut next = 0;
        while let Some(&cell) = cells.get(next) {
            next += 1;
            for neighbor in self.lattice.around(cell) {
                if self.removed_by[neighbor] == by {
                    self.removed_by[neighbor] = NEVER;
                    cells.push(neighbor);
                }
            }
        }
        cells.sort_unstable();
        cells
    }
}

/// Whose turn it is.
fn owner(key: u64) -> usize {
    usize::try_from(key & u64::from(u32::MAX)).unwrap_or(usize::MAX)
}
