//! Random pairs of cells, the same in every run.

use meetpoint_planning::{Components, Space, components};

/// Cells that can be entered, and a sequence of numbers.
pub(crate) struct Pairs {
    cells: Vec<usize>,
    components: Components,
    state: u64,
}

impl Pairs {
    pub(crate) fn new(space: &Space) -> Self {
        let cells = (0..space.info().n_cells()).filter(|&cell| space.is_enterable(cell));
        Self { cells: cells.collect(), components: components(space), state: 1 }
    }

    /// So many pairs with a way between the two, and `is_wanted`; fewer if a thousand times as
    /// many draws do not give them.
    pub(crate) fn draw(
        &mut self,
        n: usize,
        is_wanted: impl Fn(usize, usize) -> bool,
    ) -> Vec<(usize, usize)> {
        let mut pairs = Vec::with_capacity(n);
        for _ in 0..1000 * n {
            if pairs.len() == n || self.cells.is_empty() {
                break;
            }
            let (from, to) = (self.cell(), self.cell());
            if self.components.are_joined(from, to) && is_wanted(from, to) {
                pairs.push((from, to));
            }
        }
        pairs
    }

    fn cell(&mut self) -> usize {
        // D. E. Knuth's MMIX constants; the high bits are the random ones.
        self.state = self
            .state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        let high = usize::try_from(self.state >> 33).unwrap_or(0);
        self.cells[high % self.cells.len()]
    }
}
