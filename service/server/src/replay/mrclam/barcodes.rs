//! Whose a barcode is.

use std::collections::BTreeMap;
use std::path::Path;

use super::{row, row::BadRow, row::BarcodeRow, table};
use crate::replay::account::BadLines;

/// The subjects up to this one are robots, by the data set's rule.
pub(super) const ROBOT_SUBJECT_MAX: u32 = 5;

/// What a barcode belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Subject {
    /// One of the robots.
    Robot,
    /// The landmark of that number.
    Landmark(u32),
}

/// The subjects by their barcodes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Barcodes(BTreeMap<u32, Subject>);

impl Barcodes {
    /// Reads `Barcodes.dat`; what it holds goes into `hasher` too.
    ///
    /// # Errors
    ///
    /// If it cannot be read to its end, or any line of it is bad: a sighting would be taken for one of
    /// something else.
    pub(super) fn read(path: &Path, hasher: &mut blake3::Hasher) -> anyhow::Result<Self> {
        let mut bad = BadLines::default();
        let read = table::read(path, row::barcode, hasher, &mut bad)?;
        if let Some(told) = bad.first.first() {
            anyhow::bail!("{}, line {}: {}", table::name(path), told.line, told.reason);
        }
        if let Some(reason) = read.broken_off {
            anyhow::bail!(reason);
        }
        Self::of(&read.rows).map_err(|reason| anyhow::anyhow!("{}: {reason}", table::name(path)))
    }

    /// What a barcode belongs to; `None` for one that nothing bears.
    pub(super) fn subject(&self, barcode: u32) -> Option<Subject> {
        self.0.get(&barcode).copied()
    }

    fn of(rows: &[BarcodeRow]) -> Result<Self, BadRow> {
        let mut subjects = BTreeMap::new();
        for &BarcodeRow { subject, barcode } in rows {
            let meant = match subject {
                0..=ROBOT_SUBJECT_MAX => Subject::Robot,
                number => Subject::Landmark(number),
            };
            if subjects.insert(barcode, meant).is_some() {
                return Err(BadRow::Twice { column: "barcode", number: barcode });
            }
        }
        Ok(Self(subjects))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Barcodes, String> {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("Barcodes.dat");
        std::fs::write(&path, text).expect("a free disk");
        Barcodes::read(&path, &mut blake3::Hasher::new()).map_err(|error| error.to_string())
    }

    #[test]
    fn robots_and_landmarks_are_told_apart() {
        let barcodes = read("# Subject # Barcode #\n 5 \t 23\n 6 \t 63\n").expect("a good file");
        assert_eq!(barcodes.subject(23), Some(Subject::Robot), "the fifth robot");
        assert_eq!(barcodes.subject(63), Some(Subject::Landmark(6)), "the first landmark");
        assert_eq!(barcodes.subject(43), None, "of nothing");
    }

    #[test]
    fn a_doubtful_file_is_refused() {
        for (text, reason) in [
            ("6 63\n7\n", "Barcodes.dat, line 2: 1 columns, must be 2"),
            ("6 63\n7 63\n", "Barcodes.dat: the barcode 63 stands in a line before"),
        ] {
            assert_eq!(read(text), Err(reason.to_owned()), "{text}");
        }
    }
}
