//! PNG images: the grid in shades of grey, and what `map_server` reads of one.

use super::picture::{GREY_UNKNOWN, InvalidImage, Picture, n_pixels, picture_of, probability};
use crate::raster::Raster;

/// Grey of a cell that is surely free. 255 is left out, as by `map_server`.
const GREY_FREE: f32 = 254.0;

/// The grid as an 8-bit grey PNG, top row first: `round(254 * (1 - p))` for a cell of occupancy
/// probability `p`, 205 for one never observed. An observed cell is never exactly 205 (it moves to
/// the next value on its own side), so the two stay apart.
///
/// # Panics
/// Only for a side of 2³¹ cells and more, which PNG cannot hold.
pub fn png(raster: &Raster) -> Vec<u8> {
    let grey: Vec<u8> = raster.log_odds.iter().map(|&log_odds| graded(log_odds)).collect();
    let picture = picture_of(raster, &grey);
    let mut bytes = Vec::new();
    encode(&picture, &mut bytes).expect("writing into memory fails only beyond PNG's own limits");
    bytes
}

fn encode(picture: &Picture, bytes: &mut Vec<u8>) -> Result<(), ::png::EncodingError> {
    let mut encoder = ::png::Encoder::new(bytes, picture.width, picture.height);
    encoder.set_color(::png::ColorType::Grayscale);
    encoder.set_depth(::png::BitDepth::Eight);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&picture.grey)?;
    writer.finish()
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "rounded and within 0..=254"
)]
fn graded(log_odds: f32) -> u8 {
    let grey = GREY_FREE * (1.0 - probability(log_odds));
    match grey.round() as u8 {
        _ if grey.is_nan() => GREY_UNKNOWN,
        GREY_UNKNOWN if grey < f32::from(GREY_UNKNOWN) => GREY_UNKNOWN - 1,
        GREY_UNKNOWN => GREY_UNKNOWN + 1,
        other => other,
    }
}

/// Reads a PNG image of any colour type. Colours become grey by Rec. 601 luma, as the library does
/// that `map_server` uses; samples of more than 8 bits lose their lower ones.
///
/// # Errors
/// [`InvalidImage`] if the bytes are no PNG or end early.
pub fn read_png(bytes: &[u8]) -> Result<Picture, InvalidImage> {
    let refused = |error: ::png::DecodingError| InvalidImage::Png(error.to_string());
    let mut decoder = ::png::Decoder::new(std::io::Cursor::new(bytes));
    decoder.set_transformations(::png::Transformations::normalize_to_color8());
    let mut reader = decoder.read_info().map_err(refused)?;
    let (width, height) = reader.info().size();
    let n_expected = n_pixels(u64::from(width), u64::from(height))?;
    let n_bytes = reader.output_buffer_size().unwrap_or(4 * n_expected);
    let mut samples = vec![0; n_bytes];
    let frame = reader.next_frame(&mut samples).map_err(refused)?;
    let color = frame.color_type;
    let n_channels = color.samples();
    let pixels = || samples.chunks_exact(n_channels).take(n_expected);
    let has_alpha = matches!(color, ::png::ColorType::GrayscaleAlpha | ::png::ColorType::Rgba);
    Ok(Picture {
        width,
        height,
        grey: pixels().map(luma).collect(),
        alpha: has_alpha.then(|| pixels().map(|pixel| pixel[n_channels - 1]).collect()),
    })
}

/// Width and height that a PNG image promises, without decoding it.
pub(super) fn png_size(bytes: &[u8]) -> Result<(u64, u64), InvalidImage> {
    let decoder = ::png::Decoder::new(std::io::Cursor::new(bytes));
    let reader = decoder.read_info().map_err(|error| InvalidImage::Png(error.to_string()))?;
    let (width, height) = reader.info().size();
    Ok((u64::from(width), u64::from(height)))
}

/// Grey of a pixel with 1 (grey), 2 (and alpha), 3 (colour) or 4 (and alpha) samples.
fn luma(pixel: &[u8]) -> u8 {
    match *pixel {
        [red, green, blue, ..] => {
            let [red, green, blue] = [red, green, blue].map(u32::from);
            let grey = (299 * red + 587 * green + 114 * blue + 500) / 1000;
            u8::try_from(grey).unwrap_or(u8::MAX)
        }
        [grey, ..] => grey,
        [] => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::super::picture::tests::{any_raster, drawn, raster};
    use super::*;
    use proptest::prelude::*;

    fn encoded(color: ::png::ColorType, size: (u32, u32), samples: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = ::png::Encoder::new(&mut bytes, size.0, size.1);
        encoder.set_color(color);
        let mut writer = encoder.write_header().expect("a header");
        writer.write_image_data(samples).expect("as many samples as pixels need");
        writer.finish().expect("an end");
        bytes
    }

    #[test]
    fn shades_of_grey() {
        let picture = read_png(&png(&drawn("#._?"))).expect("our own bytes");
        assert_eq!(picture.grey, [12, 242, 205, 127], "dark is occupied");
        assert_eq!(picture.alpha, None, "no alpha");
    }

    #[test]
    fn an_observed_cell_is_never_205() {
        for thousandth in -3000_i16..3000 {
            let log_odds = f32::from(thousandth) / 1000.0;
            assert_ne!(graded(log_odds), GREY_UNKNOWN, "log-odds {log_odds}");
        }
        assert_eq!(graded(f32::NAN), GREY_UNKNOWN, "never observed");
        assert_eq!(graded(f32::INFINITY), 0, "surely occupied");
        assert_eq!(graded(f32::NEG_INFINITY), 254, "surely free");
    }

    #[test]
    fn colours_and_alpha() {
        let bytes = encoded(::png::ColorType::Rgba, (2, 1), &[255, 0, 0, 255, 9, 9, 9, 0]);
        let picture = read_png(&bytes).expect("a PNG");
        assert_eq!(picture.grey, [76, 9], "Rec. 601: 0.299 of red");
        assert_eq!(picture.alpha, Some(vec![255, 0]), "alpha is kept");
        let bytes = encoded(::png::ColorType::GrayscaleAlpha, (1, 2), &[7, 255, 8, 1]);
        let picture = read_png(&bytes).expect("a PNG");
        assert_eq!(picture.grey, [7, 8], "grey");
        assert_eq!(picture.alpha, Some(vec![255, 1]), "alpha of grey");
    }

    #[test]
    fn nothing_observed_is_still_an_image() {
        let picture = read_png(&png(&raster(0, 7, vec![]))).expect("our own bytes");
        assert_eq!(picture.grey, [GREY_UNKNOWN], "one pixel");
    }

    proptest! {
        #[test]
        fn reads_what_it_wrote(raster in any_raster()) {
            let grey: Vec<u8> = raster.log_odds.iter().map(|&odds| graded(odds)).collect();
            let picture = read_png(&png(&raster)).expect("our own bytes");
            prop_assert_eq!(picture, picture_of(&raster, &grey));
        }

        #[test]
        fn no_bytes_make_it_panic(
            raster in any_raster(),
            change in (any::<prop::sample::Index>(), any::<u8>()),
        ) {
            let mut bytes = png(&raster);
            let index = change.0.index(bytes.len());
            bytes[index] = change.1;
            let _ = read_png(&bytes);
            let _ = read_png(&bytes[..index]);
        }
    }
}
