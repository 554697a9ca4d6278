//! Weights over a window of nodes: what a belief holds for one heading, and what a map is.

use crate::window::Window;

/// Weights over a window, row-major, with the part of each row that is not zero.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Layer {
    window: Window,
    weights: Vec<f32>,
    /// Invariant: one a row; first column and column after the last that count, from the window's
    /// left. Weights outside are 0.
    spans: Vec<(u32, u32)>,
}

impl Layer {
    /// No nodes at all.
    pub(crate) const EMPTY: Self =
        Self { window: Window::EMPTY, weights: Vec::new(), spans: Vec::new() };

    /// Zeros, all of which may be written to.
    #[expect(clippy::cast_sign_loss, reason = "not negative after max")]
    pub(crate) fn zeros(window: Window) -> Self {
        let (width, height) = (window.width.max(0) as u32, window.height.max(0) as usize);
        Self { window, weights: vec![0.0; window.n_cells()], spans: vec![(0, width); height] }
    }

    /// Given weights, row-major.
    pub(crate) fn new(window: Window, weights: Vec<f32>) -> Self {
        assert_eq!(weights.len(), window.n_cells(), "a weight a node");
        let mut layer = Self { weights, ..Self::zeros(Window::EMPTY) };
        layer.window = window;
        layer.spans = spans_of(window, &layer.weights);
        layer
    }

    pub(crate) fn window(&self) -> Window {
        self.window
    }

    pub(crate) fn weights(&self) -> &[f32] {
        &self.weights
    }

    pub(crate) fn into_weights(self) -> Vec<f32> {
        self.weights
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.weights.is_empty()
    }

    pub(crate) fn at(&self, x: i32, y: i32) -> f32 {
        self.window.index_of(x, y).map_or(0.0, |index| self.weights[index])
    }

    /// The part of a row that counts: the column of its first node, and the nodes.
    #[expect(clippy::cast_sign_loss, reason = "rows are inside the window")]
    #[expect(clippy::cast_possible_wrap, reason = "a window is far narrower")]
    pub(crate) fn row(&self, y: i32) -> (i32, &[f32]) {
        let row = (y - self.window.y) as usize;
        let (start, end) = self.spans[row];
        let begin = row * self.window.width as usize;
        let nodes = &self.weights[begin + start as usize..begin + end as usize];
        (self.window.x + start as i32, nodes)
    }

    /// The same, to be written to.
    #[expect(clippy::cast_sign_loss, reason = "rows are inside the window")]
    #[expect(clippy::cast_possible_wrap, reason = "a window is far narrower")]
    pub(crate) fn row_mut(&mut self, y: i32) -> (i32, &mut [f32]) {
        let row = (y - self.window.y) as usize;
        let (start, end) = self.spans[row];
        let begin = row * self.window.width as usize;
        let nodes = &mut self.weights[begin + start as usize..begin + end as usize];
        (self.window.x + start as i32, nodes)
    }

    /// Zeros in the same shape, of which the same may be written to.
    pub(crate) fn same_shape(&self) -> Self {
        Self {
            window: self.window,
            weights: vec![0.0; self.weights.len()],
            spans: self.spans.clone(),
        }
    }

    /// Nodes with a weight, and the weights.
    pub(crate) fn entries(&self) -> impl Iterator<Item = (i32, i32, f32)> {
        self.window
            .nodes()
            .zip(&self.weights)
            .filter_map(|((x, y), &weight)| (weight > 0.0).then_some((x, y, weight)))
    }

    /// The part of `window` in a layer of its own.
    pub(crate) fn cut(&self, window: Window) -> Self {
        if window.is_empty() {
            return Self::EMPTY;
        }
        Self::new(window, window.nodes().map(|(x, y)| self.at(x, y)).collect())
    }

    /// Adds another layer's weights; what lies outside this one's window is left out.
    pub(crate) fn add(&mut self, other: &Self) {
        let common = self.window.intersection(other.window);
        for y in common.y..common.top() {
            let (x, source) = other.row(y);
            for (x, &weight) in (x..).zip(source) {
                if let Some(index) = self.window.index_of(x, y) {
                    self.weights[index] += weight;
                }
            }
        }
    }

    /// Bytes held.
    pub(crate) fn n_bytes(&self) -> usize {
        size_of_val(self.weights.as_slice()) + size_of_val(self.spans.as_slice())
    }
}

/// The smallest window around the weights above 0; `weights` are row-major over `window`.
#[expect(clippy::cast_sign_loss, reason = "not negative after max")]
pub(crate) fn tight(window: Window, weights: &[f32]) -> Window {
    let mut found: Option<(i32, i32, i32, i32)> = None;
    for (y, row) in (window.y..).zip(weights.chunks(window.width.max(1) as usize)) {
        let Some(first) = row.iter().position(|&weight| weight > 0.0) else { continue };
        let last = row.iter().rposition(|&weight| weight > 0.0).unwrap_or(first);
        let (left, right) = (window.x + column(first), window.x + column(last) + 1);
        found = Some(match found {
            None => (left, right, y, y + 1),
            Some((l, r, bottom, _)) => (l.min(left), r.max(right), bottom, y + 1),
        });
    }
    found.map_or(Window::EMPTY, |(left, right, bottom, top)| Window {
        x: left,
        y: bottom,
        width: right - left,
        height: top - bottom,
    })
}

#[expect(clippy::cast_possible_truncation, reason = "columns of a window")]
#[expect(clippy::cast_possible_wrap, reason = "columns of a window")]
fn column(index: usize) -> i32 {
    index as i32
}

#[expect(clippy::cast_possible_truncation, reason = "columns of a window")]
#[expect(clippy::cast_sign_loss, reason = "not negative after max")]
fn spans_of(window: Window, weights: &[f32]) -> Vec<(u32, u32)> {
    let span = |row: &[f32]| match row.iter().position(|&weight| weight != 0.0) {
        None => (0, 0),
        Some(first) => {
            let last = row.iter().rposition(|&weight| weight != 0.0).unwrap_or(first);
            (first as u32, last as u32 + 1)
        }
    };
    weights.chunks(window.width.max(1) as usize).map(span).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keeps_what_counts_of_a_row() {
        let window = Window { x: 3, y: -1, width: 4, height: 2 };
        let layer = Layer::new(window, vec![0.0, 1.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(layer.row(-1), (4, &[1.0, 0.0, 2.0][..]), "from the first to the last");
        assert_eq!(layer.row(0).1.len(), 0, "nothing above");
        assert_eq!(layer.at(6, -1), 2.0, "by its place");
        assert_eq!(layer.at(7, -1), 0.0, "outside");
        let tight = tight(window, layer.weights());
        assert_eq!(tight, Window { x: 4, y: -1, width: 3, height: 1 }, "around what is not zero");
        assert_eq!(layer.cut(tight).weights(), &[1.0, 0.0, 2.0], "cut to it");
    }
}
