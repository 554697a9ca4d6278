//! A `map_server` map brought onto the lattice of a grid, whose cell (0, 0) begins at the map's origin.
//!
//! ```text
//! the cell whose centre is m takes the pixel that holds R(-yaw) (m - origin) / resolution
//! ```
//!
//! The map's `origin` is the pose of the lower-left corner of its lower-left pixel. Where that lies
//! between cells, the whole map moves to the nearest place on the lattice, by half a cell at most.
//! Headings near a multiple of 90 degrees are taken for it, and pixels become cells one to one; at
//! others a cell takes the pixel under its centre, and thin walls may fray. Time O(cells).

use std::f64::consts::{FRAC_PI_2, PI};

use meetpoint_geometry::{Cell, GridFrame, GridInfo};

use super::map_server::{MapServerGrid, cells_from_picture};
use super::picture::{GREY_UNKNOWN, Picture};
use super::yaml::{MapMode, MapYaml};
use crate::grid::GRID_REACH_CELLS;
use crate::raster::Raster;

/// How a map made elsewhere is believed and placed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImportParams {
    /// Log-odds of cells that the map calls occupied, and less this much of free ones; shades lie
    /// between. Dimensionless.
    pub log_odds_max: f32,
    /// Headings so near to a multiple of 90 degrees are taken for it, in radians.
    pub quarter_tolerance_rad: f64,
}

impl ImportParams {
    /// Log-odds of 2 are 88 %: beyond the thresholds with which maps are written, so that what is
    /// exported again is the same; and five scans that contradict outweigh them, for a map that
    /// was made elsewhere may be old. People write 3.14 for half a turn, which is 0.0016 off.
    pub const MAP_SERVER: Self = Self { log_odds_max: 2.0, quarter_tolerance_rad: 0.002 };
}

/// A map on the lattice.
#[derive(Clone, Debug)]
pub struct ImportedMap {
    /// Its cells. Never observed where the map says unknown.
    pub raster: Raster,
    /// How far it was moved onto the lattice, along x and y, in metres; 0 where it lay on it.
    pub shift_m: [f64; 2],
    /// By how much it was turned about its origin, in radians, counter-clockwise, in (-pi, pi].
    pub turn_rad: f64,
    /// For people: what was changed, and what in the files is probably not meant.
    pub warnings: Vec<String>,
}

/// Why a map cannot be brought onto a lattice.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum InvalidImport {
    /// The edge of a pixel is no length.
    #[error("a resolution of {0} m is not a positive length")]
    Resolution(f64),
    /// It lies where no cell is ever drawn.
    #[error("the map lies beyond {reach_m} m from the origin of its frame")]
    Reach {
        /// How far grids go, in metres.
        reach_m: f64,
    },
    /// Every pixel means unknown.
    #[error("all pixels mean unknown")]
    NothingKnown,
}

/// The map of a picture and its YAML, on the lattice of cells of the YAML's resolution.
///
/// Pixels of exactly 205, which savers write for unknown, stay unknown where the thresholds would
/// make them free, and a warning says so: nobody means the inside of walls to be free.
///
/// # Errors
/// [`InvalidImport`] if it has no place there, or says nothing.
pub fn imported(
    picture: &Picture,
    yaml: &MapYaml,
    params: &ImportParams,
) -> Result<ImportedMap, InvalidImport> {
    let frame = GridFrame::new(yaml.resolution_m)
        .map_err(|_| InvalidImport::Resolution(yaml.resolution_m))?;
    let (grid, mut warnings) = cells(picture, yaml);
    if grid.cells.iter().all(|&cell| cell < 0) {
        return Err(InvalidImport::NothingKnown);
    }
    let placement = Placement::new(&grid, yaml, params)?;
    warnings.extend(placement.warnings(yaml, &grid));
    let info = GridInfo {
        frame,
        first: placement.first,
        width: placement.width,
        height: placement.height,
    };
    let mut log_odds = Vec::with_capacity(info.n_cells());
    for row in 0..info.height {
        for column in 0..info.width {
            let cell = placement.pixel_at(column, row, &grid).map_or(-1, |at| grid.cells[at]);
            log_odds.push(believed(cell, params));
        }
    }
    Ok(ImportedMap {
        raster: Raster { info, log_odds },
        shift_m: placement.shift.map(|cells| cells * yaml.resolution_m),
        turn_rad: placement.turn_rad,
        warnings,
    })
}

/// The map's cells, those of exactly 205 unknown, and what to say of it.
fn cells(picture: &Picture, yaml: &MapYaml) -> (MapServerGrid, Vec<String>) {
    let as_read = cells_from_picture(picture, yaml);
    if as_read.warnings.is_empty() || yaml.mode != MapMode::Trinary {
        let warnings = as_read.warnings.clone();
        return (as_read, warnings);
    }
    let opaque = |index: usize| picture.alpha.as_ref().map_or(u8::MAX, |alpha| alpha[index]);
    let is_unknown = |grey: u8| grey == GREY_UNKNOWN;
    let alpha = picture.grey.iter().enumerate();
    let alpha = alpha.map(|(index, &grey)| if is_unknown(grey) { 0 } else { opaque(index) });
    let mended = Picture { alpha: Some(alpha.collect()), ..picture.clone() };
    let n_pixels = picture.grey.iter().filter(|&&grey| is_unknown(grey)).count();
    let warning = format!(
        "{n_pixels} pixels of 205, which savers write for unknown, stay unknown, although by \
         free_thresh {} they would be free",
        yaml.free_thresh
    );
    (cells_from_picture(&mended, yaml), vec![warning])
}

/// Log-odds of a cell of `nav_msgs/OccupancyGrid`; NaN for unknown.
fn believed(cell: i8, params: &ImportParams) -> f32 {
    if cell < 0 {
        return f32::NAN;
    }
    let p = f32::from(cell) / 100.0;
    (p / (1.0 - p)).ln().clamp(-params.log_odds_max, params.log_odds_max)
}

/// Where the cells of a map come to lie, and which pixel each takes.
struct Placement {
    first: Cell,
    width: u32,
    height: u32,
    /// Quarter turns counter-clockwise, 0 to 3; `None` for another heading.
    quarters: Option<u8>,
    turn_rad: f64,
    /// From the map's place to that on the lattice, in cells.
    shift: [f64; 2],
    /// The origin after the shift, in cells.
    origin: [f64; 2],
}

impl Placement {
    fn new(
        grid: &MapServerGrid,
        yaml: &MapYaml,
        params: &ImportParams,
    ) -> Result<Self, InvalidImport> {
        let [x_m, y_m, yaw_rad] = yaml.origin;
        let given = [x_m / yaml.resolution_m, y_m / yaml.resolution_m];
        let size = [f64::from(grid.width), f64::from(grid.height)];
        let reach = f64::from(GRID_REACH_CELLS);
        let beyond = InvalidImport::Reach { reach_m: reach * yaml.resolution_m };
        let is_near = |place: &f64| place.abs() + size[0] + size[1] < reach;
        if !given.iter().all(is_near) {
            return Err(beyond);
        }
        let (quarters, turn_rad) = turn(yaw_rad, params.quarter_tolerance_rad);
        let corners = [[0.0, 0.0], [size[0], 0.0], [0.0, size[1]], size];
        let turned = corners.map(|corner| rotated(corner, turn_rad));
        let low = [0, 1].map(|axis| turned.iter().map(|c| c[axis]).fold(f64::INFINITY, f64::min));
        let high = [0, 1].map(|axis| turned.iter().map(|c| c[axis]).fold(-f64::INFINITY, f64::max));
        // The corner of one pixel comes onto the lattice, and with it, if it can be, all of them.
        let shift = given.map(|place| nothing_if_tiny(place.round() - place));
        let origin = [0, 1].map(|axis| (given[axis] + shift[axis]).round());
        let span = [0, 1].map(|axis| {
            let (from, to) = (origin[axis] + low[axis], origin[axis] + high[axis]);
            // A hair's breadth more is rounding.
            ((from + TINY).floor(), (to - TINY).ceil())
        });
        Ok(Self {
            first: Cell { x: whole(span[0].0), y: whole(span[1].0) },
            width: whole(span[0].1).abs_diff(whole(span[0].0)),
            height: whole(span[1].1).abs_diff(whole(span[1].0)),
            quarters,
            turn_rad,
            shift,
            origin,
        })
    }

    /// The pixel that the cell at a column and row takes, by its place among the map's cells.
    fn pixel_at(&self, column: u32, row: u32, grid: &MapServerGrid) -> Option<usize> {
        let (width, height) = (grid.width, grid.height);
        let (x, y) = match self.quarters {
            Some(0) => (column, row),
            Some(1) => (row, height.wrapping_sub(1 + column)),
            Some(2) => (width.wrapping_sub(1 + column), height.wrapping_sub(1 + row)),
            Some(_) => (width.wrapping_sub(1 + row), column),
            None => self.pixel_under(column, row)?,
        };
        let is_inside = x < width && y < height;
        is_inside.then_some(y as usize * width as usize + x as usize)
    }

    /// The pixel under a cell's centre.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked")]
    fn pixel_under(&self, column: u32, row: u32) -> Option<(u32, u32)> {
        let center = [
            f64::from(self.first.x) + f64::from(column) + 0.5 - self.origin[0],
            f64::from(self.first.y) + f64::from(row) + 0.5 - self.origin[1],
        ];
        let [x, y] = rotated(center, -self.turn_rad);
        let is_number = (0.0..f64::from(u32::MAX)).contains(&x) && 0.0 <= y;
        (is_number && y < f64::from(u32::MAX)).then_some((x as u32, y as u32))
    }

    fn warnings(&self, yaml: &MapYaml, grid: &MapServerGrid) -> Vec<String> {
        let mut warnings = vec![];
        let [x_m, y_m] = self.shift.map(|cells| cells * yaml.resolution_m);
        if self.shift != [0.0, 0.0] {
            warnings.push(format!(
                "the map moves by ({x_m:.4}, {y_m:.4}) m onto the lattice of cells of {} m",
                yaml.resolution_m
            ));
        }
        let yaw_rad = yaml.origin[2];
        let off_rad = angle_between(yaw_rad, self.turn_rad);
        let diagonal_m = f64::from(grid.width).hypot(f64::from(grid.height)) * yaml.resolution_m;
        match self.quarters {
            None => warnings.push(format!(
                "the map is turned by its origin's heading of {yaw_rad} rad: each cell takes the \
                 pixel under its centre, thin walls may fray"
            )),
            Some(quarters) if 0.0 < off_rad => warnings.push(format!(
                "the origin's heading of {yaw_rad} rad is taken as {} degrees, which moves the far \
                 end by {:.3} m",
                90 * u32::from(quarters),
                off_rad * diagonal_m
            )),
            Some(_) => {}
        }
        warnings
    }
}

/// What of a cell is rounding: a map of 100,000 cells a side is placed to a thousandth of it.
const TINY: f64 = 1e-3;

fn nothing_if_tiny(shift: f64) -> f64 {
    if shift.abs() < TINY { 0.0 } else { shift }
}

/// Quarter turns, if the heading is one or near, and the heading that is meant, in (-pi, pi].
fn turn(yaw_rad: f64, tolerance_rad: f64) -> (Option<u8>, f64) {
    for (quarters, turn_rad) in (0_u8..).zip([0.0, FRAC_PI_2, PI, -FRAC_PI_2]) {
        if angle_between(yaw_rad, turn_rad) <= tolerance_rad {
            return (Some(quarters), turn_rad);
        }
    }
    let turn_rad = yaw_rad.rem_euclid(2.0 * PI);
    (None, if PI < turn_rad { turn_rad - 2.0 * PI } else { turn_rad })
}

/// In [0, pi].
fn angle_between(a_rad: f64, b_rad: f64) -> f64 {
    let off_rad = (a_rad - b_rad).rem_euclid(2.0 * PI);
    off_rad.min(2.0 * PI - off_rad)
}

fn rotated([x, y]: [f64; 2], angle_rad: f64) -> [f64; 2] {
    let (sin, cos) = angle_rad.sin_cos();
    [cos * x - sin * y, sin * x + cos * y]
}

#[expect(clippy::cast_possible_truncation, reason = "within the grid's reach")]
fn whole(place: f64) -> i32 {
    place.round() as i32
}

#[cfg(test)]
mod tests {
    use meetpoint_geometry::{Point2, Pose};
    use proptest::prelude::*;

    use super::super::picture::tests::drawn;
    use super::super::{pgm, read_pgm, read_yaml, yaml};
    use super::*;
    use crate::grid::Grid;

    const PARAMS: ImportParams = ImportParams::MAP_SERVER;

    fn described(origin: [f64; 3]) -> MapYaml {
        MapYaml {
            image: "a.pgm".into(),
            mode: MapMode::Trinary,
            resolution_m: 0.05,
            origin,
            negate: false,
            occupied_thresh: 0.65,
            free_thresh: 0.196,
        }
    }

    /// A picture from rows of pixels, top row first: `#` 0, `.` 254, `_` 205.
    fn picture(drawing: &str) -> Picture {
        let rows: Vec<&str> = drawing.lines().map(str::trim).collect();
        let grey = |symbol| match symbol {
            '#' => 0,
            '.' => 254,
            _ => GREY_UNKNOWN,
        };
        let side = |n: usize| u32::try_from(n).expect("small");
        let grey: Vec<u8> = rows.iter().flat_map(|row| row.chars().map(grey)).collect();
        Picture { width: side(rows[0].len()), height: side(rows.len()), grey, alpha: None }
    }

    /// A raster as rows, top row first.
    fn rows(raster: &Raster) -> String {
        let symbol = |&log_odds: &f32| match log_odds {
            odds if odds.is_nan() => '_',
            odds if 0.0 < odds => '#',
            _ => '.',
        };
        let rows = raster.log_odds.chunks(raster.info.width as usize).rev();
        rows.map(|row| row.iter().map(symbol).collect::<String>()).collect::<Vec<_>>().join(" ")
    }

    fn on_lattice(drawing: &str, origin: [f64; 3]) -> ImportedMap {
        imported(&picture(drawing), &described(origin), &PARAMS).expect("a map")
    }

    #[test]
    fn quarter_turns_are_exact() {
        let drawing = "#._\n..#";
        let placed = |yaw_rad| {
            let map = on_lattice(drawing, [1.0, -0.5, yaw_rad]);
            (rows(&map.raster), map.raster.info.first, map.warnings.len())
        };
        let at = |x, y| Cell { x, y };
        assert_eq!(placed(0.0), ("#._ ..#".into(), at(20, -10), 0), "as it is");
        assert_eq!(placed(FRAC_PI_2), ("_# .. #.".into(), at(18, -10), 0), "a quarter");
        assert_eq!(placed(PI), ("#.. _.#".into(), at(17, -12), 0), "a half");
        assert_eq!(placed(-FRAC_PI_2), (".# .. #_".into(), at(20, -13), 0), "three quarters");
        assert_eq!(
            placed(314.0 / 100.0),
            ("#.. _.#".into(), at(17, -12), 1),
            "what people write for pi"
        );
        let map = on_lattice(drawing, [0.0, 0.0, 314.0 / 100.0]);
        assert_eq!((map.turn_rad, map.shift_m), (PI, [0.0, 0.0]), "and told");
        assert!(map.warnings[0].contains("taken as 180 degrees"), "{:?}", map.warnings);
    }

    #[test]
    fn between_cells_moves_to_the_nearest_place() {
        let map = on_lattice("#.", [-12.345, 0.02, 0.0]);
        assert_eq!(map.raster.info.first, Cell { x: -247, y: 0 }, "the nearest");
        let off = [map.shift_m[0] + 0.005, map.shift_m[1] + 0.02];
        assert!(off.iter().all(|off_m: &f64| off_m.abs() < 1e-9), "{:?}", map.shift_m);
        assert!(map.warnings[0].contains("moves by (-0.0050, -0.0200) m"), "{:?}", map.warnings);
        assert_eq!(on_lattice("#.", [-12.35, 0.15, 0.0]).shift_m, [0.0, 0.0], "rounding is none");
    }

    #[test]
    fn unknown_pixels_stay_unknown() {
        let trap = MapYaml { free_thresh: 0.25, ..described([0.0; 3]) };
        let map = imported(&picture("#_."), &trap, &PARAMS).expect("a map");
        assert_eq!(rows(&map.raster), "#_.", "although 0.196 is below 0.25");
        assert_eq!(map.warnings.len(), 1, "{:?}", map.warnings);
        assert!(map.warnings[0].starts_with("1 pixels of 205"), "{:?}", map.warnings);
    }

    #[test]
    fn what_has_no_place_is_refused() {
        let refused = |drawing, origin| imported(&picture(drawing), &described(origin), &PARAMS);
        assert_eq!(refused("__", [0.0; 3]).err(), Some(InvalidImport::NothingKnown), "unknown");
        for far in [1e5, -1e300, f64::INFINITY] {
            let error = refused("#", [far, 0.0, 0.0]).err();
            assert!(matches!(error, Some(InvalidImport::Reach { .. })), "{far} m: {error:?}");
        }
    }

    #[test]
    fn shades_are_odds() {
        let scale = MapYaml { mode: MapMode::Scale, ..described([0.0; 3]) };
        let greys = Picture { grey: vec![254, 150, 0], ..picture("...") };
        let log_odds = imported(&greys, &scale, &PARAMS).expect("a map").raster.log_odds;
        assert_eq!((log_odds[0], log_odds[2]), (-2.0, 2.0), "the bounds");
        let percent = ((1.0 - 150.0 / 255.0 - 0.196) / (0.65 - 0.196) * 100.0_f32).round();
        assert!((log_odds[1] - (percent / (100.0 - percent)).ln()).abs() < 1e-5, "{log_odds:?}");
    }

    #[test]
    fn what_is_exported_is_imported_the_same() {
        let raster = drawn("#_.\n..#");
        let text = read_yaml(&yaml(&raster, "a.pgm")).expect("our own text");
        let picture = read_pgm(&pgm(&raster)).expect("our own bytes");
        let map = imported(&picture, &text, &PARAMS).expect("a map");
        assert_eq!(map.raster.info, raster.info, "the same cells");
        assert_eq!(pgm(&map.raster), pgm(&raster), "the same picture");
        let grid = Grid::from_raster(&map.raster);
        assert_eq!(pgm(&grid.raster(None)), pgm(&raster), "as a grid too");
        assert!(grid.hit_mean(Cell { x: -3, y: 3 }).is_some(), "walls can be matched");
        assert!(grid.hit_mean(Cell { x: -2, y: 2 }).is_none(), "free cells cannot");
    }

    proptest! {
        /// The definition, cell by cell, about the origin as it was moved.
        #[test]
        fn a_cell_takes_the_pixel_under_its_centre(
            pixels in prop::collection::vec(prop::sample::select(vec![0_u8, 205, 254]), 12),
            (x_m, y_m) in (-3.0_f64..3.0, -3.0_f64..3.0),
            yaw_rad in prop_oneof![-7.0_f64..7.0, (-4..5).prop_map(|k| f64::from(k) * FRAC_PI_2)],
        ) {
            let picture = Picture { width: 4, height: 3, grey: pixels, alpha: None };
            let described = described([x_m, y_m, yaw_rad]);
            let Ok(map) = imported(&picture, &described, &PARAMS) else { return Ok(()) };
            let cells = cells_from_picture(&picture, &described).cells;
            let [shift_x_m, shift_y_m] = map.shift_m;
            let origin = Pose::new(x_m + shift_x_m, y_m + shift_y_m, map.turn_rad);
            let info = map.raster.info;
            let mut n_known = 0;
            for (index, log_odds) in (0_i32..).zip(&map.raster.log_odds) {
                let width = i32::try_from(info.width).expect("small");
                let cell = Cell { x: info.first.x + index % width, y: info.first.y + index / width };
                let Point2 { coords, .. } = origin.inverse() * info.frame.center_of(cell);
                let [x, y] = [coords.x, coords.y].map(|place_m| (place_m / 0.05).floor());
                let is_inside = (0.0..4.0).contains(&x) && (0.0..3.0).contains(&y);
                #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "inside")]
                let pixel = if is_inside { cells[y as usize * 4 + x as usize] } else { -1 };
                prop_assert_eq!(believed(pixel, &PARAMS).to_bits(), log_odds.to_bits());
                n_known += usize::from(!log_odds.is_nan());
            }
            if turn(yaw_rad, PARAMS.quarter_tolerance_rad).0.is_some() {
                prop_assert_eq!(n_known, cells.iter().filter(|&&cell| 0 <= cell).count());
            }
        }
    }
}
