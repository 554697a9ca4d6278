//! Costs between the nodes of gates.
//!
//! First upward, gate by gate in the order of elimination: what a path costs from a node to a later
//! one over earlier nodes only,
//!
//! ```text
//! up(m, n) = min( inside a region, min over earlier k of up(k, m) + up(k, n) )
//! ```
//!
//! then downward from the roots: what any path costs from a node to one of an ancestor,
//!
//! ```text
//! all(m, n) = min over later k of up(m, k) + all(k, n)
//! ```
//!
//! J. Dibbelt, B. Strasser and D. Wagner, "Customizable contraction hierarchies", ACM Journal of
//! Experimental Algorithmics 21 (2016); the result is the hierarchical hub labelling of I. Abraham
//! et al., ESA 2012. Exact for whatever costs the regions' tables hold. With h nodes in the
//! ancestors of a gate: space O(nodes · h), time O(nodes · h²).

use std::sync::Arc;

use crate::cost::{Cost, UNREACHABLE};
use crate::hierarchy::Hierarchy;

/// Costs between nodes, and how they came about.
#[derive(Clone, Debug)]
pub(crate) struct GateCosts {
    cliques: Vec<Arc<Clique>>,
    up: Vec<Arc<Matrix>>,
    all: Vec<Arc<Matrix>>,
}

/// Costs from the nodes of one gate: a row a node, row-major.
///
/// Columns of `up`: the gate's own nodes, then those of its higher gates by rank. Columns of `all`:
/// the gate's own, then those of all ancestors, the parent's first.
#[derive(Clone, Debug, PartialEq)]
struct Matrix {
    n_columns: usize,
    costs: Vec<Cost>,
    via: Vec<Via>,
}

/// What a cost came from.
///
/// In `up`: a region, or a node on the way. In `all`: the first node on the way that is later.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Via(u32);

impl Via {
    const NOTHING: Self = Self(u32::MAX);
    const REGION: u32 = 1 << 31;

    fn region(region: u32) -> Self {
        Self(Self::REGION | region)
    }

    fn node(gate: usize, node: usize) -> Self {
        // Gates are below 2^25, nodes of a gate below 2^6.
        Self(u32::try_from(gate << 6 | node).unwrap_or(u32::MAX))
    }

    /// Whether this is a node of that gate.
    fn is_of(self, gate: usize) -> bool {
        self.0 & Self::REGION == 0 && (self.0 >> 6) as usize == gate
    }

    fn as_region(self) -> Option<u32> {
        (self.0 & Self::REGION != 0).then_some(self.0 & !Self::REGION)
    }

    fn as_node(self) -> NodeName {
        NodeName { gate: (self.0 >> 6) as usize, node: (self.0 & 63) as usize }
    }
}

/// A node of a gate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct NodeName {
    pub(crate) gate: usize,
    pub(crate) node: usize,
}

/// A way from one node to another that stays in one region.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Leg {
    pub(crate) from: NodeName,
    pub(crate) to: NodeName,
    pub(crate) region: u32,
}

/// Costs between all nodes of one region's gates by ways inside it.
#[derive(Debug, PartialEq)]
pub(crate) struct Clique {
    pub(crate) region: u32,
    /// Gates, each with its place of the first node in the rows.
    pub(crate) gates: Vec<(usize, usize)>,
    pub(crate) n_nodes: usize,
    /// Symmetric; `n_nodes` rows.
    pub(crate) costs: Vec<Cost>,
}

impl Matrix {
    fn new(n_rows: usize, n_columns: usize) -> Self {
        let n = n_rows * n_columns;
        Self { n_columns, costs: vec![UNREACHABLE; n], via: vec![Via::NOTHING; n] }
    }

    fn row(&self, row: usize) -> &[Cost] {
        &self.costs[row * self.n_columns..][..self.n_columns]
    }

    fn improve(&mut self, row: usize, column: usize, cost: Cost, via: Via) {
        let at = row * self.n_columns + column;
        if cost < self.costs[at] {
            self.costs[at] = cost;
            self.via[at] = via;
        }
    }

    /// Row `row`, columns from `first`: at most `extra` more than `costs`.
    fn improve_row(&mut self, row: usize, first: usize, extra: Cost, costs: &[Cost], via: Via) {
        let at = row * self.n_columns + first;
        let known = self.costs[at..].iter_mut().zip(&mut self.via[at..]);
        for ((known, known_via), &cost) in known.zip(costs) {
            let through = extra + cost;
            let is_better = through < *known;
            *known = if is_better { through } else { *known };
            *known_via = if is_better { via } else { *known_via };
        }
    }
}

impl GateCosts {
    /// From the cliques of all regions.
    pub(crate) fn new(hierarchy: &Hierarchy, cliques: Vec<Arc<Clique>>) -> Self {
        let n_gates = hierarchy.order.len();
        let nothing = Arc::new(Matrix::new(0, 0));
        let (up, all) = (vec![nothing.clone(); n_gates], vec![nothing; n_gates]);
        let mut costs = Self { cliques, up, all };
        for &gate in &hierarchy.order {
            costs.up[gate] = Arc::new(costs.upward(hierarchy, gate));
        }
        for &gate in hierarchy.order.iter().rev() {
            costs.all[gate] = Arc::new(costs.downward(hierarchy, gate));
        }
        costs
    }

    /// What they were made from, by region.
    pub(crate) fn cliques(&self) -> &[Arc<Clique>] {
        &self.cliques
    }

    /// With other cliques: equal to costs made afresh, but only what the difference reaches is
    /// computed again. Tells for every gate whether its row changed.
    pub(crate) fn with_cliques(
        &self,
        hierarchy: &Hierarchy,
        cliques: Vec<Arc<Clique>>,
    ) -> (Self, Vec<bool>) {
        let mut costs = Self { cliques, up: self.up.clone(), all: self.all.clone() };
        let mut is_changed = vec![false; hierarchy.order.len()];
        for &gate in &hierarchy.order {
            if costs.may_differ(self, hierarchy, gate, &is_changed) {
                let up = costs.upward(hierarchy, gate);
                is_changed[gate] = up != *self.up[gate];
                if is_changed[gate] {
                    costs.up[gate] = Arc::new(up);
                }
            }
        }
        for &gate in hierarchy.order.iter().rev() {
            let above = || hierarchy.ancestors(gate).any(|ancestor| is_changed[ancestor]);
            if is_changed[gate] || above() {
                let all = costs.downward(hierarchy, gate);
                is_changed[gate] = all != *self.all[gate];
                if is_changed[gate] {
                    costs.all[gate] = Arc::new(all);
                }
            }
        }
        (costs, is_changed)
    }

    /// Whether `up` of a gate may be another than `before`, given which lower ones are.
    fn may_differ(
        &self,
        before: &Self,
        hierarchy: &Hierarchy,
        gate: usize,
        is_changed: &[bool],
    ) -> bool {
        let regions = hierarchy.regions[gate].iter();
        let mut cliques = regions.map(|&region| (&self.cliques[region], &before.cliques[region]));
        let is_other = |(now, then): (&Arc<Clique>, &Arc<Clique>)| {
            !Arc::ptr_eq(now, then) && differs(hierarchy, now, then, gate)
        };
        cliques.any(is_other)
            || hierarchy.lower[gate]
                .iter()
                .any(|&low| is_changed[low] && self.matters(before, hierarchy, low, gate))
    }

    /// Whether ways over a changed lower gate were, or might now be, among the best of `gate`.
    fn matters(&self, before: &Self, hierarchy: &Hierarchy, low: usize, gate: usize) -> bool {
        let known = &before.up[gate];
        if known.via.iter().any(|via| via.is_of(low)) {
            return true;
        }
        let mut is_as_good = false;
        passed_up(hierarchy, low, gate, &self.up[low], |node, column, extra, onward, _| {
            let row = &known.row(node)[column..];
            is_as_good |= onward.iter().zip(row).any(|(&onward, &known)| {
                extra + onward <= known && known < UNREACHABLE || extra + onward < known
            });
        });
        is_as_good
    }

    /// Costs from a node of a gate to the nodes of the gate and of all its ancestors.
    pub(crate) fn row(&self, NodeName { gate, node }: NodeName) -> &[Cost] {
        self.all[gate].row(node)
    }

    /// Memory, in bytes.
    pub(crate) fn n_bytes(&self) -> usize {
        let matrices = self.up.iter().chain(&self.all);
        let matrices: usize = matrices.map(|matrix| size_of_val(matrix.costs.as_slice()) * 2).sum();
        let cliques = self.cliques.iter().map(|clique| size_of_val(clique.costs.as_slice()));
        matrices + cliques.sum::<usize>()
    }

    /// The legs of a shortest path from a node to one of the same gate or an ancestor, appended in
    /// the order of travel; the node's column among those of [`Self::row`].
    pub(crate) fn legs(
        &self,
        hierarchy: &Hierarchy,
        from: NodeName,
        to: NodeName,
        legs: &mut Vec<Leg>,
    ) {
        let mut at = from;
        while at != to {
            // Costs are symmetric: the lower of two nodes has the row.
            let is_lower = precedes(hierarchy, at, to);
            let (low, high) = if is_lower { (at, to) } else { (to, at) };
            let column = column_of_ancestor(hierarchy, low, high);
            let matrix = &self.all[low.gate];
            let next = matrix.via[low.node * matrix.n_columns + column].as_node();
            if is_lower {
                self.legs_up(hierarchy, at, next, legs);
                at = next;
            } else {
                // The end of the path is known first: low -> next is its last piece.
                self.legs(hierarchy, at, next, legs);
                let first = legs.len();
                self.legs_up(hierarchy, low, next, legs);
                turn(&mut legs[first..]);
                at = to;
            }
        }
    }

    /// The legs of `up` from a node to a later one.
    fn legs_up(&self, hierarchy: &Hierarchy, from: NodeName, to: NodeName, legs: &mut Vec<Leg>) {
        let matrix = &self.up[from.gate];
        let column = column_of_higher(hierarchy, from.gate, to);
        let via = matrix.via[from.node * matrix.n_columns + column];
        if let Some(region) = via.as_region() {
            legs.push(Leg { from, to, region });
            return;
        }
        let middle = via.as_node();
        let first = legs.len();
        self.legs_up(hierarchy, middle, from, legs);
        turn(&mut legs[first..]);
        self.legs_up(hierarchy, middle, to, legs);
    }
}

/// Travels legs the other way round.
fn turn(legs: &mut [Leg]) {
    legs.reverse();
    for leg in legs {
        std::mem::swap(&mut leg.from, &mut leg.to);
    }
}

/// Whether a node is eliminated before another.
fn precedes(hierarchy: &Hierarchy, a: NodeName, b: NodeName) -> bool {
    let place = |name: NodeName| (hierarchy.rank[name.gate], name.node);
    place(a) < place(b)
}

fn column_of_higher(hierarchy: &Hierarchy, gate: usize, to: NodeName) -> usize {
    if to.gate == gate {
        return to.node;
    }
    let before = hierarchy.higher[gate].iter().take_while(|&&other| other != to.gate);
    hierarchy.n_nodes[gate] + before.map(|&other| hierarchy.n_nodes[other]).sum::<usize>() + to.node
}

/// Columns of `all` end with those of the root: an ancestor's are as many from the end everywhere.
fn column_of_ancestor(hierarchy: &Hierarchy, from: NodeName, to: NodeName) -> usize {
    hierarchy.n_columns(from.gate) - hierarchy.n_columns(to.gate) + to.node
}

impl GateCosts {
    /// `up` of a gate, that of the lower ones being known.
    fn upward(&self, hierarchy: &Hierarchy, gate: usize) -> Matrix {
        let n_nodes = &hierarchy.n_nodes;
        let n_higher: usize = hierarchy.higher[gate].iter().map(|&other| n_nodes[other]).sum();
        let mut up = Matrix::new(n_nodes[gate], n_nodes[gate] + n_higher);
        for &region in &hierarchy.regions[gate] {
            put_clique(hierarchy, &self.cliques[region], gate, &mut up);
        }
        for &low in &hierarchy.lower[gate] {
            passed_up(hierarchy, low, gate, &self.up[low], |node, column, extra, onward, via| {
                up.improve_row(node, column, extra, onward, via);
            });
        }
        close(&mut up, gate, n_nodes[gate]);
        up
    }
}

/// Writes a region's costs from the nodes of `gate` to later ones.
fn put_clique(hierarchy: &Hierarchy, clique: &Clique, gate: usize, up: &mut Matrix) {
    for (column, node, row) in rows_of(hierarchy, clique, gate) {
        up.improve_row(node, column, 0, row, Via::region(clique.region));
    }
}

/// A region's costs from the nodes of `gate` to those of each gate that is not earlier: column in
/// `up` of the first, node, costs.
fn rows_of<'a>(
    hierarchy: &'a Hierarchy,
    clique: &'a Clique,
    gate: usize,
) -> impl Iterator<Item = (usize, usize, &'a [Cost])> {
    let Clique { gates, n_nodes, costs, .. } = clique;
    let own = gates.iter().filter(move |&&(other, _)| other == gate);
    own.flat_map(move |&(_, first)| {
        let later =
            gates.iter().filter(move |&&(other, _)| hierarchy.rank[gate] <= hierarchy.rank[other]);
        later.flat_map(move |&(other, other_first)| {
            let column = column_of_higher(hierarchy, gate, NodeName { gate: other, node: 0 });
            (0..hierarchy.n_nodes[gate]).map(move |node| {
                let row = &costs[(first + node) * n_nodes + other_first..];
                (column, node, &row[..hierarchy.n_nodes[other]])
            })
        })
    })
}

/// Whether two cliques of a region differ in what `up` of a gate is made from.
fn differs(hierarchy: &Hierarchy, a: &Clique, b: &Clique, gate: usize) -> bool {
    !rows_of(hierarchy, a, gate).eq(rows_of(hierarchy, b, gate))
}

/// Ways among a gate's own nodes, and on from there.
fn close(matrix: &mut Matrix, gate: usize, n_nodes: usize) {
    for middle in 0..n_nodes {
        let row = matrix.row(middle).to_vec();
        for node in middle + 1..n_nodes {
            let extra = row[node];
            if extra < UNREACHABLE {
                let first = middle + 1;
                matrix.improve_row(node, first, extra, &row[first..], Via::node(gate, middle));
            }
        }
    }
}

/// The ways from the nodes of `gate` over those of `low` to later ones: node, column in `up` of the
/// first it leads to, what it costs to the middle node, what from there, and that node.
fn passed_up(
    hierarchy: &Hierarchy,
    low: usize,
    gate: usize,
    up: &Matrix,
    mut way: impl FnMut(usize, usize, Cost, &[Cost], Via),
) {
    let n_nodes = &hierarchy.n_nodes;
    let first = column_of_higher(hierarchy, low, NodeName { gate, node: 0 });
    let place = hierarchy.higher[low].iter().position(|&high| high == gate).unwrap_or(0);
    let mut high_first = first;
    for &high in &hierarchy.higher[low][place..] {
        let column = column_of_higher(hierarchy, gate, NodeName { gate: high, node: 0 });
        for middle in 0..n_nodes[low] {
            let row = up.row(middle);
            let onward = &row[high_first..high_first + n_nodes[high]];
            for node in 0..n_nodes[gate] {
                let extra = row[first + node];
                if extra < UNREACHABLE {
                    way(node, column, extra, onward, Via::node(low, middle));
                }
            }
        }
        high_first += n_nodes[high];
    }
}

impl GateCosts {
    /// Costs from a gate to itself and all ancestors, those of which are known.
    fn downward(&self, hierarchy: &Hierarchy, gate: usize) -> Matrix {
        let Self { up, all, .. } = self;
        let n_own = hierarchy.n_nodes[gate];
        let n_columns = hierarchy.n_columns(gate);
        let mut costs = Matrix::new(n_own, n_columns);
        // Rows of all later nodes that a way may go to first: higher gates' to this gate's ancestors.
        let mut first = n_own;
        for &high in &hierarchy.higher[gate] {
            for node in 0..hierarchy.n_nodes[high] {
                let onward = onward(hierarchy, all, gate, NodeName { gate: high, node });
                for own in 0..n_own {
                    let extra = up[gate].row(own)[first + node];
                    if extra < UNREACHABLE {
                        costs.improve_row(own, n_own, extra, &onward, Via::node(high, node));
                    }
                }
            }
            first += hierarchy.n_nodes[high];
        }
        for own in (0..n_own).rev() {
            costs.improve(own, own, 0, Via::node(gate, own));
            for later in own + 1..n_own {
                let extra = up[gate].row(own)[later];
                if extra < UNREACHABLE {
                    let onward = costs.row(later)[own + 1..].to_vec();
                    costs.improve_row(own, own + 1, extra, &onward, Via::node(gate, later));
                }
            }
            back_over_higher(hierarchy, up, gate, own, &mut costs);
            for later in own + 1..n_own {
                let at = own * n_columns + later;
                let mirrored = later * n_columns + own;
                costs.costs[mirrored] = costs.costs[at];
                costs.via[mirrored] = costs.via[at];
            }
        }
        costs
    }
}

/// Ways from a node up to a higher gate and back to a later node of its own gate.
fn back_over_higher(
    hierarchy: &Hierarchy,
    up: &[Arc<Matrix>],
    gate: usize,
    own: usize,
    costs: &mut Matrix,
) {
    let n_own = hierarchy.n_nodes[gate];
    let mut first = n_own;
    for &high in &hierarchy.higher[gate] {
        let column = column_of_ancestor(
            hierarchy,
            NodeName { gate, node: 0 },
            NodeName { gate: high, node: 0 },
        );
        for node in 0..hierarchy.n_nodes[high] {
            let extra = up[gate].row(own)[first + node];
            for later in own + 1..n_own {
                let through = extra + costs.row(later)[column + node];
                costs.improve(own, later, through, Via::node(high, node));
            }
        }
        first += hierarchy.n_nodes[high];
    }
}

/// Costs from a node of a higher gate to the nodes of all ancestors of `gate`, the parent's first.
fn onward(hierarchy: &Hierarchy, all: &[Arc<Matrix>], gate: usize, from: NodeName) -> Vec<Cost> {
    let mut onward = Vec::with_capacity(hierarchy.n_above[gate]);
    for ancestor in hierarchy.ancestors(gate).take_while(|&ancestor| ancestor != from.gate) {
        let column = column_of_ancestor(hierarchy, NodeName { gate: ancestor, node: 0 }, from);
        let rows = 0..hierarchy.n_nodes[ancestor];
        onward.extend(rows.map(|node| all[ancestor].row(node)[column]));
    }
    onward.extend_from_slice(all[from.gate].row(from.node));
    onward
}
