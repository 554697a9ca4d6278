//! Costs over earlier nodes only, gate by gate upward.

use std::sync::Arc;

use super::matrix::{Matrix, NodeName, Via, column_of_higher};
use super::{Clique, GateCosts};
use crate::cost::{Cost, UNREACHABLE};
use crate::hierarchy::Hierarchy;

impl GateCosts {
    /// `up` of a gate, that of the lower ones being known.
    pub(super) fn upward(&self, hierarchy: &Hierarchy, gate: usize) -> Matrix {
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

    /// Whether `up` of a gate may be another than `before`, given which lower ones are.
    pub(super) fn may_differ(
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
