//! Bytes and varints, taken one after the other.

use super::InvalidPlanTables;

/// Bytes that are left to be read.
pub(super) struct Left<'a>(pub(super) &'a [u8]);

impl<'a> Left<'a> {
    pub(super) fn take(&mut self, n: usize) -> Result<&'a [u8], InvalidPlanTables> {
        let (taken, left) = self.0.split_at_checked(n).ok_or(InvalidPlanTables::Truncated)?;
        self.0 = left;
        Ok(taken)
    }

    pub(super) fn unsigned(&mut self) -> Result<u64, InvalidPlanTables> {
        let mut value = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.take(1)?[0];
            value |= u64::from(byte & 0x7f) << shift;
            if byte & 0x80 == 0 {
                return Ok(value);
            }
        }
        Err(InvalidPlanTables::Damaged("a number"))
    }

    pub(super) fn signed(&mut self) -> Result<i64, InvalidPlanTables> {
        let value = self.unsigned()?;
        Ok((value >> 1).cast_signed() ^ -((value & 1).cast_signed()))
    }
}
