//! What readings of a map's sensors are taken to mean.

use meetpoint_proto::v1;
use meetpoint_storage::{JournalSeq, MapRecord, NewMappingParameters};

use crate::convert::mapping_parameters;
use crate::{clock, error::Error, service::Service};

impl Service {
    /// Those that hold for a map.
    pub(crate) async fn get_mapping_parameters(
        &self,
        request: v1::GetMappingParametersRequest,
    ) -> Result<v1::GetMappingParametersResponse, Error> {
        let record = self.map_record(&request.map).await?;
        let state = Some(self.mapping_parameters(&record).await?);
        Ok(v1::GetMappingParametersResponse { state })
    }

    /// Decides on others.
    pub(crate) async fn set_mapping_parameters(
        &self,
        request: v1::SetMappingParametersRequest,
    ) -> Result<v1::SetMappingParametersResponse, Error> {
        let v1::SetMappingParametersRequest { map, parameters } = request;
        let wire = parameters.ok_or_else(|| Error::field("parameters", "missing"))?;
        let record = self.map_record(&map).await?;
        let payload = mapping_parameters::to_bytes(&wire);
        // Refused before it is written.
        self.actors.sensing().of(Some(&payload))?;
        let before = self.store.mapping_parameters(&record.id, JournalSeq::END).await?;
        if before.unwrap_or_default() != payload {
            let (map, time_ns) = (record.id.clone(), clock::now_ns());
            let new = NewMappingParameters { map, payload, time_ns };
            self.store.decide_mapping_parameters(&new).await?;
            self.actors.wake(&record.id);
        }
        let state = Some(self.mapping_parameters(&record).await?);
        Ok(v1::SetMappingParametersResponse { state })
    }

    async fn mapping_parameters(
        &self,
        record: &MapRecord,
    ) -> Result<v1::MappingParametersState, Error> {
        let decided = self.store.mapping_parameters(&record.id, JournalSeq::END).await?;
        let sensing = self.actors.sensing().of(decided.as_deref())?;
        let published = match record.published_version {
            0 => None,
            number => self.store.version(&record.id, number).await?,
        };
        let name = sensing.parameters().to_owned();
        Ok(v1::MappingParametersState {
            parameters: Some(mapping_parameters::to_wire(sensing.params())),
            map_version: record.published_version,
            drawn: published.is_none_or(|version| version.mapping_parameters == name),
            name,
        })
    }
}
