//! By what maps are drawn: tunables and the weights of sonar, of the whole service, and what was decided for one
//! map.

use std::sync::Arc;

use meetpoint_occupancy::{Tile, TileIndex};
use meetpoint_tracking::{LiveMap, MappingParams, SonarNetworks};

use crate::convert::mapping_parameters;
use crate::error::Error;
use crate::sonar_weights::SonarWeights;

/// Bytes of the hash that names parameters, as for weights of sonar.
const N_NAME_BYTES: usize = 6;

/// What the readings of sensors are taken to mean.
#[derive(Clone, Debug)]
pub(crate) struct Sensing {
    params: MappingParams,
    networks: SonarNetworks,
    /// Names them both.
    sonar_weights: String,
    /// Names what was decided; empty if nothing was.
    parameters: String,
}

impl Sensing {
    /// For buildings, with weights that draw and weights that robots are followed by.
    pub(crate) fn indoor(drawing: SonarWeights, following: SonarWeights) -> Self {
        let sonar_weights = format!("{}+{}", drawing.name, following.name);
        let networks = SonarNetworks { drawing: drawing.network, following: following.network };
        let params = MappingParams::INDOOR;
        Self { params, networks, sonar_weights, parameters: String::new() }
    }

    /// For a map of which this was decided, beside what the service has.
    ///
    /// # Errors
    /// [`Error::InvalidField`] for what makes no sense; [`Error::Internal`] for what cannot be read.
    pub(crate) fn of(self: &Arc<Self>, decided: Option<&[u8]>) -> Result<Arc<Self>, Error> {
        let Some(decided) = decided.filter(|bytes| !bytes.is_empty()) else {
            return Ok(self.clone());
        };
        let wire = mapping_parameters::from_bytes(decided)?;
        let params = mapping_parameters::applied(&self.params, &wire)?;
        let mut parameters = blake3::hash(decided).to_hex().to_string();
        parameters.truncate(2 * N_NAME_BYTES);
        let (networks, sonar_weights) = (self.networks.clone(), self.sonar_weights.clone());
        Ok(Arc::new(Self { params, networks, sonar_weights, parameters }))
    }

    /// The parameters.
    pub(crate) fn params(&self) -> &MappingParams {
        &self.params
    }

    /// The name of the parameters; empty for those of the service.
    pub(crate) fn parameters(&self) -> &str {
        &self.parameters
    }

    /// The name of the weights by which sonars are read.
    pub(crate) fn sonar_weights(&self) -> &str {
        &self.sonar_weights
    }

    /// An empty map.
    ///
    /// # Errors
    /// [`Error::Internal`] for a resolution that no map can have.
    pub(super) fn empty_map(&self, resolution_m: f64) -> Result<LiveMap, Error> {
        let map = LiveMap::new(self.params, resolution_m)
            .map_err(|error| Error::internal(format!("{error:?}")))?;
        Ok(map.with_networks(self.networks.clone()))
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
        Ok(map.with_networks(self.networks.clone()))
    }
}
