//! The rows of an MRCLAM file.

use std::path::Path;

use anyhow::Context;

use super::row::BadRow;
use crate::replay::{
    account::BadLines,
    lines::{self, Line},
    survey::describe,
};

/// Rows of a file that are kept, at most: sixteen hours of odometry at 67 Hz. It bounds memory.
const ROWS_MAX: usize = 4_000_000;

/// What a file held.
pub(super) struct Table<T> {
    /// In the order of the file.
    pub(super) rows: Vec<T>,
    /// Lines read, comments too.
    pub(super) n_lines: u64,
    /// Why it could not be read to its end.
    pub(super) broken_off: Option<String>,
}

/// Reads a file from beginning to end; what it holds goes into `hasher` too. Lines that cannot be used
/// are noted in `bad` and left out.
///
/// # Errors
///
/// If it cannot be opened, or has more rows than [`ROWS_MAX`].
pub(super) fn read<T>(
    path: &Path,
    parse: impl Fn(&[u8]) -> Result<Option<T>, BadRow>,
    hasher: &mut blake3::Hasher,
    bad: &mut BadLines,
) -> anyhow::Result<Table<T>> {
    let name = name(path);
    let mut lines = lines::open(path).with_context(|| format!("cannot read {}", path.display()))?;
    let mut rows = Vec::new();
    let broken_off = loop {
        let read = match lines.next() {
            Ok(Some(Line::Whole(line))) => {
                hasher.update(line).update(b"\n");
                parse(line)
            }
            Ok(Some(Line::TooLong)) => Err(BadRow::TooLong),
            Ok(None) => break None,
            Err(error) => {
                break Some(format!("{name}: {}", describe(&error, lines.number())));
            }
        };
        match read {
            Ok(Some(row)) => rows.push(row),
            Ok(None) => {}
            Err(reason) => bad.note(Some(&name), lines.number(), &reason),
        }
        let number = lines.number();
        anyhow::ensure!(
            rows.len() <= ROWS_MAX,
            "{name}, line {number}: more than {ROWS_MAX} rows are not taken"
        );
    };
    // Where one file ends and the next begins belongs to the content.
    hasher.update(b"\0");
    Ok(Table { rows, n_lines: lines.number(), broken_off })
}

/// What a file is called in its folder.
pub(super) fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::replay::mrclam::row;

    #[test]
    fn bad_lines_are_told_with_file_and_number() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("Robot1_Odometry.dat");
        std::fs::write(&path, "# head\n1 0.1 0\n2 fast 0\n3 0.1 0\n").expect("a free disk");
        let mut bad = BadLines::default();
        let table = read(&path, row::odometry, &mut blake3::Hasher::new(), &mut bad);
        let table = table.expect("it is there");
        assert_eq!((table.rows.len(), table.n_lines), (2, 4), "the good ones");
        assert_eq!(bad.n, 1, "the other");
        let told = &bad.first[0];
        assert_eq!(told.file.as_deref(), Some("Robot1_Odometry.dat"), "which file");
        assert_eq!(told.line, 3, "which line");
        let reason = "the forward velocity is `fast`, not a finite number";
        assert_eq!(told.reason, reason, "what is wrong");
    }
}
