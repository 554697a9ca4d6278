//! The address of bytes by what they are: BLAKE3.

use std::fmt;

use crate::Error;

/// BLAKE3 of some bytes.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ContentHash(pub [u8; 32]);

impl ContentHash {
    /// The hash of `bytes`.
    pub fn of(bytes: &[u8]) -> Self {
        Self(*blake3::hash(bytes).as_bytes())
    }

    /// Reads a hash from a column.
    ///
    /// # Errors
    /// [`Error::Damaged`] unless it has 32 bytes.
    pub(crate) fn from_column(bytes: &[u8]) -> Result<Self, Error> {
        let hash = bytes.try_into().map_err(|_| {
            Error::Damaged(format!("a content hash has {} bytes instead of 32", bytes.len()))
        })?;
        Ok(Self(hash))
    }
}

impl fmt::Display for ContentHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

impl fmt::Debug for ContentHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "ContentHash({self})")
    }
}
