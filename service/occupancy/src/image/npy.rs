//! NumPy's array file, format version 1.0.
//!
//! R. Kern, "A simple file format for NumPy arrays", NumPy Enhancement Proposal 1 (2007): magic,
//! version, length of the header, a Python literal padded with blanks so that the data begins at a
//! multiple of 64 bytes, the data.

use super::picture::probability;
use crate::raster::Raster;

const MAGIC_AND_VERSION: &[u8; 8] = b"\x93NUMPY\x01\x00";
/// Data begins at a multiple of this, so that it can be mapped into memory.
const ALIGNMENT_BYTES: usize = 64;

/// The grid's occupancy probabilities as a NumPy array of `float32`, shape (height, width).
///
/// NaN means never observed. Row 0 is the lowest row of the grid (smallest y), column 0 its
/// leftmost: `array[y, x]`, unlike an image.
pub fn npy(raster: &Raster) -> Vec<u8> {
    let header = header(raster.info.height, raster.info.width);
    let mut bytes = Vec::with_capacity(header.len() + 4 * raster.log_odds.len());
    bytes.extend_from_slice(&header);
    for &log_odds in &raster.log_odds {
        bytes.extend_from_slice(&probability(log_odds).to_le_bytes());
    }
    bytes
}

fn header(n_rows: u32, n_columns: u32) -> Vec<u8> {
    let mut literal =
        format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({n_rows}, {n_columns}), }}");
    let n_before = MAGIC_AND_VERSION.len() + 2;
    let n_total = (n_before + literal.len() + 1).next_multiple_of(ALIGNMENT_BYTES);
    literal.extend(std::iter::repeat_n(' ', n_total - n_before - literal.len() - 1));
    literal.push('\n');
    // The literal is at most some 80 bytes long, whatever the numbers.
    let literal_bytes = u16::try_from(literal.len()).unwrap_or(u16::MAX);
    let mut header = MAGIC_AND_VERSION.to_vec();
    header.extend_from_slice(&literal_bytes.to_le_bytes());
    header.extend_from_slice(literal.as_bytes());
    header
}

#[cfg(test)]
mod tests {
    use super::super::picture::tests::{any_raster, drawn};
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_header_that_numpy_reads() {
        let bytes = npy(&drawn("#_?"));
        assert_eq!(&bytes[..10], b"\x93NUMPY\x01\x00\x76\x00", "magic, version, 118 bytes");
        let text = std::str::from_utf8(&bytes[10..128]).expect("ASCII");
        assert_eq!(
            text.trim_end(),
            "{'descr': '<f4', 'fortran_order': False, 'shape': (1, 3), }",
            "a Python literal"
        );
        assert!(text.ends_with(" \n"), "padded, one line");
    }

    #[test]
    fn lowest_row_first_and_nan_is_unknown() {
        let bytes = npy(&drawn("##\n_?"));
        let cells: Vec<f32> = bytes[128..]
            .chunks_exact(4)
            .map(|four| f32::from_le_bytes(four.try_into().expect("four bytes")))
            .collect();
        assert!(cells[0].is_nan(), "never observed");
        assert_eq!(cells[1], 0.5, "undecided, in the lowest row");
        assert!(0.95 < cells[2], "occupied, in the highest row");
    }

    proptest! {
        #[test]
        fn data_begins_at_a_multiple_of_64(raster in any_raster(), side in any::<u32>()) {
            prop_assert_eq!(header(side, raster.info.width).len() % ALIGNMENT_BYTES, 0);
            let n_data_bytes = 4 * raster.info.n_cells();
            prop_assert_eq!((npy(&raster).len() - n_data_bytes) % ALIGNMENT_BYTES, 0);
        }
    }
}
