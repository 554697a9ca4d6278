//! What a disc covers that moves along a segment: a stadium, row by row.

use meetpoint_geometry::Point2;

/// All points within a radius of a segment, in cells.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stadium {
    /// The ends, the lower one first.
    low: Point2<f64>,
    high: Point2<f64>,
    radius: f64,
    /// From the segment to its right edge, at a right angle and as long as the radius.
    normal: [f64; 2],
    /// Columns a row.
    slope: f64,
    /// Heights of the leftmost and of the rightmost end.
    outermost: [f64; 2],
}

impl Stadium {
    pub(crate) fn new(a: Point2<f64>, b: Point2<f64>, radius: f64) -> Self {
        let (low, high) = if a.y <= b.y { (a, b) } else { (b, a) };
        let along = high - low;
        let length = along.norm();
        let normal = if length < 1e-12 {
            [radius, 0.0]
        } else {
            [along.y, -along.x].map(|side| side / length * radius)
        };
        let slope = if along.y < 1e-12 { 0.0 } else { along.x / along.y };
        let outermost = if low.x <= high.x { [low.y, high.y] } else { [high.y, low.y] };
        Self { low, high, radius, normal, slope, outermost }
    }

    /// The heights between which it lies.
    pub(crate) fn heights(&self) -> [f64; 2] {
        [self.low.y - self.radius, self.high.y + self.radius]
    }

    /// How far left and right it reaches between two heights, which it must not lie above or below.
    #[inline]
    pub(crate) fn reach(&self, [bottom, top]: [f64; 2]) -> [f64; 2] {
        let [left, right] = self.outermost.map(|height| height.max(bottom).min(top));
        [self.edge(-1.0, left), self.edge(1.0, right)]
    }

    /// The left (-1) or right (1) edge at a height.
    #[inline]
    fn edge(&self, side: f64, height: f64) -> f64 {
        let [across, up] = self.normal.map(|normal| side * normal);
        let above = height - (self.low.y + up);
        if above < 0.0 {
            self.low.x + side * self.half_chord(height - self.low.y)
        } else if self.high.y + up < height {
            self.high.x + side * self.half_chord(height - self.high.y)
        } else {
            self.low.x + across + above * self.slope
        }
    }

    fn half_chord(&self, height: f64) -> f64 {
        (self.radius * self.radius - height * height).max(0.0).sqrt()
    }

    /// A column where the segment is nearest to the row from `bottom` up.
    pub(crate) fn nearest_column(&self, bottom: f64) -> f64 {
        let height = (bottom + 0.5).max(self.low.y).min(self.high.y);
        let column = self.low.x + (height - self.low.y) * self.slope;
        column.max(self.low.x.min(self.high.x)).min(self.low.x.max(self.high.x))
    }
}
