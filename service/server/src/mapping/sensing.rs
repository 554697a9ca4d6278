//! By what maps are drawn: tunables and the weights of sonar, of the whole service.

use std::sync::Arc;

use meetpoint_occupancy::{Tile, TileIndex};
use meetpoint_tracking::{LiveMap, MappingParams};

use crate::error::Error;
use crate::sonar_weights::SonarWeights;

/// What the readings of sensors are taken to mean.
#[derive(Clone, Debug)]
pub(crate) struct Sensing {
    params: MappingParams,
    weights: SonarWeights,
}

impl Sensing {
    /// For buildings, with these weights.
    pub(crate) fn indoor(weights: SonarWeights) -> Self {
        Self { params: MappingParams::INDOOR, weights }
    }

    /// The name of the weights by which sonars are read.
    pub(crate) fn sonar_weights(&self) -> &str {
        &self.weights.name
    }

    /// An empty map.
    ///
    /// # Errors
    /// [`Error::Internal`] for a resolution that no map can have.
    pub(super) fn empty_map(&self, resolution_m: f64) -> Result<LiveMap, Error> {
        let map = LiveMap::new(self.params, resolution_m)
            .map_err(|error| Error::internal(format!("{error:?}")))?;
        Ok(map.with_network(self.weights.network.clone()))
    }

    /// The map that had these tiles and this state.
    ///
    /// # Errors
    /// [`Error::Internal`] if they are of another format or damaged.
    pub(super) fn restored_map(
        &self,
        resolution_m: f64,
        tiles: impl IntoIterator<Item = (TileIndex, Arc<Tile>)>,
        state: &[u8],
    ) -> Result<LiveMap, Error> {
        let map = LiveMap::restore(self.params, resolution_m, tiles, state)
            .map_err(|error| Error::internal(format!("a map's state cannot be read: {error:?}")))?;
        Ok(map.with_network(self.weights.network.clone()))
    }
}
