//! What readings of a map's sensors are taken to mean.

use meetpoint_proto::v1::{
    GetMappingParametersRequest, MappingParameters, MappingParametersState,
    SetMappingParametersRequest,
};

use super::{Client, call};
use crate::error::Error;

impl Client {
    /// The parameters that hold for a map, and whether it is drawn by them.
    ///
    /// # Errors
    ///
    /// `MAP_NOT_FOUND`.
    pub async fn mapping_parameters(&self, map: &str) -> Result<MappingParametersState, Error> {
        let request = GetMappingParametersRequest { map: map.to_owned() };
        let response = self.maps().get_mapping_parameters(call(request)).await?;
        response.into_inner().state.ok_or(Error::Malformed("state"))
    }

    /// Decides on others, all at once: what is absent is as the service has it for buildings.
    ///
    /// # Errors
    ///
    /// `MAP_NOT_FOUND`, or `INVALID_FIELD` for one that is out of its range.
    pub async fn set_mapping_parameters(
        &self,
        map: &str,
        parameters: MappingParameters,
    ) -> Result<MappingParametersState, Error> {
        let request =
            SetMappingParametersRequest { map: map.to_owned(), parameters: Some(parameters) };
        let response = self.maps().set_mapping_parameters(call(request)).await?;
        response.into_inner().state.ok_or(Error::Malformed("state"))
    }
}
