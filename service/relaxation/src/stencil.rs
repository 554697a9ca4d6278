//! The innermost loops: a slab of a kernel drawn over a layer.
//!
//! ```text
//! out(x, y) += sum over (dx, dy) of slab(dx, dy) source(x + dx, y + dy)
//! ```
//!
//! With the slab mirrored the same loop carries weights forward in time (TBF98 equation (16)), as it
//! stands backward (17); it looks up what a map says of a sighting, and mirrored it writes sightings
//! into a map. Time: nodes of the source times entries of the slab, rows at a time.

use crate::layer::Layer;
use crate::window::Window;

/// Turned to a heading, mirrored where asked, cut into rows.
#[derive(Debug, Default)]
pub(crate) struct Stencil {
    rows: Vec<Row>,
    taps: Vec<f32>,
    reach: i32,
}

#[derive(Debug)]
struct Row {
    x: i32,
    y: i32,
    start: usize,
    end: usize,
}

/// How rows are combined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Combine {
    /// Probabilities of all ways are added.
    Sum,
    /// The most probable way counts.
    Max,
}

impl Stencil {
    /// A table turned by right angles, and by half a turn more where `mirrored`, so that what led
    /// to a node is found from it.
    pub(crate) fn new(table: &Layer, n_quarters: u32, mirrored: bool) -> Self {
        let n_quarters = (n_quarters + if mirrored { 2 } else { 0 }) % 4;
        let turned = turned(table, n_quarters);
        let mut stencil = Self::default();
        let window = turned.window();
        for y in window.y..window.top() {
            let (x, taps) = turned.row(y);
            let start = stencil.taps.len();
            stencil.taps.extend_from_slice(taps);
            stencil.rows.push(Row { x, y, start, end: stencil.taps.len() });
        }
        stencil.reach = window.width - 1;
        stencil
    }

    /// Where a layer over `source` can be seen from.
    pub(crate) fn window_over(&self, source: Window) -> Window {
        let mut all = Window::EMPTY;
        for row in &self.rows {
            let width = i32::try_from(row.end - row.start).unwrap_or(i32::MAX);
            let x = source.x - row.x - width + 1;
            let window =
                Window { x, y: source.y - row.y, width: source.width + width - 1, ..source };
            all = all.union(window);
        }
        all
    }

    /// Draws over `source` into `out`, in its spans only. `scratch` is overwritten.
    pub(crate) fn draw(
        &self,
        source: &Layer,
        out: &mut Layer,
        combine: Combine,
        scratch: &mut Vec<f32>,
    ) {
        let window = source.window();
        for source_y in window.y..window.top() {
            let (x, nodes) = source.row(source_y);
            if nodes.is_empty() {
                continue;
            }
            let padded_x = x - self.reach;
            pad(nodes, self.reach, scratch);
            for row in &self.rows {
                let y = source_y - row.y;
                if out.window().y <= y && y < out.window().top() {
                    let taps = &self.taps[row.start..row.end];
                    draw_row(taps, scratch, padded_x - row.x, out.row_mut(y), combine);
                }
            }
        }
    }
}

/// A layer about the origin turned by right angles, counter-clockwise.
fn turned(table: &Layer, n_quarters: u32) -> Layer {
    if n_quarters == 0 {
        return table.clone();
    }
    let Window { x, y, width, height } = table.window();
    let (right, top) = (x + width - 1, y + height - 1);
    let window = match n_quarters {
        1 => Window { x: -top, y: x, width: height, height: width },
        2 => Window { x: -right, y: -top, width, height },
        _ => Window { x: y, y: -right, width: height, height: width },
    };
    let weight = |(x, y): (i32, i32)| match n_quarters {
        1 => table.at(y, -x),
        2 => table.at(-x, -y),
        _ => table.at(-y, x),
    };
    Layer::new(window, window.nodes().map(weight).collect())
}

/// `nodes` with zeros on both sides.
fn pad(nodes: &[f32], reach: i32, scratch: &mut Vec<f32>) {
    let reach = usize::try_from(reach).unwrap_or(0);
    scratch.clear();
    scratch.resize(reach, 0.0);
    scratch.extend_from_slice(nodes);
    scratch.resize(scratch.len() + reach, 0.0);
}

/// One row of taps over one padded row of nodes, the first of which is seen from column `seen_x`.
#[expect(clippy::cast_sign_loss, reason = "differences of ordered columns")]
#[expect(clippy::cast_possible_wrap, reason = "rows are far shorter")]
#[expect(clippy::cast_possible_truncation, reason = "rows are far shorter")]
fn draw_row(
    taps: &[f32],
    padded: &[f32],
    seen_x: i32,
    (out_x, out): (i32, &mut [f32]),
    combine: Combine,
) {
    if taps.is_empty() {
        return;
    }
    let seen_end = seen_x + (padded.len() - (taps.len() - 1)) as i32;
    let begin = seen_x.max(out_x);
    let end = seen_end.min(out_x + out.len() as i32);
    if begin >= end {
        return;
    }
    let out = &mut out[(begin - out_x) as usize..(end - out_x) as usize];
    let padded = &padded[(begin - seen_x) as usize..];
    match combine {
        Combine::Sum => add_correlation(taps, padded, out),
        Combine::Max => raise_to_correlation(taps, padded, out),
    }
}

/// `out[i] += sum over j of taps[j] nodes[i + j]`, six taps at a time.
fn add_correlation(taps: &[f32], nodes: &[f32], out: &mut [f32]) {
    let (sixes, rest) = taps.as_chunks::<6>();
    for (six, first) in sixes.iter().zip((0..).step_by(6)) {
        add_taps(six, &nodes[first..], out);
    }
    let nodes = &nodes[6 * sixes.len()..];
    match *rest {
        [a] => add_taps(&[a], nodes, out),
        [a, b] => add_taps(&[a, b], nodes, out),
        [a, b, c] => add_taps(&[a, b, c], nodes, out),
        [a, b, c, d] => add_taps(&[a, b, c, d], nodes, out),
        [a, b, c, d, e] => add_taps(&[a, b, c, d, e], nodes, out),
        _ => {}
    }
}

/// So many taps in one go: each node of `out` is read and written once.
fn add_taps<const N: usize>(taps: &[f32; N], nodes: &[f32], out: &mut [f32]) {
    let n = out.len();
    let shifted: [&[f32]; N] = std::array::from_fn(|tap| &nodes[tap..tap + n]);
    for (i, out) in out.iter_mut().enumerate() {
        let mut sum = 0.0;
        for (tap, nodes) in taps.iter().zip(shifted) {
            sum += tap * nodes[i];
        }
        *out += sum;
    }
}

/// The same with the largest product in place of the sum.
fn raise_to_correlation(taps: &[f32], nodes: &[f32], out: &mut [f32]) {
    for (offset, tap) in taps.iter().enumerate() {
        for (max, node) in out.iter_mut().zip(&nodes[offset..]) {
            *max = max.max(tap * node);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn layer() -> impl Strategy<Value = Layer> {
        (-6_i32..6, -6_i32..6, 1_i32..9, 1_i32..9).prop_flat_map(|(x, y, width, height)| {
            let n = usize::try_from(width * height).unwrap_or(0);
            let weight = prop_oneof![Just(0.0_f32), 0.0_f32..1.0];
            proptest::collection::vec(weight, n)
                .prop_map(move |weights| Layer::new(Window { x, y, width, height }, weights))
        })
    }

    /// The definition, node by node.
    fn reference(table: &Layer, n_quarters: u32, source: &Layer, x: i32, y: i32) -> Vec<f32> {
        let turn = |(x, y, weight): (i32, i32, f32)| match n_quarters % 4 {
            0 => (x, y, weight),
            1 => (-y, x, weight),
            2 => (-x, -y, weight),
            _ => (y, -x, weight),
        };
        table.entries().map(turn).map(|(dx, dy, tap)| tap * source.at(x + dx, y + dy)).collect()
    }

    proptest! {
        #[test]
        fn equals_the_definition(
            table in layer(),
            source in layer(),
            out in layer(),
            n_quarters in 0_u32..4,
            mirrored: bool,
        ) {
            let stencil = Stencil::new(&table, n_quarters, mirrored);
            let quarters = n_quarters + if mirrored { 2 } else { 0 };
            let window = out.window();
            for combine in [Combine::Sum, Combine::Max] {
                let mut drawn = Layer::zeros(window);
                stencil.draw(&source, &mut drawn, combine, &mut Vec::new());
                for (x, y) in window.nodes() {
                    let products = reference(&table, quarters, &source, x, y);
                    let expected = match combine {
                        Combine::Sum => products.iter().sum::<f32>(),
                        Combine::Max => products.iter().fold(0.0_f32, |max, &product| max.max(product)),
                    };
                    prop_assert!((drawn.at(x, y) - expected).abs() < 1e-5);
                }
            }
        }

        #[test]
        fn what_is_seen_lies_in_the_window(table in layer(), source in layer(), mirrored: bool) {
            let stencil = Stencil::new(&table, 1, mirrored);
            let window = stencil.window_over(source.window());
            let around = Window { x: -40, y: -40, width: 80, height: 80 };
            let mut drawn = Layer::zeros(around);
            stencil.draw(&source, &mut drawn, Combine::Sum, &mut Vec::new());
            for (x, y, _) in Layer::new(around, drawn.weights().to_vec()).entries() {
                prop_assert!(window.index_of(x, y).is_some(), "({}, {}) in {:?}", x, y, window);
            }
        }
    }
}
