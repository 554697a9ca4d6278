//! Probabilities of poses, kept only where they matter (TBF98 section 5, "selective computation"
//! and "selective memorization"): for every heading a window around the cells that reach a share
//! of the largest, and within its rows what lies between the first and the last of them.

use meetpoint_geometry::Pose;

use crate::layer::{Layer, tight};
use crate::pose_grid::{PoseCell, PoseGrid};

/// Probabilities of poses, a layer for every heading.
#[derive(Clone, Debug, PartialEq)]
pub struct Belief {
    layers: Vec<Layer>,
}

impl Belief {
    /// Layers by heading.
    pub(crate) fn new(layers: Vec<Layer>) -> Self {
        Self { layers }
    }

    /// Every pose of the grid alike, summing to one.
    pub(crate) fn uniform(grid: &PoseGrid, inside: impl Fn(Pose) -> bool) -> Self {
        Self::weighted(grid, |pose| if inside(pose) { 1.0 } else { 0.0 })
    }

    /// Every pose of the grid by a weight of its own, summing to one; nothing if all weights are 0.
    #[expect(clippy::cast_possible_truncation, reason = "probabilities in single precision")]
    pub(crate) fn weighted(grid: &PoseGrid, weight: impl Fn(Pose) -> f32) -> Self {
        let layer = |heading| {
            let nodes = grid.window().nodes();
            let poses = nodes.map(|(x, y)| grid.pose_of(PoseCell { x, y, heading }));
            Layer::new(grid.window(), poses.map(&weight).collect())
        };
        let mut belief = Self { layers: (0..grid.n_headings()).map(layer).collect() };
        let sum = belief.sum();
        if sum > 0.0 {
            belief.scale((1.0 / sum) as f32);
        }
        belief
    }

    pub(crate) fn layer(&self, heading: u32) -> &Layer {
        &self.layers[heading as usize]
    }

    /// Headings that have cells, with their layers.
    pub(crate) fn layers(&self) -> impl Iterator<Item = (u32, &Layer)> {
        (0..).zip(&self.layers).filter(|(_, layer)| !layer.is_empty())
    }

    /// The probability of a pose; 0 where none is kept.
    pub fn at(&self, cell: PoseCell) -> f32 {
        let layer = self.layers.get(cell.heading as usize);
        layer.map_or(0.0, |layer| layer.at(cell.x, cell.y))
    }

    /// Poses with a probability above 0, by heading, row and column.
    pub fn entries(&self) -> impl Iterator<Item = (PoseCell, f32)> {
        self.layers().flat_map(|(heading, layer)| {
            layer.entries().map(move |(x, y, weight)| (PoseCell { x, y, heading }, weight))
        })
    }

    /// Probabilities of positions, whatever the heading, row-major from the grid's lower-left node
    /// along +x: what the pictures of alpha, beta and posterior show (TBF98 Figs. 3 and 14).
    pub fn over_positions(&self, grid: &PoseGrid) -> Vec<f32> {
        let mut sums = vec![0.0; grid.n_nodes()];
        for (cell, weight) in self.entries() {
            if let Some(index) = grid.window().index_of(cell.x, cell.y) {
                sums[index] += weight;
            }
        }
        sums
    }

    /// The most probable pose, the first of several; `None` if there is none.
    pub fn peak(&self) -> Option<PoseCell> {
        let higher = |best: Option<(PoseCell, f32)>, entry: (PoseCell, f32)| match best {
            Some(best) if best.1 >= entry.1 => Some(best),
            _ => Some(entry),
        };
        self.entries().fold(None, higher).map(|(cell, _)| cell)
    }

    /// Sum over all poses.
    pub(crate) fn sum(&self) -> f64 {
        let of = |layer: &Layer| -> f64 { layer.weights().iter().copied().map(f64::from).sum() };
        self.layers.iter().map(of).sum()
    }

    pub(crate) fn max(&self) -> f32 {
        let weights = self.layers.iter().flat_map(Layer::weights);
        weights.fold(0.0, |max, &weight| max.max(weight))
    }

    pub(crate) fn scale(&mut self, factor: f32) {
        for layer in &mut self.layers {
            let weights = layer.weights().iter().map(|weight| weight * factor).collect();
            *layer = Layer::new(layer.window(), weights);
        }
    }

    /// Without the poses below `share` of the most probable one's weight.
    pub(crate) fn selected(self, share: f32) -> Self {
        let limit = self.max() * share;
        let layers = self.layers.into_iter().map(|layer| above(&layer, limit)).collect();
        Self { layers }
    }

    /// A layer made from each.
    pub(crate) fn each_layer(&self, make: impl Fn(&Layer) -> Layer) -> Vec<Layer> {
        self.layers.iter().map(make).collect()
    }

    /// A layer made from each, told its heading.
    pub(crate) fn with_each_layer(&self, make: impl Fn(u32, &Layer) -> Layer) -> Vec<Layer> {
        (0..).zip(&self.layers).map(|(heading, layer)| make(heading, layer)).collect()
    }

    /// Cells held.
    pub fn n_cells(&self) -> usize {
        self.layers.iter().map(|layer| layer.weights().len()).sum()
    }

    /// Bytes held.
    pub(crate) fn n_bytes(&self) -> usize {
        self.layers.iter().map(|layer| layer.n_bytes() + size_of::<Layer>()).sum()
    }
}

/// A layer without the weights below `limit`, in the smallest window.
pub(crate) fn above(layer: &Layer, limit: f32) -> Layer {
    let keep = |&weight: &f32| if weight >= limit { weight } else { 0.0 };
    let weights: Vec<f32> = layer.weights().iter().map(keep).collect();
    let around = tight(layer.window(), &weights);
    if around == layer.window() {
        return Layer::new(around, weights);
    }
    Layer::new(layer.window(), weights).cut(around)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::window::Window;

    #[test]
    fn drops_what_does_not_matter() {
        let window = Window { x: 0, y: 0, width: 3, height: 1 };
        let layer = |weights| Layer::new(window, weights);
        let layers = vec![layer(vec![0.0004, 0.002, 0.5]), layer(vec![0.0004, 0.0, 0.0001])];
        let belief = Belief::new(layers).selected(0.001);
        assert_eq!(belief.n_cells(), 2, "the others are below 0.0005");
        assert_eq!(belief.peak(), Some(PoseCell { x: 2, y: 0, heading: 0 }), "the largest");
        assert!(belief.layer(1).is_empty(), "a heading without any");
    }
}
