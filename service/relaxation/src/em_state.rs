//! Expectation maximisation put down and taken up again, bit for bit: the map and the iteration
//! that it came from are all that the next one asks for.
//!
//! ```text
//! u8  format, 1
//! u32 iteration; 0: none done
//! u8  flags: 1 there is a log-likelihood, 2 a change
//! f64 log-likelihood, f64 change, u64 cells, u64 products, u64 bytes
//! u32 kinds, then for each: u8 0 type or 1 identity, u32 number
//! u8  1 if there is a map, then for each kind and node: f32 probability
//! ```
//!
//! Numbers are little-endian. Travel and parameters are not in it and have to be the same.

use crate::em::{Em, EmParams, Figures, grid_of};
use crate::landmark::{Kinds, LandmarkKind};
use crate::landmark_map::LandmarkMap;
use crate::level::Level;
use crate::travel::Travel;

const FORMAT: u8 = 1;

/// Bytes that no [`Em::to_bytes`] of the same travel and parameters has written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InvalidState;

impl std::fmt::Display for InvalidState {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "saved state does not belong to this travel and these parameters")
    }
}

impl std::error::Error for InvalidState {}

impl<'a> Em<'a> {
    /// All that the next iteration needs besides travel and parameters.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = vec![FORMAT];
        bytes.extend(self.n_iterations().to_le_bytes());
        let log_likelihood = self.figures.and_then(|figures| figures.log_likelihood);
        let change = self.figures.and_then(|figures| figures.change);
        bytes.push(u8::from(log_likelihood.is_some()) | u8::from(change.is_some()) << 1);
        bytes.extend(log_likelihood.unwrap_or(0.0).to_le_bytes());
        bytes.extend(change.unwrap_or(0.0).to_le_bytes());
        bytes.extend(self.figures.map_or(0, |figures| figures.n_cells as u64).to_le_bytes());
        bytes.extend(self.figures.map_or(0, |figures| figures.n_products as u64).to_le_bytes());
        bytes.extend(self.figures.map_or(0, |figures| figures.n_bytes as u64).to_le_bytes());
        let kinds = self.kinds.as_slice();
        bytes.extend(u32::try_from(kinds.len()).unwrap_or(u32::MAX).to_le_bytes());
        for kind in kinds {
            let (tag, number) = match *kind {
                LandmarkKind::Type(number) => (0, number),
                LandmarkKind::Identity(number) => (1, number),
            };
            bytes.push(tag);
            bytes.extend(number.to_le_bytes());
        }
        bytes.push(u8::from(self.map.is_some()));
        if let Some(map) = &self.map {
            for kind in 0..kinds.len() {
                bytes
                    .extend(map.layer(kind).weights().iter().flat_map(|value| value.to_le_bytes()));
            }
        }
        bytes
    }

    /// Taken up where [`Self::to_bytes`] put it down.
    ///
    /// # Errors
    /// [`InvalidState`] if the bytes are of another travel, other parameters, or damaged.
    pub fn from_bytes(
        travel: &'a Travel,
        params: EmParams,
        mut bytes: &[u8],
    ) -> Result<Self, InvalidState> {
        let bytes = &mut bytes;
        if u8::from_le_bytes(take(bytes)?) != FORMAT {
            return Err(InvalidState);
        }
        let figures = figures(bytes)?;
        let kinds = kinds(bytes)?;
        let needed = Kinds::new(travel, &[]);
        if !needed.as_slice().iter().all(|&kind| kinds.index_of(kind).is_some()) {
            return Err(InvalidState);
        }
        let iteration = figures.map_or(0, |figures| figures.iteration);
        let grid = grid_of(&params, iteration.max(1));
        let map = match u8::from_le_bytes(take(bytes)?) {
            0 => None,
            1 => {
                let layer = |_| (0..grid.n_nodes()).map(|_| probability(bytes)).collect();
                let by_kind: Result<Vec<Vec<f32>>, _> = (0..kinds.n()).map(layer).collect();
                Some(LandmarkMap::restored(grid, kinds.clone(), by_kind?))
            }
            _ => return Err(InvalidState),
        };
        if !bytes.is_empty() {
            return Err(InvalidState);
        }
        let level = Level::new(travel, &params, &kinds, grid);
        Ok(Self { travel, params, level, kinds, map, figures })
    }
}

fn figures(bytes: &mut &[u8]) -> Result<Option<Figures>, InvalidState> {
    let iteration = u32::from_le_bytes(take(bytes)?);
    let flags = u8::from_le_bytes(take(bytes)?);
    let log_likelihood = f64::from_le_bytes(take(bytes)?);
    let change = f64::from_le_bytes(take(bytes)?);
    let (n_cells, n_products, n_bytes) = (count(bytes)?, count(bytes)?, count(bytes)?);
    Ok((iteration > 0).then_some(Figures {
        iteration,
        log_likelihood: (flags & 1 != 0).then_some(log_likelihood),
        change: (flags & 2 != 0).then_some(change),
        n_cells,
        n_products,
        n_bytes,
    }))
}

fn kinds(bytes: &mut &[u8]) -> Result<Kinds, InvalidState> {
    let n = u32::from_le_bytes(take(bytes)?);
    let mut kinds = Vec::new();
    for _ in 0..n {
        let tag = u8::from_le_bytes(take(bytes)?);
        let number = u32::from_le_bytes(take(bytes)?);
        kinds.push(match tag {
            0 => LandmarkKind::Type(number),
            1 => LandmarkKind::Identity(number),
            _ => return Err(InvalidState),
        });
    }
    let sorted = Kinds::from_kinds(kinds.clone());
    if sorted.as_slice() == kinds { Ok(sorted) } else { Err(InvalidState) }
}

fn count(bytes: &mut &[u8]) -> Result<usize, InvalidState> {
    usize::try_from(u64::from_le_bytes(take(bytes)?)).map_err(|_| InvalidState)
}

fn probability(bytes: &mut &[u8]) -> Result<f32, InvalidState> {
    let value = f32::from_le_bytes(take(bytes)?);
    if (0.0..=1.0).contains(&value) { Ok(value) } else { Err(InvalidState) }
}

fn take<const N: usize>(bytes: &mut &[u8]) -> Result<[u8; N], InvalidState> {
    let (taken, rest) = bytes.split_first_chunk::<N>().ok_or(InvalidState)?;
    *bytes = rest;
    Ok(*taken)
}
