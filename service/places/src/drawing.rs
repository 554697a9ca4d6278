//! Graph-like environments as drawings.
//!
//! ```text
//! A---B---C       A letter or a digit is a place; - and | are the ways between places, + is a
//! |   |   |       bend in a way (exactly one of the two sides goes on), # a bridge: two ways
//! +---D---+       cross, and nobody can change between them.
//! ```

use std::collections::BTreeMap;

/// Steps on the paper: up, right, down, left. Clockwise, as gateways are.
const SIDES: [(isize, isize); 4] = [(-1, 0), (0, 1), (1, 0), (0, -1)];

/// What is wrong with a drawing. Rows and columns begin with 1.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InvalidDrawing {
    /// There is no place.
    #[error("a drawing without places")]
    Empty,
    /// Two places of one name.
    #[error("two places are called `{0}`")]
    SameName(char),
    /// A place from which no way leads.
    #[error("no way leads from place `{0}`")]
    Alone(char),
    /// A way that neither goes on nor ends at a place.
    #[error("the way from place `{place}` is lost in row {row}, column {column}")]
    Lost {
        /// Where the way begins.
        place: char,
        /// Row of the drawing.
        row: usize,
        /// Column of the drawing.
        column: usize,
    },
}

/// A place as drawn: for each side, up first and clockwise, the place and side where the way from
/// there ends.
pub(crate) struct Drawn {
    pub(crate) name: char,
    pub(crate) ways: [Option<(usize, usize)>; 4],
}

/// The places of a drawing, row by row. Ways are mutual.
pub(crate) fn read(drawing: &str) -> Result<Vec<Drawn>, InvalidDrawing> {
    let paper = Paper::new(drawing)?;
    let mut found = Vec::with_capacity(paper.places.len());
    for (&at, &(place, name)) in &paper.places {
        let mut ways = [None; 4];
        for (side, way) in ways.iter_mut().enumerate() {
            if paper.is_line(moved(at, side), side) {
                *way = Some(paper.followed(at, side)?);
            }
        }
        if ways == [None; 4] {
            return Err(InvalidDrawing::Alone(name));
        }
        debug_assert!(place == found.len(), "places are numbered row by row");
        found.push(Drawn { name, ways });
    }
    for (place, drawn) in found.iter().enumerate() {
        for (side, way) in drawn.ways.iter().enumerate() {
            let Some((to, at)) = *way else { continue };
            if found[to].ways[at] != Some((place, side)) || (to, at) == (place, side) {
                let place = drawn.name;
                let (row, column) = paper.position(to);
                return Err(InvalidDrawing::Lost { place, row, column });
            }
        }
    }
    if found.is_empty() { Err(InvalidDrawing::Empty) } else { Ok(found) }
}

/// Row and column.
type Position = (isize, isize);

fn moved((row, column): Position, side: usize) -> Position {
    (row + SIDES[side].0, column + SIDES[side].1)
}

struct Paper {
    signs: BTreeMap<Position, char>,
    /// Number and name.
    places: BTreeMap<Position, (usize, char)>,
}

impl Paper {
    fn new(drawing: &str) -> Result<Self, InvalidDrawing> {
        let (mut signs, mut places) = (BTreeMap::new(), BTreeMap::new());
        let mut names = BTreeMap::new();
        for (row, line) in (0..).zip(drawing.lines()) {
            for (column, sign) in (0..).zip(line.chars()) {
                signs.insert((row, column), sign);
                if sign.is_alphanumeric() {
                    let place = places.len();
                    places.insert((row, column), (place, sign));
                    if names.insert(sign, place).is_some() {
                        return Err(InvalidDrawing::SameName(sign));
                    }
                }
            }
        }
        Ok(Self { signs, places })
    }

    /// Whether a way is drawn at `at` that one can go on who goes towards `side`.
    fn is_line(&self, at: Position, side: usize) -> bool {
        let line = if side.is_multiple_of(2) { '|' } else { '-' };
        self.signs.get(&at).is_some_and(|&sign| sign == line || sign == '#')
    }

    /// The place and side where the way ends that leaves `from` on that side.
    fn followed(&self, from: Position, side: usize) -> Result<(usize, usize), InvalidDrawing> {
        let (mut at, mut side) = (from, side);
        // Who has passed every sign in every direction goes in circles.
        for _ in 0..4 * self.signs.len() {
            at = moved(at, side);
            if let Some(&(place, _)) = self.places.get(&at) {
                return Ok((place, (side + 2) % 4));
            }
            if self.signs.get(&at) == Some(&'+') {
                let goes_on = |&turned: &usize| self.is_line(moved(at, turned), turned);
                let mut sides = [(side + 1) % 4, (side + 3) % 4].into_iter().filter(goes_on);
                match (sides.next(), sides.next()) {
                    (Some(only), None) => side = only,
                    _ => break,
                }
            } else if !self.is_line(at, side) {
                break;
            }
        }
        let place = self.places[&from].1;
        Err(InvalidDrawing::Lost {
            place,
            row: at.0.unsigned_abs() + 1,
            column: at.1.unsigned_abs() + 1,
        })
    }

    /// Row and column of a place, from 1.
    fn position(&self, place: usize) -> (usize, usize) {
        let found = self.places.iter().find(|(_, numbered)| numbered.0 == place);
        found.map_or((0, 0), |(at, _)| (at.0.unsigned_abs() + 1, at.1.unsigned_abs() + 1))
    }
}
