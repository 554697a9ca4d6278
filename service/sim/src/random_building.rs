//! Random buildings: corridors on a jittered grid, with loops and dead ends.
//!
//! Three to five columns and three or four rows of places stand 9.5 to 23.5 m apart; every place is
//! moved by up to 0.75 m each way, and some places are left out. A random spanning tree of
//! the corridors between neighbours stands, and of the other corridors a share that is drawn once a
//! building; in every third building one corridor goes aslant. What does not hold together, is
//! larger than 90 m, has not 10 to 15 landmarks or no loop that is 60 to 120 m round is thrown away
//! and drawn again.

use meetpoint_geometry::Point2;
use rand::seq::SliceRandom;
use rand::{Rng, RngExt};

use crate::corridors::Corridors;

/// Distance of neighbouring rows and columns, in metres: with the jitter, places are 8 to 25 m
/// apart.
const SPACING_M: std::ops::Range<f64> = 9.5..23.5;
/// A place is moved by up to this much along each axis, in metres.
const JITTER_MAX_M: f64 = 0.75;
/// Share of the grid's places that are left out.
const LEFT_OUT_SHARE: f64 = 0.12;
/// Share of the corridors beyond a spanning tree that are built.
const LOOP_SHARE: std::ops::Range<f64> = 0.35..0.8;
/// Share of buildings with a corridor that goes aslant.
const SLANT_SHARE: f64 = 1.0 / 3.0;
/// Buildings are no longer or wider, in metres: the area of the paper's maps.
const EXTENT_MAX_M: f64 = 90.0;
/// Landmarks of a building.
const N_LANDMARKS: std::ops::RangeInclusive<usize> = 10..=15;
/// Every building has a loop of such a length, in metres round.
const LOOP_LENGTH_M: std::ops::RangeInclusive<f64> = 60.0..=120.0;

/// A random building. The same generator gives the same building.
pub fn random_building(rng: &mut impl Rng) -> Corridors {
    loop {
        // About every other draft will do.
        if let Some(building) = draft(rng).filter(is_fit) {
            return building;
        }
    }
}

fn is_fit(building: &Corridors) -> bool {
    building.is_connected()
        && N_LANDMARKS.contains(&building.landmarks().len())
        && building.loop_lengths_m().iter().any(|length_m| LOOP_LENGTH_M.contains(length_m))
}

/// Places on a grid; `None` where one is left out.
struct Lattice {
    n_columns: usize,
    n_rows: usize,
    /// Row-major.
    indices: Vec<Option<usize>>,
}

fn draft(rng: &mut impl Rng) -> Option<Corridors> {
    let columns_m = offsets_m(rng.random_range(3..=5), rng)?;
    let rows_m = offsets_m(rng.random_range(3..=4), rng)?;
    let mut places = Vec::new();
    let mut indices = Vec::new();
    for &y_m in &rows_m {
        for &x_m in &columns_m {
            let is_there = LEFT_OUT_SHARE < rng.random::<f64>();
            indices.push(is_there.then_some(places.len()));
            if is_there {
                let mut jitter_m = || rng.random_range(-JITTER_MAX_M..JITTER_MAX_M);
                places.push(Point2::new(x_m + jitter_m(), y_m + jitter_m()));
            }
        }
    }
    let lattice = Lattice { n_columns: columns_m.len(), n_rows: rows_m.len(), indices };
    let corridors = lattice.corridors(places.len(), rng);
    Corridors::new(places, corridors).ok()
}

/// Where `n` lines of the grid are, in metres; `None` if they reach too far.
fn offsets_m(n: usize, rng: &mut impl Rng) -> Option<Vec<f64>> {
    let mut offset_m = 0.0;
    let mut offsets_m = vec![offset_m];
    for _ in 1..n {
        offset_m += rng.random_range(SPACING_M);
        offsets_m.push(offset_m);
    }
    (offset_m + 2.0 * JITTER_MAX_M <= EXTENT_MAX_M).then_some(offsets_m)
}

impl Lattice {
    /// The place in this column and row.
    fn place(&self, column: usize, row: usize) -> Option<usize> {
        self.indices[row * self.n_columns + column]
    }

    /// Corridors that are built: a spanning tree, a share of the others, and perhaps a slanting
    /// one.
    fn corridors(&self, n_places: usize, rng: &mut impl Rng) -> Vec<[usize; 2]> {
        let mut candidates = self.neighbouring();
        candidates.shuffle(rng);
        let loop_share = rng.random_range(LOOP_SHARE);
        let mut pieces: Vec<usize> = (0..n_places).collect();
        candidates.retain(|&[a, b]| {
            let joins = pieces[a] != pieces[b];
            let (kept, joined) = (pieces[a], pieces[b]);
            pieces.iter_mut().filter(|piece| **piece == joined).for_each(|piece| *piece = kept);
            joins || rng.random::<f64>() < loop_share
        });
        if rng.random::<f64>() < SLANT_SHARE {
            candidates.extend(self.slanting(rng));
        }
        candidates
    }

    /// All pairs of places that are neighbours along a row or a column.
    fn neighbouring(&self) -> Vec<[usize; 2]> {
        let mut pairs = Vec::new();
        for row in 0..self.n_rows {
            for column in 0..self.n_columns {
                let mut join = |column_2: usize, row_2: usize| {
                    if column_2 < self.n_columns && row_2 < self.n_rows {
                        let ends = self.place(column, row).zip(self.place(column_2, row_2));
                        pairs.extend(ends.map(|(a, b)| [a, b]));
                    }
                };
                join(column + 1, row);
                join(column, row + 1);
            }
        }
        pairs
    }

    /// A corridor across one of the grid's fields, if both its ends are there.
    fn slanting(&self, rng: &mut impl Rng) -> Option<[usize; 2]> {
        let column = rng.random_range(0..self.n_columns - 1);
        let row = rng.random_range(0..self.n_rows - 1);
        let (from, to) = if rng.random() { (row, row + 1) } else { (row + 1, row) };
        Some([self.place(column, from)?, self.place(column + 1, to)?])
    }
}
