//! From an image and its YAML to cells, exactly as nav2's `map_server` does it.
//!
//! `nav2_map_server/src/map_io.cpp` (main, and jazzy since April 2025), all in 32-bit floats: with
//! `p` the blackness of a pixel (its whiteness if `negate`),
//!
//! ```text
//! trinary   100 if p >= occupied_thresh, then 0 if p <= free_thresh (free wins), else -1
//! scale     the same, and round(100 (p - free_thresh) / (occupied_thresh - free_thresh)) between
//! both      -1 where the alpha channel is below 255
//! raw       the grey itself if it is 0 to 100, else -1
//! ```

use super::picture::{GREY_UNKNOWN, Picture};
use super::yaml::{MapMode, MapYaml};

/// Cells as in `nav_msgs/OccupancyGrid`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MapServerGrid {
    /// Cells along x.
    pub width: u32,
    /// Cells along y.
    pub height: u32,
    /// -1 unknown, 0 free to 100 occupied; row-major along +x, the lowest row first.
    pub cells: Vec<i8>,
    /// For people: what in the files is probably not meant.
    pub warnings: Vec<String>,
}

/// The cells that `map_server` would publish for an image and its YAML.
///
/// The trap of 205: savers write unknown cells as 205, whose `p` is 0.19608, and a `free_thresh`
/// above that reads them all as free. They are read so here too, and a warning says how many.
pub fn cells_from_picture(picture: &Picture, yaml: &MapYaml) -> MapServerGrid {
    let rule = Rule::new(yaml);
    let alpha = |index: usize| picture.alpha.as_ref().map_or(u8::MAX, |alpha| alpha[index]);
    let of_pixel = |index: usize| rule.cell(picture.grey[index], alpha(index));
    let width = picture.width as usize;
    let rows = (0..picture.height as usize).rev();
    let cells = rows.flat_map(|row| (row * width..(row + 1) * width).map(of_pixel)).collect();
    MapServerGrid {
        width: picture.width,
        height: picture.height,
        cells,
        warnings: rule.trap(picture).into_iter().collect(),
    }
}

/// The YAML's numbers as the C++ holds them.
struct Rule {
    mode: MapMode,
    negate: bool,
    occupied_thresh: f32,
    free_thresh: f32,
}

impl Rule {
    #[expect(clippy::cast_possible_truncation, reason = "map_server compares 32-bit floats")]
    fn new(yaml: &MapYaml) -> Self {
        Self {
            mode: yaml.mode,
            negate: yaml.negate,
            occupied_thresh: yaml.occupied_thresh as f32,
            free_thresh: yaml.free_thresh as f32,
        }
    }

    fn p(&self, grey: u8) -> f32 {
        let whiteness = f32::from(grey) / 255.0;
        if self.negate { whiteness } else { 1.0 - whiteness }
    }

    fn cell(&self, grey: u8, alpha: u8) -> i8 {
        if self.mode == MapMode::Raw {
            return i8::try_from(grey).ok().filter(|&cell| cell <= 100).unwrap_or(-1);
        }
        let p = self.p(grey);
        if alpha < u8::MAX {
            -1
        } else if p <= self.free_thresh {
            0
        } else if self.occupied_thresh <= p {
            100
        } else if self.mode == MapMode::Scale {
            self.scaled(p)
        } else {
            -1
        }
    }

    #[expect(clippy::cast_possible_truncation, reason = "between 0 and 100")]
    fn scaled(&self, p: f32) -> i8 {
        let share = (p - self.free_thresh) / (self.occupied_thresh - self.free_thresh);
        (share * 100.0).round() as i8
    }

    /// What to say if unknown cells were read as free.
    fn trap(&self, picture: &Picture) -> Option<String> {
        let is_free = self.mode == MapMode::Trinary && self.cell(GREY_UNKNOWN, u8::MAX) == 0;
        if !is_free || self.negate {
            return None;
        }
        let alpha = |index: usize| picture.alpha.as_ref().map_or(u8::MAX, |alpha| alpha[index]);
        let is_trap =
            |&(index, &grey): &(usize, &u8)| grey == GREY_UNKNOWN && alpha(index) == u8::MAX;
        let n_pixels = picture.grey.iter().enumerate().filter(is_trap).count();
        let free_thresh = self.free_thresh;
        (0 < n_pixels).then(|| {
            format!(
                "{n_pixels} pixels of 205, which savers write for unknown, count as free because \
                 free_thresh is {free_thresh}; 0.196 keeps them unknown"
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::picture::tests::{any_raster, drawn};
    use super::super::{pgm, png, read_pgm, read_png, read_yaml, yaml};
    use super::*;
    use proptest::prelude::*;

    fn map(mode: MapMode, negate: bool, free_thresh: f64) -> MapYaml {
        MapYaml {
            image: "a.pgm".into(),
            mode,
            resolution_m: 0.05,
            origin: [0.0; 3],
            negate,
            occupied_thresh: 0.65,
            free_thresh,
        }
    }

    fn row(grey: &[u8]) -> Picture {
        let width = u32::try_from(grey.len()).expect("short");
        Picture { width, height: 1, grey: grey.to_vec(), alpha: None }
    }

    #[test]
    fn three_modes() {
        let picture = row(&[254, 205, 204, 127, 90, 89, 0]);
        let cells = |mode, negate| cells_from_picture(&picture, &map(mode, negate, 0.196)).cells;
        assert_eq!(cells(MapMode::Trinary, false), [0, -1, -1, -1, -1, 100, 100], "trinary");
        assert_eq!(cells(MapMode::Trinary, true), [100, 100, 100, -1, -1, -1, 0], "negated");
        assert_eq!(cells(MapMode::Scale, false), [0, 0, 1, 67, 99, 100, 100], "scale");
        let raw =
            cells_from_picture(&row(&[0, 100, 101, 127, 128, 255]), &map(MapMode::Raw, true, 0.2));
        assert_eq!(raw.cells, [0, 100, -1, -1, -1, -1], "raw, negate ignored");
    }

    #[test]
    fn free_wins_where_thresholds_overlap() {
        let grid = cells_from_picture(&row(&[80]), &map(MapMode::Trinary, false, 0.9));
        assert_eq!(grid.cells, [0], "0.686 is above 0.65 and below 0.9");
    }

    #[test]
    fn transparent_is_unknown() {
        let picture = Picture { alpha: Some(vec![255, 254]), ..row(&[0, 0]) };
        let cells = cells_from_picture(&picture, &map(MapMode::Trinary, false, 0.196)).cells;
        assert_eq!(cells, [100, -1], "any transparency");
    }

    #[test]
    fn tells_the_trap_of_205() {
        let picture = row(&[254, 205, 205, 0]);
        let grid = cells_from_picture(&picture, &map(MapMode::Trinary, false, 0.25));
        assert_eq!(grid.cells, [0, 0, 0, 100], "read as map_server reads it");
        assert_eq!(
            grid.warnings,
            ["2 pixels of 205, which savers write for unknown, count as free because free_thresh \
              is 0.25; 0.196 keeps them unknown"],
            "and told"
        );
        let grid = cells_from_picture(&picture, &map(MapMode::Trinary, false, 0.196));
        assert_eq!(grid.warnings, Vec::<String>::new(), "nothing to tell");
    }

    #[test]
    fn the_lowest_row_comes_first() {
        let raster = drawn("#__\n..#");
        let map = read_yaml(&yaml(&raster, "a.pgm")).expect("our own text");
        let picture = read_pgm(&pgm(&raster)).expect("our own bytes");
        let grid = cells_from_picture(&picture, &map);
        assert_eq!(grid.cells, [0, 0, 100, 100, -1, -1], "as in nav_msgs");
        let grid = cells_from_picture(&read_png(&png(&raster)).expect("our own bytes"), &map);
        assert_eq!(grid.cells, [0, 0, 100, 100, -1, -1], "the PNG of the same grid");
    }

    proptest! {
        #[test]
        fn writing_and_reading_is_the_savers_rule(raster in any_raster()) {
            let map = read_yaml(&yaml(&raster, "a.pgm")).expect("our own text");
            let picture = read_pgm(&pgm(&raster)).expect("our own bytes");
            let expected: Vec<i8> = raster.percent().iter().map(|&percent| match percent {
                0..=25 => 0,
                65..=100 => 100,
                _ => -1,
            }).collect();
            prop_assert_eq!(cells_from_picture(&picture, &map).cells, expected);
        }
    }
}
