//! The most likely map, given where the robot was (TBF98 section 4.2, equations (19)-(21)).
//!
//! ```text
//! P(m_c = l | d) = expected number of times that l was observed at c
//!                / expected number of times that something was observed at c
//! ```
//!
//! The paper's last form of (19) divides by T, the number of steps, which is right where every step
//! tells something of every place; here the divisor counts the steps that had c in view, times
//! the chance p not to miss a landmark. A sighting z counts at c with
//!
//! ```text
//! g(z | c, xi)                                          by (21): no place is more probable before
//! g(z | c, xi) odds(c) / [k + sum over c' of g odds(c')]   by (20): given the current map
//! ```
//!
//! and with (20) the step is exact for the likelihood of `perception.rs`: among maps, it maximises
//! the expected logarithm `H ln(p m) + (V - H) ln(1 - p m)`, H and V being the two counts.

use std::num::NonZero;

use crate::belief::Belief;
use crate::e_step::Model;
use crate::landmark::Kinds;
use crate::landmark_map::LandmarkMap;
use crate::layer::Layer;
use crate::no_landmark::{View, times_in_view};
use crate::perception::{Perception, PerceptionParams, Seen, single};
use crate::pose_grid::PoseGrid;
use crate::side_by_side::side_by_side;
use crate::stencil::{Combine, Stencil};
use crate::window::Window;

/// How counts become probabilities.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapParams {
    /// So many iterations count by (21), as the paper does in all of them: any place may hold a
    /// sighting's landmark, whatever the map says, so that landmarks stay as wide as the errors of
    /// position and perception together, and false ones fade slowly. Later ones count by (20): the
    /// likelihood never falls, and landmarks contract to where all their sightings agree, which
    /// is sure and fast but must not come too early.
    pub n_even_iterations: u32,
    /// Times that every place is taken to have been looked at in vain beforehand, so that a
    /// single sighting makes no certain landmark; 0 for the paper's frequencies.
    pub n_seen_nothing: f64,
}

impl MapParams {
    /// Six iterations by (21), the coarse ones among them, then (20): in the paper's first data set
    /// about the number after which landmarks no longer change partners.
    pub const CONTRACTING: Self = Self { n_even_iterations: 6, n_seen_nothing: 0.1 };

    /// The paper's counts, but for a tenth of a look beforehand, which keeps places at the rim of
    /// what was seen from becoming landmarks.
    pub const THRUN_1998: Self = Self { n_even_iterations: u32::MAX, n_seen_nothing: 0.1 };
}

/// The map before, for those who count by (20).
pub(crate) struct Before<'a> {
    pub(crate) map: &'a LandmarkMap,
    pub(crate) perception: &'a Perception,
}

/// What poses and sightings say of places: the sums that a map is made from.
pub(crate) struct Counts {
    /// By kind seen: where sightings' landmarks are, for all poses together.
    by_kind_seen: Vec<Layer>,
    /// V: expected number of times that every node was in view.
    times: Vec<f64>,
}

impl Counts {
    /// Of one travel, given probabilities of its poses.
    pub(crate) fn of(
        model: &Model<'_>,
        n_kinds: usize,
        beliefs: &[Belief],
        before: Option<&Before<'_>>,
        view: &View,
    ) -> Self {
        let n_steps = u32::try_from(beliefs.len()).unwrap_or(u32::MAX);
        let n_units = 20 * beliefs.iter().map(Belief::n_cells).sum::<usize>();
        let by_step = side_by_side(n_steps, model.n_threads, n_units, |step| {
            let step = step as usize;
            let seen = model.observations[step].seen.iter();
            seen.map(|seen| (seen.kind, places(model, &beliefs[step], seen, before)))
                .collect::<Vec<_>>()
        });
        let mut by_kind_seen = vec![Layer::zeros(model.grid.window()); n_kinds];
        for (kind, places) in by_step.iter().flatten() {
            by_kind_seen[*kind].add(places);
        }
        Self { by_kind_seen, times: times(model, beliefs, view, model.n_threads) }
    }

    /// With those of another travel on the same grid.
    pub(crate) fn with(mut self, other: &Self) -> Self {
        for (seen, others) in self.by_kind_seen.iter_mut().zip(&other.by_kind_seen) {
            seen.add(others);
        }
        for (times, others) in self.times.iter_mut().zip(&other.times) {
            *times += others;
        }
        self
    }

    /// The most likely map.
    pub(crate) fn map(
        &self,
        grid: &PoseGrid,
        kinds: &Kinds,
        before: Option<&Before<'_>>,
        (map_params, perception_params): (&MapParams, &PerceptionParams),
    ) -> LandmarkMap {
        let hits = hits(grid, &self.by_kind_seen, before, perception_params);
        let seen = f64::from(perception_params.seen());
        let mut by_kind = vec![vec![0.0; grid.n_nodes()]; kinds.n()];
        for (node, times) in self.times.iter().enumerate() {
            let n_hits: f64 = hits.iter().map(|kind| f64::from(kind[node])).sum();
            let n_times = (seen * times + map_params.n_seen_nothing).max(n_hits);
            if n_times > 0.0 {
                for (kind, hits) in by_kind.iter_mut().zip(&hits) {
                    kind[node] = single(f64::from(hits[node]) / n_times);
                }
            }
        }
        LandmarkMap::new(*grid, kinds.clone(), by_kind)
    }
}

/// Where a sighting's landmark is, for all poses together: the sum of `g(z | c, xi)` times the
/// pose's probability, divided by the sighting's density where a map is given.
fn places(model: &Model<'_>, belief: &Belief, seen: &Seen, before: Option<&Before<'_>>) -> Layer {
    let grid = model.grid;
    let drawn: Vec<(Vec<Stencil>, Layer)> = belief
        .layers()
        .map(|(heading, layer)| {
            let weights = match before {
                None => layer.clone(),
                Some(before) => {
                    let density = before.perception.density(grid, seen, heading, layer);
                    divided(layer, &density)
                }
            };
            (seen.stencils(grid, heading, true), weights)
        })
        .collect();
    let mut window = Window::EMPTY;
    for (stencils, layer) in &drawn {
        for stencil in stencils {
            window = window.union(stencil.window_over(layer.window()));
        }
    }
    let mut out = Layer::zeros(window.intersection(grid.window()));
    let mut scratch = Vec::new();
    for (stencils, layer) in &drawn {
        for stencil in stencils {
            stencil.draw(layer, &mut out, Combine::Sum, &mut scratch);
        }
    }
    out
}

fn divided(layer: &Layer, density: &Layer) -> Layer {
    let quotient = |(&weight, &density): (&f32, &f32)| {
        if density > 0.0 { weight / density } else { 0.0 }
    };
    let weights = layer.weights().iter().zip(density.weights()).map(quotient).collect();
    Layer::new(layer.window(), weights)
}

/// H: expected sightings of every kind at every node.
fn hits(
    grid: &PoseGrid,
    by_kind_seen: &[Layer],
    before: Option<&Before<'_>>,
    params: &PerceptionParams,
) -> Vec<Vec<f32>> {
    let n = by_kind_seen.len();
    let (seen, area_m2) = (params.seen(), grid.node_area_m2());
    let any = before.map(|before| before.map.probabilities());
    let of_kind = |is: usize| {
        let node = |node: usize| {
            let counted = (0..n)
                .map(|kind| params.taken_for(kind, is, n) * by_kind_seen[kind].weights()[node]);
            let counted: f32 = counted.sum();
            match (before, &any) {
                (Some(before), Some(any)) => {
                    let here = before.map.layer(is).weights()[node];
                    counted * seen * here / (1.0 - seen * any[node]) * single(1.0 / area_m2)
                }
                _ => counted,
            }
        };
        (0..grid.n_nodes()).map(node).collect()
    };
    (0..n).map(of_kind).collect()
}

/// V: expected number of times that every node was in view.
fn times(
    model: &Model<'_>,
    beliefs: &[Belief],
    view: &View,
    n_threads: NonZero<usize>,
) -> Vec<f64> {
    let n_kinds = view.n_kinds(model.grid) as usize;
    let window = model.grid.window();
    let mut at = vec![vec![0.0; model.grid.n_nodes()]; n_kinds];
    for (belief, observation) in beliefs.iter().zip(model.observations) {
        if !observation.something_in_view {
            continue;
        }
        for (heading, layer) in belief.layers() {
            let at = &mut at[heading as usize % n_kinds];
            for (x, y, weight) in layer.entries() {
                if let Some(index) = window.index_of(x, y) {
                    at[index] += f64::from(weight);
                }
            }
        }
    }
    times_in_view(model.grid, view, &at, n_threads)
}
