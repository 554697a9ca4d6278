//! Greys as a PNG.

use crate::error::Error;

/// A grey PNG of one byte a pixel, row by row from the highest on.
///
/// # Errors
/// [`Error::Internal`] if there is not one byte a pixel, or none.
pub(crate) fn grey_png([width, height]: [u32; 2], samples: &[u8]) -> Result<Vec<u8>, Error> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Grayscale);
    let written = encoder.write_header().and_then(|mut writer| {
        writer.write_image_data(samples)?;
        writer.finish()
    });
    written.map_err(Error::internal)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_byte_a_pixel() {
        let bytes = grey_png([2, 3], &[0, 50, 100, 150, 200, 250]).expect("six of them");
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().expect("a PNG");
        let mut samples = [0; 6];
        reader.next_frame(&mut samples).expect("its greys");
        assert_eq!(samples, [0, 50, 100, 150, 200, 250], "as they were given");
        assert!(grey_png([2, 3], &[0; 5]).is_err(), "one is missing");
    }
}
