//! Portable graymap, the image format that `map_server` writes by default.

use super::picture::{GREY_UNKNOWN, InvalidImage, Picture, n_pixels, picture_of};
use crate::raster::Raster;

/// Occupied at and above this percentage: `occupied_thresh` of nav2's saver.
const OCCUPIED_PERCENT_MIN: u8 = 65;
/// Free at and below this percentage: `free_thresh` of nav2's saver.
const FREE_PERCENT_MAX: u8 = 25;
const GREY_FREE: u8 = 254;
const GREY_OCCUPIED: u8 = 0;

/// The grid as nav2's map saver writes it in `trinary` mode: binary PGM, top row first, 254 free,
/// 0 occupied, 205 undecided or never observed. To be read with the thresholds of
/// [`yaml`](super::yaml()).
pub fn pgm(raster: &Raster) -> Vec<u8> {
    let grey: Vec<u8> = raster.percent().into_iter().map(trinary).collect();
    let picture = picture_of(raster, &grey);
    let mut bytes = format!("P5\n{} {}\n255\n", picture.width, picture.height).into_bytes();
    bytes.extend_from_slice(&picture.grey);
    bytes
}

/// The saver's rule on a cell in percent (255: never observed).
fn trinary(percent: u8) -> u8 {
    match percent {
        0..=FREE_PERCENT_MAX => GREY_FREE,
        OCCUPIED_PERCENT_MIN..=100 => GREY_OCCUPIED,
        _ => GREY_UNKNOWN,
    }
}

/// Reads a PGM image, binary (`P5`) or in figures (`P2`), with `#` comments anywhere in its header;
/// other maxima than 255 are scaled to it, 16-bit samples included.
///
/// # Errors
/// [`InvalidImage`] if the bytes are no PGM or end early.
pub fn read_pgm(bytes: &[u8]) -> Result<Picture, InvalidImage> {
    let is_binary = is_binary(bytes)?;
    let mut header = Tokens { bytes, position: 2 };
    let width = header.number("width")?;
    let height = header.number("height")?;
    let value_max = header.number("maximum")?;
    if !(1..=65_535).contains(&value_max) {
        return Err(InvalidImage::Header(format!("maximum {value_max}; allowed are 1 to 65535")));
    }
    let n_expected = n_pixels(width, height)?;
    let values = if is_binary {
        binary_values(header.raster(), value_max, n_expected)
    } else {
        std::iter::from_fn(|| header.number("pixel").ok()).take(n_expected).collect()
    };
    if values.len() < n_expected {
        return Err(InvalidImage::TooShort { n_pixels: values.len(), n_expected });
    }
    let grey = values.into_iter().map(|value| scaled(value, value_max)).collect();
    let side = |n: u64| u32::try_from(n).map_err(|_| InvalidImage::Size { width, height });
    Ok(Picture { width: side(width)?, height: side(height)?, grey, alpha: None })
}

fn is_binary(bytes: &[u8]) -> Result<bool, InvalidImage> {
    match bytes.get(..2) {
        Some(b"P5") => Ok(true),
        Some(b"P2") => Ok(false),
        _ => Err(InvalidImage::NotPgm),
    }
}

/// Width and height that a PGM image promises, without reading it.
pub(super) fn pgm_size(bytes: &[u8]) -> Result<(u64, u64), InvalidImage> {
    is_binary(bytes)?;
    let mut header = Tokens { bytes, position: 2 };
    Ok((header.number("width")?, header.number("height")?))
}

/// Samples of one byte, or of two (the higher first) if the maximum needs them.
fn binary_values(raster: &[u8], value_max: u64, n_expected: usize) -> Vec<u64> {
    if value_max < 256 {
        raster.iter().take(n_expected).map(|&byte| u64::from(byte)).collect()
    } else {
        let pairs = raster.chunks_exact(2).take(n_expected);
        pairs.map(|pair| u64::from(pair[0]) << 8 | u64::from(pair[1])).collect()
    }
}

/// A sample on the scale 0 to 255; beyond the maximum it saturates.
fn scaled(value: u64, value_max: u64) -> u8 {
    let grey = (value.min(value_max) * 255 + value_max / 2) / value_max;
    u8::try_from(grey).unwrap_or(u8::MAX)
}

/// Words of a header, separated by white space and comments.
struct Tokens<'a> {
    bytes: &'a [u8],
    position: usize,
}

impl<'a> Tokens<'a> {
    /// The next number, for the `field` of that name.
    fn number(&mut self, field: &str) -> Result<u64, InvalidImage> {
        self.skip_blanks();
        let rest = &self.bytes[self.position..];
        let n_digits = rest.iter().take_while(|byte| byte.is_ascii_digit()).count();
        self.position += n_digits;
        let digits = std::str::from_utf8(&rest[..n_digits]).unwrap_or_default();
        digits.parse().map_err(|_| InvalidImage::Header(format!("{field} is not a number")))
    }

    /// What follows the header: exactly one byte of white space stands between.
    fn raster(&self) -> &'a [u8] {
        self.bytes.get(self.position + 1..).unwrap_or_default()
    }

    fn skip_blanks(&mut self) {
        while let Some(&byte) = self.bytes.get(self.position) {
            if byte == b'#' {
                let rest = &self.bytes[self.position..];
                self.position += rest.iter().take_while(|&&byte| byte != b'\n').count();
            } else if byte.is_ascii_whitespace() {
                self.position += 1;
            } else {
                break;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::picture::tests::{any_raster, drawn};
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn three_greys_top_row_first() {
        let bytes = pgm(&drawn("##_\n.?."));
        assert_eq!(
            bytes, b"P5\n3 2\n255\n\x00\x00\xcd\xfe\xcd\xfe",
            "occupied 0, free 254, the rest 205"
        );
    }

    #[test]
    fn the_savers_thresholds() {
        let greys = [0, 25, 26, 64, 65, 100, 255].map(trinary);
        assert_eq!(greys, [254, 254, 205, 205, 0, 0, 205], "25 is free, 65 is occupied");
    }

    #[test]
    fn comments_and_figures() {
        let plain = b"P2 # figures\n# CREATOR: somebody 0.050 m/pix\n3\n#\n1 255 0 100\n255\n";
        let picture = read_pgm(plain).expect("a plain graymap");
        assert_eq!((picture.width, picture.height), (3, 1), "size behind comments");
        assert_eq!(picture.grey, [0, 100, 255], "figures");
        let binary = b"P5\n# CREATOR: map_saver.cpp 0.050 m/pix\n2 1\n255\n\n\x07";
        let picture = read_pgm(binary).expect("a binary graymap");
        assert_eq!(picture.grey, [b'\n', 7], "one byte of white space ends the header, not two");
    }

    #[test]
    fn other_maxima_are_scaled() {
        let picture = read_pgm(b"P5 3 1 15\n\x00\x08\x0f").expect("four bits");
        assert_eq!(picture.grey, [0, 136, 255], "eight of fifteen");
        let picture = read_pgm(b"P5 2 1 65535\n\xff\xff\x80\x00").expect("sixteen bits");
        assert_eq!(picture.grey, [255, 128], "the higher byte comes first");
    }

    #[test]
    fn says_what_is_wrong() {
        let message = |bytes: &[u8]| read_pgm(bytes).expect_err("malformed").to_string();
        assert_eq!(
            message(b"P6 1 1 255\n"),
            "neither a PNG image nor a PGM, which begins with `P2` or `P5`",
            "colour"
        );
        assert_eq!(message(b"P5 2 2 255\nabc"), "the image ends after 3 of 4 pixels", "short");
        assert_eq!(
            message(b"P5 2 2 0\nabcd"),
            "malformed image header: maximum 0; allowed are 1 to 65535",
            "no scale"
        );
        assert_eq!(message(b"P5 two"), "malformed image header: width is not a number", "word");
    }

    proptest! {
        #[test]
        fn reads_what_it_wrote(raster in any_raster()) {
            let picture = read_pgm(&pgm(&raster)).expect("our own bytes");
            prop_assert_eq!(picture.width, raster.info.width);
            prop_assert_eq!(picture.height, raster.info.height);
            let grey: Vec<u8> = raster.percent().into_iter().map(trinary).collect();
            prop_assert_eq!(picture, picture_of(&raster, &grey));
        }

        #[test]
        fn no_bytes_make_it_panic(
            mut bytes in prop::collection::vec(any::<u8>(), 0..60),
            is_binary in any::<bool>(),
        ) {
            let _ = read_pgm(&bytes);
            bytes.splice(0..0, if is_binary { *b"P5 3 " } else { *b"P2 3 " });
            let _ = read_pgm(&bytes);
        }
    }
}
