//! Rectangles of nodes.

/// Nodes from (x, y) on, `width` by `height`; none where either is not above 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Window {
    pub(crate) x: i32,
    pub(crate) y: i32,
    pub(crate) width: i32,
    pub(crate) height: i32,
}

impl Window {
    pub(crate) const EMPTY: Self = Self { x: 0, y: 0, width: 0, height: 0 };

    pub(crate) fn is_empty(&self) -> bool {
        self.width <= 0 || self.height <= 0
    }

    /// The column after the last.
    pub(crate) fn right(&self) -> i32 {
        self.x + self.width
    }

    /// The row after the last.
    pub(crate) fn top(&self) -> i32 {
        self.y + self.height
    }

    #[expect(clippy::cast_sign_loss, reason = "not negative after max")]
    pub(crate) fn n_cells(&self) -> usize {
        self.width.max(0) as usize * self.height.max(0) as usize
    }

    /// The place of a node in row-major data, or `None` outside.
    #[expect(clippy::cast_sign_loss, reason = "inside, so not negative")]
    pub(crate) fn index_of(&self, x: i32, y: i32) -> Option<usize> {
        let inside = self.x <= x && x < self.right() && self.y <= y && y < self.top();
        inside.then(|| (y - self.y) as usize * self.width as usize + (x - self.x) as usize)
    }

    /// The smallest window that holds both.
    pub(crate) fn union(self, other: Self) -> Self {
        if self.is_empty() {
            return other;
        }
        if other.is_empty() {
            return self;
        }
        let (x, y) = (self.x.min(other.x), self.y.min(other.y));
        let (right, top) = (self.right().max(other.right()), self.top().max(other.top()));
        Self { x, y, width: right - x, height: top - y }
    }

    /// The nodes in both.
    pub(crate) fn intersection(self, other: Self) -> Self {
        let (x, y) = (self.x.max(other.x), self.y.max(other.y));
        let (right, top) = (self.right().min(other.right()), self.top().min(other.top()));
        let common = Self { x, y, width: right - x, height: top - y };
        if common.is_empty() { Self::EMPTY } else { common }
    }

    /// All nodes, row by row.
    pub(crate) fn nodes(self) -> impl Iterator<Item = (i32, i32)> {
        (self.y..self.top()).flat_map(move |y| (self.x..self.right()).map(move |x| (x, y)))
    }
}
