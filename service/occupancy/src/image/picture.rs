//! An 8-bit grey picture, top row first, and how a raster becomes one.

use super::pgm::{pgm_size, read_pgm};
use super::png::{png_size, read_png};
use crate::raster::Raster;

/// Grey of a cell that was never observed, as `map_server` writes it.
pub(super) const GREY_UNKNOWN: u8 = 205;

/// The first bytes of every PNG file.
const PNG_SIGNATURE: [u8; 8] = *b"\x89PNG\r\n\x1a\n";

/// Pixels that a picture read from outside may have: a square kilometre at 0.05 m has 4e8, and
/// nav2 refuses more than 32 767 a side.
const N_PIXELS_MAX: u64 = 1 << 28;

/// Pixels as they stand in an image file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Pixels along a row, at least 1.
    pub width: u32,
    /// Rows, at least 1.
    pub height: u32,
    /// 0 (black) to 255 (white), row-major, the top row first: `width * height` of them.
    pub grey: Vec<u8>,
    /// Opacity, 0 to 255, in the same order; `None` if the file has no alpha channel.
    pub alpha: Option<Vec<u8>>,
}

/// Why bytes are not a picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum InvalidImage {
    /// Neither `P2` nor `P5` stands at the beginning.
    NotPgm,
    /// The header is malformed; what was wrong.
    Header(String),
    /// Fewer pixels than the header promises.
    TooShort {
        /// Pixels that are there.
        n_pixels: usize,
        /// Pixels that the header promises.
        n_expected: usize,
    },
    /// A side is 0, or the picture has more pixels than are taken.
    Size {
        /// Pixels along a row.
        width: u64,
        /// Rows.
        height: u64,
    },
    /// The picture has more pixels than the caller takes.
    TooLarge {
        /// Pixels along a row.
        width: u64,
        /// Rows.
        height: u64,
        /// What is taken.
        n_pixels_max: u64,
    },
    /// The PNG decoder's own words.
    Png(String),
}

impl std::fmt::Display for InvalidImage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NotPgm => {
                write!(f, "neither a PNG image nor a PGM, which begins with `P2` or `P5`")
            }
            Self::Header(reason) => write!(f, "malformed image header: {reason}"),
            Self::TooShort { n_pixels, n_expected } => {
                write!(f, "the image ends after {n_pixels} of {n_expected} pixels")
            }
            Self::Size { width, height } => {
                write!(f, "an image of {width} x {height} pixels; allowed are 1 to {N_PIXELS_MAX}")
            }
            Self::TooLarge { width, height, n_pixels_max } => {
                write!(f, "an image of {width} x {height} pixels; at most {n_pixels_max} are taken")
            }
            Self::Png(reason) => write!(f, "not a readable PNG image: {reason}"),
        }
    }
}

impl std::error::Error for InvalidImage {}

/// Reads a PNG or PGM image, whichever it is, of at most `n_pixels_max` pixels.
///
/// # Errors
/// [`InvalidImage`] if it is neither, ends early, or has more pixels: before memory is asked for.
pub fn read_picture(bytes: &[u8], n_pixels_max: u64) -> Result<Picture, InvalidImage> {
    let is_png = bytes.starts_with(&PNG_SIGNATURE);
    let (width, height) = if is_png { png_size(bytes)? } else { pgm_size(bytes)? };
    match width.checked_mul(height) {
        Some(n_pixels) if n_pixels <= n_pixels_max => {}
        _ => return Err(InvalidImage::TooLarge { width, height, n_pixels_max }),
    }
    if is_png { read_png(bytes) } else { read_pgm(bytes) }
}

/// The number of pixels of a picture from outside, checked before memory is asked for.
pub(super) fn n_pixels(width: u64, height: u64) -> Result<usize, InvalidImage> {
    let n = width.checked_mul(height).filter(|n| (1..=N_PIXELS_MAX).contains(n));
    n.and_then(|n| usize::try_from(n).ok()).ok_or(InvalidImage::Size { width, height })
}

/// Draws a raster, its highest row first. `grey` has one value a cell in the raster's order; cells
/// without one are never observed. An empty raster gives one pixel, never observed: image formats
/// and `map_server` know no empty pictures.
pub(super) fn picture_of(raster: &Raster, grey: &[u8]) -> Picture {
    let (width, height) = (raster.info.width, raster.info.height);
    if width == 0 || height == 0 {
        return Picture { width: 1, height: 1, grey: vec![GREY_UNKNOWN], alpha: None };
    }
    let mut flipped = vec![GREY_UNKNOWN; raster.info.n_cells()];
    let rows = flipped.chunks_exact_mut(width as usize).rev();
    for (to, from) in rows.zip(grey.chunks_exact(width as usize)) {
        to.copy_from_slice(from);
    }
    Picture { width, height, grey: flipped, alpha: None }
}

/// Occupancy probability of a cell's log-odds; NaN (never observed) stays NaN.
pub(super) fn probability(log_odds: f32) -> f32 {
    1.0 / (1.0 + (-log_odds).exp())
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use meetpoint_geometry::{Cell, GridFrame, GridInfo};
    use proptest::prelude::*;

    /// A raster from a drawing, top row first: `#` occupied, `.` free, `?` undecided, else never
    /// observed. Cells of 0.05 m, lower-left corner at (-0.15 m, 0.1 m).
    pub(crate) fn drawn(drawing: &str) -> Raster {
        let rows: Vec<&str> = drawing.lines().map(str::trim).collect();
        let width = rows.iter().map(|row| row.chars().count()).max().unwrap_or(0);
        let log_odds = |symbol| match symbol {
            '#' => 3.0,
            '.' => -3.0,
            '?' => 0.0,
            _ => f32::NAN,
        };
        let cells = rows.iter().rev().flat_map(|row| {
            let padding = std::iter::repeat_n('_', width - row.chars().count());
            row.chars().chain(padding).map(log_odds).collect::<Vec<_>>()
        });
        raster(width, rows.len(), cells.collect())
    }

    /// A raster of the given shape.
    pub(crate) fn raster(width: usize, height: usize, log_odds: Vec<f32>) -> Raster {
        let frame = GridFrame::new(0.05).expect("a length");
        let side = |n: usize| u32::try_from(n).expect("small");
        let first = Cell { x: -3, y: 2 };
        let info = GridInfo { frame, first, width: side(width), height: side(height) };
        Raster { info, log_odds }
    }

    /// Rasters of odd shapes, a fifth of their cells never observed.
    pub(crate) fn any_raster() -> impl Strategy<Value = Raster> {
        let cell = prop_oneof![4 => -12.0_f32..12.0, 1 => Just(f32::NAN)];
        (1_usize..12, 1_usize..12).prop_flat_map(move |(width, height)| {
            prop::collection::vec(cell.clone(), width * height)
                .prop_map(move |log_odds| raster(width, height, log_odds))
        })
    }

    #[test]
    fn the_highest_row_comes_first() {
        let raster = drawn("#.\n.?");
        let picture = picture_of(&raster, &[1, 2, 3, 4]);
        assert_eq!(picture.grey, [3, 4, 1, 2], "the lowest row is last");
    }

    #[test]
    fn nothing_observed_is_one_unknown_pixel() {
        let picture = picture_of(&raster(0, 0, vec![]), &[]);
        assert_eq!((picture.width, picture.height), (1, 1), "image formats know no empty picture");
        assert_eq!(picture.grey, [GREY_UNKNOWN], "never observed");
    }

    #[test]
    fn refuses_absurd_sizes() {
        for (width, height) in [(0, 5), (5, 0), (1 << 20, 1 << 20), (u64::MAX, 2)] {
            assert!(n_pixels(width, height).is_err(), "{width} x {height} pixels");
        }
    }
}
