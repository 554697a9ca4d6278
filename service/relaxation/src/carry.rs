//! Beliefs carried along a motion, forward (TBF98 equation (16)) and backward (17).
//!
//! A heading's layer is made from all layers that lead to it, so headings can be worked on side by
//! side and every cell is written by one only.

use std::num::NonZero;

use crate::belief::Belief;
use crate::kernel::Kernel;
use crate::layer::Layer;
use crate::pose_grid::PoseGrid;
use crate::side_by_side::side_by_side;
use crate::stencil::{Combine, Stencil};
use crate::window::Window;

/// Where a belief leads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Direction {
    /// From before the motion to after it.
    Forward,
    /// From after the motion to before it.
    Backward,
}

/// One motion over one grid.
pub(crate) struct Carry<'a> {
    pub(crate) grid: &'a PoseGrid,
    pub(crate) kernel: &'a Kernel,
    pub(crate) combine: Combine,
    pub(crate) n_threads: NonZero<usize>,
}

impl Carry<'_> {
    /// All that a belief leads to, as far as the grid goes.
    pub(crate) fn all(&self, belief: &Belief, direction: Direction) -> Vec<Layer> {
        self.by_heading(belief, |heading| {
            let parts = self.parts(belief, heading, direction);
            let seen = parts.iter().map(|(stencil, layer)| stencil.window_over(layer.window()));
            let window = seen.fold(Window::EMPTY, Window::union);
            self.drawn(&parts, Layer::zeros(window.intersection(self.grid.window())))
        })
    }

    /// The same backward, where `shapes` has cells only.
    pub(crate) fn backward_within(&self, belief: &Belief, shapes: &Belief) -> Vec<Layer> {
        self.by_heading(shapes, |heading| {
            let shape = shapes.layer(heading);
            if shape.is_empty() {
                return Layer::EMPTY;
            }
            let parts = self.parts(belief, heading, Direction::Backward);
            self.drawn(&parts, shape.same_shape())
        })
    }

    fn by_heading(&self, belief: &Belief, layer: impl Fn(u32) -> Layer + Sync) -> Vec<Layer> {
        let n_units = belief.n_cells() * self.kernel.n_entries();
        side_by_side(self.grid.n_headings(), self.n_threads, n_units, layer)
    }

    /// What a heading's layer is made from.
    fn parts<'b>(
        &self,
        belief: &'b Belief,
        heading: u32,
        direction: Direction,
    ) -> Vec<(Stencil, &'b Layer)> {
        let mut parts = Vec::new();
        if direction == Direction::Backward {
            let (n_quarters, slabs) = self.kernel.slabs(self.grid, heading);
            for slab in slabs {
                let layer = belief.layer(self.grid.turned(heading, slab.turn));
                if !layer.is_empty() {
                    parts.push((Stencil::new(&slab.table, n_quarters, false), layer));
                }
            }
            return parts;
        }
        for (from, layer) in belief.layers() {
            let (n_quarters, slabs) = self.kernel.slabs(self.grid, from);
            for slab in slabs {
                if self.grid.turned(from, slab.turn) == heading {
                    parts.push((Stencil::new(&slab.table, n_quarters, true), layer));
                }
            }
        }
        parts
    }

    fn drawn(&self, parts: &[(Stencil, &Layer)], mut out: Layer) -> Layer {
        let mut scratch = Vec::new();
        for (stencil, layer) in parts {
            stencil.draw(layer, &mut out, self.combine, &mut scratch);
        }
        Layer::new(out.window(), out.into_weights())
    }
}
