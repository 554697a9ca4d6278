//! Where a robot went, drawn into its environment as in KB 1988, Figs. 4 and 5.

use meetpoint_geometry::{Cell, Point2};
use meetpoint_sim::Building;

/// Characters an edge of a building's character: walls are drawn finer than they are made.
const FINE: i32 = 4;

/// A building, a robot's trail and the places that it found.
pub(super) struct Trail<'a> {
    building: &'a Building,
    /// Rows from the lowest on.
    rows: Vec<Vec<char>>,
}

impl<'a> Trail<'a> {
    pub(super) fn new(building: &'a Building) -> Self {
        let info = building.info();
        let [width, height] = [info.width, info.height].map(|n| n as usize * FINE as usize);
        let symbol = |x: usize, y: usize| {
            let cell = |at: usize| i32::try_from(at).unwrap_or(0) / FINE;
            if building.is_wall(Cell { x: cell(x), y: cell(y) }) { '#' } else { ' ' }
        };
        let row = |y: usize| (0..width).map(|x| symbol(x, y)).collect();
        Self { building, rows: (0..height).map(row).collect() }
    }

    /// The robot is there.
    pub(super) fn pass(&mut self, at: Point2<f64>) {
        if let Some(symbol) = self.symbol(at).filter(|symbol| **symbol == ' ') {
            *symbol = '.';
        }
    }

    /// It found a place there.
    pub(super) fn mark(&mut self, at: Point2<f64>, index: usize) {
        let names = ('A'..='Z').chain('a'..='z');
        let name = names.clone().nth(index % names.count()).unwrap_or('A');
        if let Some(symbol) = self.symbol(at) {
            *symbol = name;
        }
    }

    /// The drawing, every other row: characters are twice as high as wide.
    pub(super) fn draw(&self) -> String {
        let pairs = self.rows.chunks(2).rev();
        let merged = |pair: &[Vec<char>]| -> String {
            let (below, above) = (&pair[0], pair.last().unwrap_or(&pair[0]));
            let seen = |(&a, &b): (&char, &char)| if a.is_alphabetic() || b == ' ' { a } else { b };
            above.iter().zip(below).map(seen).collect()
        };
        pairs.map(merged).collect::<Vec<_>>().join("\n")
    }

    fn symbol(&mut self, at: Point2<f64>) -> Option<&mut char> {
        let fine_m = self.building.info().frame.resolution_m() / f64::from(FINE);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "robots are within their building"
        )]
        let [x, y] = [at.x, at.y].map(|at_m| (at_m / fine_m) as usize);
        self.rows.get_mut(y)?.get_mut(x)
    }
}
