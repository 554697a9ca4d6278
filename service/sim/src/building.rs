//! Buildings drawn as text, or made of an image's cells.

use std::collections::BTreeMap;

use meetpoint_geometry::{Cell, GridFrame, GridInfo, Point2};

use crate::person::Person;

/// Walls and free space of one level, places with names, doors, and people who are there now.
///
/// Its frame has the origin at the lower-left corner of the drawing, x to the right, y up, metres.
#[derive(Clone, Debug)]
pub struct Building {
    info: GridInfo,
    /// Invariant: `info.n_cells()` values, row-major, the lowest row first.
    walls: Vec<bool>,
    places: BTreeMap<char, Point2<f64>>,
    doors: BTreeMap<char, Vec<Cell>>,
    people: Vec<Person>,
}

/// Why a text is not the drawing of a building.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum InvalidBuilding {
    /// Nothing is drawn.
    Empty,
    /// The edge of a character is no length, in metres.
    CharacterSize(f64),
    /// A character that means nothing; line and column from 1.
    Symbol {
        /// The character.
        symbol: char,
        /// Line in the drawing, from 1.
        line: usize,
        /// Column in the line, from 1.
        column: usize,
    },
    /// Two places have this name.
    PlaceTwice(char),
    /// An image has this many cells, and not width times height.
    CellCount(usize),
}

impl std::fmt::Display for InvalidBuilding {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Empty => write!(f, "nothing is drawn"),
            Self::CharacterSize(size_m) => {
                write!(f, "a character of {size_m} m; needed is a finite length above 0")
            }
            Self::Symbol { symbol, line, column } => {
                write!(f, "`{symbol}` in line {line}, column {column} means nothing; ")?;
                write!(f, "known are `#`, `.`, blank, digits and letters")
            }
            Self::PlaceTwice(name) => write!(f, "the place `{name}` is drawn twice"),
            Self::CellCount(n) => write!(f, "{n} cells are not width times height"),
        }
    }
}

impl std::error::Error for InvalidBuilding {}

impl Building {
    /// Reads a drawing, its top line being the highest y: `#` is wall, `.` and blank are free, a
    /// letter is a named place at the middle of a free character, and characters of the same digit
    /// are a door, open at first. Each character is a square of `character_m` metres; short lines go
    /// on free; lines are taken without the indentation that all of them share.
    ///
    /// # Errors
    /// [`InvalidBuilding`] if there is no drawing, no such length, or no such symbol.
    pub fn from_drawing(drawing: &str, character_m: f64) -> Result<Self, InvalidBuilding> {
        let frame =
            GridFrame::new(character_m).map_err(|_| InvalidBuilding::CharacterSize(character_m))?;
        let lines = unindented(drawing);
        let n_columns = lines.iter().map(|line| line.chars().count()).max().unwrap_or(0);
        let side = |n: usize| u32::try_from(n).ok().filter(|&n| 0 < n && i32::try_from(n).is_ok());
        let (Some(width), Some(height)) = (side(n_columns), side(lines.len())) else {
            return Err(InvalidBuilding::Empty);
        };
        let info = GridInfo { frame, first: Cell { x: 0, y: 0 }, width, height };
        let mut building = Self::of_walls(info, vec![false; info.n_cells()]);
        for (index, line) in lines.iter().enumerate() {
            for (column, symbol) in line.chars().enumerate() {
                let cell = Cell { x: signed(column), y: signed(lines.len() - 1 - index) };
                let place = (index + 1, column + 1);
                building.draw(symbol, cell, place)?;
            }
        }
        Ok(building)
    }

    /// A building made of cells of `cell_m` metres, `true` being wall: row-major, the lowest row first,
    /// as many as `width` times the rows that there are.
    ///
    /// # Errors
    /// [`InvalidBuilding`] if there is no cell, no such length, or a row that is not full.
    pub fn from_cells(walls: Vec<bool>, width: u32, cell_m: f64) -> Result<Self, InvalidBuilding> {
        let frame = GridFrame::new(cell_m).map_err(|_| InvalidBuilding::CharacterSize(cell_m))?;
        let side = |n: usize| u32::try_from(n).ok().filter(|&n| 0 < n && i32::try_from(n).is_ok());
        let n_columns = side(width as usize).ok_or(InvalidBuilding::Empty)?;
        let height = side(walls.len() / width as usize).ok_or(InvalidBuilding::Empty)?;
        if !walls.len().is_multiple_of(width as usize) {
            return Err(InvalidBuilding::CellCount(walls.len()));
        }
        let info = GridInfo { frame, first: Cell { x: 0, y: 0 }, width: n_columns, height };
        Ok(Self::of_walls(info, walls))
    }

    /// `walls` as the field of that name.
    fn of_walls(info: GridInfo, walls: Vec<bool>) -> Self {
        Self { info, walls, places: BTreeMap::new(), doors: BTreeMap::new(), people: Vec::new() }
    }

    fn draw(
        &mut self,
        symbol: char,
        cell: Cell,
        (line, column): (usize, usize),
    ) -> Result<(), InvalidBuilding> {
        match symbol {
            '#' => {
                if let Some(index) = self.info.index_of(cell) {
                    self.walls[index] = true;
                }
            }
            '.' | ' ' => {}
            name if name.is_ascii_digit() => self.doors.entry(name).or_default().push(cell),
            name if name.is_alphabetic() => {
                let center = self.info.frame.center_of(cell);
                if self.places.insert(name, center).is_some() {
                    return Err(InvalidBuilding::PlaceTwice(name));
                }
            }
            symbol => return Err(InvalidBuilding::Symbol { symbol, line, column }),
        }
        Ok(())
    }

    /// The drawing's grid: a cell a character.
    pub fn info(&self) -> GridInfo {
        self.info
    }

    /// Where the place of that name is.
    pub fn place(&self, name: char) -> Option<Point2<f64>> {
        self.places.get(&name).copied()
    }

    /// The places named by the letters of `names`, in their order; `None` if one is not there.
    pub fn places(&self, names: &str) -> Option<Vec<Point2<f64>>> {
        names.chars().map(|name| self.place(name)).collect()
    }

    /// Closes the door of that digit, or opens it; false if there is none.
    pub fn set_door(&mut self, name: char, is_closed: bool) -> bool {
        let cells = self.doors.get(&name).map_or(&[][..], Vec::as_slice);
        for &cell in cells {
            if let Some(index) = self.info.index_of(cell) {
                self.walls[index] = is_closed;
            }
        }
        !cells.is_empty()
    }

    /// The cells of the door of that digit; none if there is no such door.
    pub fn door(&self, name: char) -> &[Cell] {
        self.doors.get(&name).map_or(&[], Vec::as_slice)
    }

    /// Who is there now: sensors see them, [`Building::is_free`] does not.
    pub fn people(&self) -> &[Person] {
        &self.people
    }

    /// Puts people where they are now, instead of those who were there.
    pub fn set_people(&mut self, people: Vec<Person>) {
        self.people = people;
    }

    /// True if a cell is wall or a closed door; what lies outside the drawing is none.
    pub fn is_wall(&self, cell: Cell) -> bool {
        self.info.index_of(cell).is_some_and(|index| self.walls[index])
    }

    /// Distance from a point to the nearest wall or edge of the drawing, in metres, no more than
    /// `limit_m`; 0 within walls and outside.
    pub fn clearance_m(&self, point: Point2<f64>, limit_m: f64) -> f64 {
        let frame = self.info.frame;
        let low = frame.cell_at(Point2::new(point.x - limit_m, point.y - limit_m));
        let high = frame.cell_at(Point2::new(point.x + limit_m, point.y + limit_m));
        let mut clearance_m = self.inside_by_m(point).clamp(0.0, limit_m);
        for y in low.y.max(0)..=high.y.min(signed(self.info.height as usize)) {
            for x in low.x.max(0)..=high.x.min(signed(self.info.width as usize)) {
                let cell = Cell { x, y };
                if self.is_wall(cell) {
                    clearance_m = clearance_m.min(self.distance_m(point, cell));
                }
            }
        }
        clearance_m
    }

    /// True if a disc of that radius around the point touches no wall and lies within the drawing.
    pub fn is_free(&self, point: Point2<f64>, radius_m: f64) -> bool {
        self.is_inside(point) && radius_m <= self.clearance_m(point, radius_m)
    }

    fn is_inside(&self, point: Point2<f64>) -> bool {
        self.info.index_of(self.info.frame.cell_at(point)).is_some_and(|index| !self.walls[index])
    }

    /// Distance to the nearest edge of the drawing, in metres; negative outside.
    fn inside_by_m(&self, point: Point2<f64>) -> f64 {
        let far = self.info.frame.corner_of(Cell {
            x: signed(self.info.width as usize),
            y: signed(self.info.height as usize),
        });
        point.x.min(point.y).min(far.x - point.x).min(far.y - point.y)
    }

    /// Distance from a point to the square of a cell, in metres; 0 within.
    fn distance_m(&self, point: Point2<f64>, cell: Cell) -> f64 {
        let low = self.info.frame.corner_of(cell);
        let high = self.info.frame.corner_of(Cell { x: cell.x + 1, y: cell.y + 1 });
        let beyond = |at: f64, low: f64, high: f64| (low - at).max(at - high).max(0.0);
        beyond(point.x, low.x, high.x).hypot(beyond(point.y, low.y, high.y))
    }
}

/// A count as a cell's index; drawings are checked to stay below 2³¹ characters a side.
fn signed(n: usize) -> i32 {
    i32::try_from(n).unwrap_or(i32::MAX)
}

/// The lines of a drawing without blank lines around it and without common indentation.
fn unindented(drawing: &str) -> Vec<&str> {
    let is_blank = |line: &&str| line.trim().is_empty();
    let lines: Vec<&str> = drawing.lines().map(str::trim_end).skip_while(is_blank).collect();
    let n_lines = lines.len() - lines.iter().rev().take_while(|line| is_blank(line)).count();
    let n_blanks = |line: &&str| line.len() - line.trim_start_matches(' ').len();
    let drawn = lines[..n_lines].iter();
    let indent = drawn.clone().filter(|line| !line.is_empty()).map(n_blanks).min().unwrap_or(0);
    drawn.map(|line| line.get(indent..).unwrap_or_default()).collect()
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use proptest::prelude::*;

    const ROOM: &str = "
        ######
        #A..B#
        #..###
        ######";

    #[test]
    fn a_room_with_two_places() {
        let room = Building::from_drawing(ROOM, 0.5).expect("a drawing");
        assert_eq!((room.info().width, room.info().height), (6, 4), "indentation is dropped");
        assert_eq!(room.place('A'), Some(Point2::new(0.75, 1.25)), "the middle of its character");
        assert_eq!(room.places("BA").map(|places| places.len()), Some(2), "in order");
        assert_eq!(room.places("AX"), None, "no such place");
        assert!(room.is_wall(Cell { x: 3, y: 1 }), "third line from above is y = 1");
        assert!(!room.is_wall(Cell { x: 2, y: 1 }), "free");
    }

    #[test]
    fn discs_keep_off_walls_and_edges() {
        let room = Building::from_drawing(ROOM, 0.5).expect("a drawing");
        let a = Point2::new(0.75, 1.25);
        assert_eq!(room.clearance_m(a, 2.0), 0.25, "to the wall on the left");
        assert!(room.is_free(a, 0.25), "touching is free");
        assert!(!room.is_free(a, 0.26), "no more");
        assert!(!room.is_free(Point2::new(0.25, 0.25), 0.0), "in a wall");
        assert!(!room.is_free(Point2::new(-1.0, 0.25), 0.0), "outside");
        let field = Building::from_drawing("...", 1.0).expect("a drawing");
        assert_eq!(field.clearance_m(Point2::new(1.5, 0.25), 9.0), 0.25, "the edge counts");
    }

    #[test]
    fn doors_open_and_close() {
        let mut rooms = Building::from_drawing("#####\n#A1B#\n#####", 1.0).expect("a drawing");
        let a = rooms.place('A').expect("a place");
        let range_m = |rooms: &Building| rooms.range_m(a, 0.0, 9.0).expect("a wall");
        assert_eq!(range_m(&rooms), 2.5, "open: through to the far wall");
        assert!(rooms.set_door('1', true), "there is such a door");
        assert_eq!(range_m(&rooms), 0.5, "closed");
        assert_eq!(rooms.door('1'), [Cell { x: 2, y: 1 }], "one cell");
        assert!(rooms.set_door('1', false), "opened again");
        assert_eq!(range_m(&rooms), 2.5, "as before");
        assert!(!rooms.set_door('2', true), "no such door");
    }

    #[test]
    fn made_of_cells() {
        let walls = vec![true, true, true, false, true, false];
        let building = Building::from_cells(walls.clone(), 3, 0.5).expect("two rows of three");
        assert!(building.is_wall(Cell { x: 2, y: 0 }), "the lowest row is the first");
        assert!(!building.is_wall(Cell { x: 2, y: 1 }), "and the next above it");
        let wrong = |width, cell_m| Building::from_cells(walls.clone(), width, cell_m).err();
        assert_eq!(wrong(4, 0.5), Some(InvalidBuilding::CellCount(6)), "a row that is not full");
        assert_eq!(wrong(0, 0.5), Some(InvalidBuilding::Empty), "no column");
        assert_eq!(wrong(3, -1.0), Some(InvalidBuilding::CharacterSize(-1.0)), "no length");
    }

    #[test]
    fn says_what_is_wrong() {
        let message = |drawing: &str, character_m: f64| {
            Building::from_drawing(drawing, character_m).expect_err("no building").to_string()
        };
        assert_eq!(message(" \n\n", 1.0), "nothing is drawn", "blank");
        assert_eq!(
            message("#", 0.0),
            "a character of 0 m; needed is a finite length above 0",
            "no length"
        );
        assert_eq!(
            message("##\n#?", 1.0),
            "`?` in line 2, column 2 means nothing; known are `#`, `.`, blank, digits and letters",
            "symbol"
        );
        assert_eq!(message("A.A", 1.0), "the place `A` is drawn twice", "twice");
    }

    /// Buildings of up to 12 by 12 characters of 0.5 m, a quarter of them wall.
    pub(crate) fn any_building() -> impl Strategy<Value = Building> {
        prop::collection::vec("[# ..]{1,12}", 1..12).prop_filter_map("blank", |lines| {
            Building::from_drawing(&format!("#\n{}", lines.join("\n")), 0.5).ok()
        })
    }

    proptest! {
        #[test]
        fn a_free_disc_has_no_wall_in_it(
            building in any_building(),
            (x_m, y_m) in (0.0_f64..6.0, 0.0_f64..6.0),
            radius_m in 0.0_f64..1.0,
        ) {
            let center = Point2::new(x_m, y_m);
            let is_free = building.is_free(center, radius_m);
            let clearance_m = building.clearance_m(center, 1.0);
            prop_assert_eq!(is_free, building.is_inside(center) && radius_m <= clearance_m);
            // The definition, sampled: every point of the disc is free and inside.
            let directions = (0_u16..32).map(|i| f64::from(i) * std::f64::consts::TAU / 32.0);
            let radii = [0.0, 0.3, 0.6, 0.9, 0.999].map(|share| share * radius_m);
            let is_free_everywhere = directions
                .flat_map(|angle| radii.map(|r| (r * angle.cos(), r * angle.sin())))
                .all(|(dx, dy)| building.is_inside(Point2::new(x_m + dx, y_m + dy)));
            prop_assert!(!is_free || is_free_everywhere);
        }
    }
}
