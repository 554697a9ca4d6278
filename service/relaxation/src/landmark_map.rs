//! The probabilistic map: for every node and kind of landmark, how probable one is there (TBF98
//! section 4.2, `P(m_xy = l)`; "no landmark" is what is left to one).

use std::num::NonZero;

use nalgebra::{Matrix2, SymmetricEigen};

use crate::landmark::{Kinds, Landmark, LandmarkKind};
use crate::layer::Layer;
use crate::no_landmark::{View, nothing_in_view};
use crate::perception::{Perception, PerceptionParams, single};
use crate::pose_grid::PoseGrid;
use crate::spread::normal;

/// A map of probabilities.
#[derive(Clone, Debug, PartialEq)]
pub struct LandmarkMap {
    grid: PoseGrid,
    kinds: Kinds,
    /// By kind, over the whole grid; at every node they sum to at most one.
    layers: Vec<Layer>,
}

impl LandmarkMap {
    /// Given probabilities by kind; where they sum to more than one they are scaled down.
    pub(crate) fn new(grid: PoseGrid, kinds: Kinds, mut by_kind: Vec<Vec<f32>>) -> Self {
        for node in 0..grid.n_nodes() {
            let sum: f32 = by_kind.iter().map(|kind| kind[node]).sum();
            if sum > 1.0 {
                for kind in &mut by_kind {
                    kind[node] /= sum;
                }
            }
        }
        Self::restored(grid, kinds, by_kind)
    }

    /// The very probabilities that another map had.
    pub(crate) fn restored(grid: PoseGrid, kinds: Kinds, by_kind: Vec<Vec<f32>>) -> Self {
        let layers = by_kind.into_iter().map(|kind| Layer::new(grid.window(), kind)).collect();
        Self { grid, kinds, layers }
    }

    /// Known landmarks, each spread over the nodes around it by its covariance.
    pub(crate) fn from_landmarks(grid: PoseGrid, kinds: Kinds, landmarks: &[Landmark]) -> Self {
        let mut by_kind = vec![vec![0.0; grid.n_nodes()]; kinds.n()];
        for landmark in landmarks {
            if let Some(kind) = kinds.index_of(landmark.kind) {
                spread(&grid, landmark, &mut by_kind[kind]);
            }
        }
        Self::new(grid, kinds, by_kind)
    }

    /// The grid that it is on.
    pub fn grid(&self) -> &PoseGrid {
        &self.grid
    }

    /// Kinds of landmarks that it tells apart, in order.
    pub fn kinds(&self) -> &[LandmarkKind] {
        self.kinds.as_slice()
    }

    /// Probabilities of the kind of that place in [`Self::kinds`], over the whole grid.
    pub(crate) fn layer(&self, kind: usize) -> &Layer {
        &self.layers[kind]
    }

    /// The probability of a landmark of a kind at a node; 0 outside the grid.
    pub fn at(&self, kind: LandmarkKind, x: i32, y: i32) -> f32 {
        self.kinds.index_of(kind).map_or(0.0, |kind| self.layers[kind].at(x, y))
    }

    /// Probabilities of a landmark of any kind, row-major from the grid's lower-left node along +x.
    pub fn probabilities(&self) -> Vec<f32> {
        let sum = |node| self.layers.iter().map(|layer| layer.weights()[node]).sum();
        (0..self.grid.n_nodes()).map(sum).collect()
    }

    /// The same landmarks on a grid with other nodes: every node's probability moves to the nodes
    /// around its place.
    pub(crate) fn on(&self, grid: PoseGrid) -> Self {
        let share = (grid.resolution_m() / self.grid.resolution_m()).powi(2).min(1.0);
        let by_kind = self.layers.iter().map(|layer| {
            let values = grid.window().nodes().map(|(x, y)| {
                let point = grid.point_of(x, y);
                let (x, y) = (self.grid.in_nodes(point.x), self.grid.in_nodes(point.y));
                single(interpolated(layer, x, y) * share)
            });
            values.collect()
        });
        Self::new(grid, self.kinds.clone(), by_kind.collect())
    }

    /// What it says about sightings (see `perception.rs`).
    pub(crate) fn perception(
        &self,
        params: &PerceptionParams,
        view: &View,
        n_threads: NonZero<usize>,
    ) -> Perception {
        let any = self.probabilities();
        let seen = params.seen();
        let n = self.kinds.n();
        let odds = |kind_seen| {
            let node = |node: usize| {
                let as_seen = (0..n)
                    .map(|is| params.taken_for(kind_seen, is, n) * self.layers[is].weights()[node]);
                seen * as_seen.sum::<f32>() / (1.0 - seen * any[node])
            };
            Layer::new(self.grid.window(), (0..self.grid.n_nodes()).map(node).collect())
        };
        let logarithms: Vec<f64> =
            any.iter().map(|&any| (-f64::from(seen) * f64::from(any)).ln_1p()).collect();
        let nothing = nothing_in_view(&self.grid, view, &logarithms, n_threads);
        Perception::new(&self.grid, (0..n).map(odds).collect(), nothing, params)
    }

    /// Bytes held.
    pub(crate) fn n_bytes(&self) -> usize {
        self.layers.iter().map(Layer::n_bytes).sum()
    }
}

/// Splits a landmark among the nodes where it may be. Splitting adds a variance, which is taken
/// off its own.
fn spread(grid: &PoseGrid, landmark: &Landmark, nodes: &mut [f32]) {
    let known = landmark.covariance_m2.iter().all(|value| value.is_finite());
    let covariance_m2 = if known { landmark.covariance_m2 } else { Matrix2::zeros() };
    let axes = SymmetricEigen::new(covariance_m2);
    let along = |axis: usize| {
        normal(axes.eigenvalues[axis] - grid.node_variance_m2(), grid.resolution_m() / 2.0)
    };
    for (first, of_first) in along(0) {
        for (second, of_second) in along(1) {
            let offset = axes.eigenvectors.column(0) * first + axes.eigenvectors.column(1) * second;
            let at = landmark.position + offset;
            let weight = landmark.certainty.clamp(0.0, 1.0) * of_first * of_second;
            split(grid, grid.in_nodes(at.x), grid.in_nodes(at.y), weight, nodes);
        }
    }
}

/// Splits a weight among the four nodes around a place, given in nodes.
fn split(grid: &PoseGrid, x: f64, y: f64, weight: f64, nodes: &mut [f32]) {
    for (corner, part) in corners(x, y) {
        if let Some(index) = grid.window().index_of(corner.0, corner.1) {
            // A place or a certainty that is not a number counts nothing.
            nodes[index] += single((weight * part).max(0.0));
        }
    }
}

fn interpolated(layer: &Layer, x: f64, y: f64) -> f64 {
    corners(x, y).iter().map(|&((x, y), part)| part * f64::from(layer.at(x, y))).sum()
}

/// The four nodes around a place, and how much of it each is.
#[expect(clippy::cast_possible_truncation, reason = "saturates far outside of any grid")]
fn corners(x: f64, y: f64) -> [((i32, i32), f64); 4] {
    let (left, bottom) = (x.floor(), y.floor());
    let (right_part, top_part) = (x - left, y - bottom);
    let (left, bottom) = (left as i32, bottom as i32);
    let (right, top) = (left.saturating_add(1), bottom.saturating_add(1));
    [
        ((left, bottom), (1.0 - right_part) * (1.0 - top_part)),
        ((right, bottom), right_part * (1.0 - top_part)),
        ((left, top), (1.0 - right_part) * top_part),
        ((right, top), right_part * top_part),
    ]
}
