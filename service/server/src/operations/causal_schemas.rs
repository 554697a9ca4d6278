//! Causal schemas of a travel.

use meetpoint_proto::v1;

use crate::convert::causal;
use crate::error::Error;
use crate::service::Service;

impl Service {
    /// What a session's travel says of views and actions.
    pub(crate) async fn list_causal_schemas(
        &self,
        request: v1::ListCausalSchemasRequest,
    ) -> Result<v1::ListCausalSchemasResponse, Error> {
        let v1::ListCausalSchemasRequest { map, session } = request;
        let name = v1::TreeName { map: map.clone(), session, ..v1::TreeName::default() };
        let asked = self.asked(Some(name)).await?;
        let travelled = self.travelled(&asked).await?;
        let (travel, by_steps) = (travelled.travel(), travelled.is_by_steps());
        drop(travelled);
        let travel = travel.ok_or_else(|| Error::NothingTravelled(map.clone()))?;
        // Pairs of visits: some milliseconds of as many as are kept.
        let told = tokio::task::spawn_blocking(move || causal::to_wire(&travel));
        let told = told.await.map_err(Error::internal)?;
        let session = asked.session.0.to_string();
        Ok(v1::ListCausalSchemasResponse { map, session, by_steps, ..told })
    }
}
