//! Hashing of tiles' places.

use std::hash::{BuildHasherDefault, Hasher};

/// Hashing for maps of tiles.
pub(crate) type TileHashing = BuildHasherDefault<TileHasher>;

/// Multiplies and rotates: tile indices are small numbers that nobody chooses to collide.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct TileHasher(u64);

impl Hasher for TileHasher {
    fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.write_i32(i32::from(byte));
        }
    }

    #[inline]
    fn write_i32(&mut self, number: i32) {
        let mixed = self.0.rotate_left(29) ^ u64::from(number.cast_unsigned());
        self.0 = mixed.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }

    #[inline]
    fn finish(&self) -> u64 {
        self.0 ^ (self.0 >> 32)
    }
}
