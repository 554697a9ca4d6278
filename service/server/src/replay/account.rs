//! What a person wants to know of a recording, whatever its format.

use std::collections::BTreeMap;

/// Bad lines that are repeated word for word.
const BAD_LINES_SHOWN: usize = 10;

/// What a recording consists of: the observations that map it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Reading {
    /// Sweeps of a laser.
    Scan,
    /// Landmarks seen.
    Sighting,
}

impl Reading {
    /// One of them.
    pub(crate) fn singular(self) -> &'static str {
        match self {
            Self::Scan => "scan",
            Self::Sighting => "sighting",
        }
    }

    /// What a recording lacks that has none.
    pub(crate) fn nothing(self) -> &'static str {
        match self {
            Self::Scan => "laser scan",
            Self::Sighting => "sighting of a landmark",
        }
    }

    /// Several of them.
    pub(crate) fn plural(self) -> &'static str {
        match self {
            Self::Scan => "scans",
            Self::Sighting => "sightings",
        }
    }
}

/// What was found in a recording.
#[derive(Clone, Debug)]
pub(crate) struct Account {
    /// Of the decompressed content and of how it is read.
    pub(crate) content_hash: blake3::Hash,
    /// What the recording consists of.
    pub(crate) reading: Reading,
    /// Stamps of the readings that can be sent.
    pub(crate) stamps_ns: Vec<i64>,
    /// Lines read.
    pub(crate) n_lines: u64,
    /// Lines that are not sent, by why.
    pub(crate) skipped: BTreeMap<String, u64>,
    /// Lines that could not be used.
    pub(crate) bad: BadLines,
    /// Why a file could not be read to its end.
    pub(crate) broken_off: Option<String>,
}

impl Account {
    /// Smallest and largest stamp of the readings. `None` if there are none.
    pub(crate) fn stamps_span_ns(&self) -> Option<(i64, i64)> {
        Some((*self.stamps_ns.iter().min()?, *self.stamps_ns.iter().max()?))
    }
}

/// Lines that do not keep their form.
#[derive(Clone, Debug, Default)]
pub(crate) struct BadLines {
    /// How many.
    pub(crate) n: u64,
    /// The first of them.
    pub(crate) first: Vec<BadLine>,
}

/// A line that does not keep its form.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct BadLine {
    /// The file of a recording that has several.
    pub(crate) file: Option<String>,
    /// From 1.
    pub(crate) line: u64,
    /// What is wrong with it.
    pub(crate) reason: String,
}

impl BadLines {
    /// Counts a line.
    pub(crate) fn note(&mut self, file: Option<&str>, line: u64, reason: &dyn ToString) {
        self.n += 1;
        if self.first.len() < BAD_LINES_SHOWN {
            let (file, reason) = (file.map(str::to_owned), reason.to_string());
            self.first.push(BadLine { file, line, reason });
        }
    }
}
