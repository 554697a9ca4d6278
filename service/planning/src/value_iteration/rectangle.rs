//! The bounding box of what may change (T98 2.5, step v).

/// Columns and rows, first and last, both included; among ringed cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Rectangle {
    pub(super) x: (usize, usize),
    pub(super) y: (usize, usize),
}

impl Rectangle {
    /// All cells within the ring; `None` if there is none.
    pub(super) fn all(width: usize, height: usize) -> Option<Self> {
        (0 < width && 0 < height).then_some(Self { x: (1, width), y: (1, height) })
    }

    /// A cell within the ring and its neighbours.
    pub(super) fn about(x: usize, y: usize) -> Self {
        Self { x: (x, x), y: (y, y) }.grown()
    }

    /// The same with all neighbours.
    pub(super) fn grown(self) -> Self {
        let grown = |(first, last): (usize, usize)| (first.saturating_sub(1), last + 1);
        Self { x: grown(self.x), y: grown(self.y) }
    }

    /// What both have in common.
    pub(super) fn within(self, other: Self) -> Option<Self> {
        let common = |a: (usize, usize), b: (usize, usize)| (a.0.max(b.0), a.1.min(b.1));
        let (x, y) = (common(self.x, other.x), common(self.y, other.y));
        (x.0 <= x.1 && y.0 <= y.1).then_some(Self { x, y })
    }

    /// The smallest that holds both.
    pub(super) fn union(a: Option<Self>, b: Option<Self>) -> Option<Self> {
        let (Some(a), Some(b)) = (a, b) else { return a.or(b) };
        let both = |a: (usize, usize), b: (usize, usize)| (a.0.min(b.0), a.1.max(b.1));
        Some(Self { x: both(a.x, b.x), y: both(a.y, b.y) })
    }
}
