//! A table of probabilities over places as a picture: white where it is none, black where it is most,
//! as in Figs. 3 and 14 of Thrun, Burgard and Fox, Machine Learning 31 (1998).

use super::grey_png::grey_png;
use crate::error::Error;

/// Pixels that the longer side of a small table is enlarged to, at most.
const N_PIXELS_WANTED: usize = 600;
/// Pixels a place, at most.
const SCALE_MAX: usize = 12;

/// Probabilities of places, row-major from the lowest row on.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Table {
    pub(crate) width: usize,
    pub(crate) values: Vec<f32>,
}

/// The table as a grey PNG, the highest row first. Greys go by the root, so that what is little
/// probable shows too.
///
/// # Errors
/// [`Error::Internal`] if it cannot be written.
pub(crate) fn png(table: &Table) -> Result<Vec<u8>, Error> {
    let width = table.width.max(1);
    let height = (table.values.len() / width).max(1);
    let scale = (N_PIXELS_WANTED / width.max(height)).clamp(1, SCALE_MAX);
    let most = table.values.iter().copied().fold(0.0, f32::max);
    let mut samples = Vec::with_capacity(width * height * scale * scale);
    for row in (0..height).rev() {
        let greys = (0..width).map(|column| {
            let value = table.values.get(row * width + column).copied().unwrap_or(0.0);
            grey(value, most)
        });
        let line: Vec<u8> = greys.flat_map(|grey| std::iter::repeat_n(grey, scale)).collect();
        for _ in 0..scale {
            samples.extend_from_slice(&line);
        }
    }
    let n_pixels = |n: usize| u32::try_from(n * scale).map_err(Error::internal);
    grey_png([n_pixels(width)?, n_pixels(height)?], &samples)
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 255")]
fn grey(value: f32, most: f32) -> u8 {
    let share = if 0.0 < most { (value / most).clamp(0.0, 1.0) } else { 0.0 };
    (255.0 * (1.0 - share.sqrt())).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_most_probable_is_black() {
        assert_eq!(
            [grey(0.0, 0.5), grey(0.125, 0.5), grey(0.5, 0.5)],
            [255, 128, 0],
            "by the root"
        );
        assert_eq!(grey(0.0, 0.0), 255, "nothing is probable");
        for table in [Table { width: 2, values: vec![0.1; 6] }, Table { width: 0, values: vec![] }]
        {
            assert!(png(&table).expect("a picture").starts_with(b"\x89PNG"), "a PNG");
        }
    }
}
