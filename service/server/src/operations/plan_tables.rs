//! Plan tables to be taken along.

use std::sync::Arc;
use std::time::Duration;

use meetpoint_proto::v1;

use crate::convert::plan::basis;
use crate::planning::{self, Field};
use crate::{error::Error, service::Service};

/// So long a download waits for tables that are being made: less than clients wait for an answer.
const TABLES_WAIT: Duration = Duration::from_secs(20);
/// Bytes of a piece.
const PIECE_BYTES: usize = 1 << 20;

impl Service {
    /// The file of a profile's tables, in pieces.
    pub(crate) async fn plan_tables(
        &self,
        request: v1::DownloadPlanTablesRequest,
    ) -> Result<Vec<Vec<u8>>, Error> {
        let v1::DownloadPlanTablesRequest { map, robot, map_version } = request;
        let field = self.one_field(&map, map_version, robot).await?;
        if field.profile.name.is_empty() {
            let name = format!("of {} m radius", field.profile.radius_m);
            return Err(Error::NoSuchProfile { map, name });
        }
        let waiting = tokio::time::timeout(TABLES_WAIT, self.tables_made(&field));
        waiting.await.map_err(|_| Error::PlanTablesNotReady)??;
        let written = self.searched(&field, |field| {
            let plans = field.plans()?;
            Some(planning::tables_file(field, plans, basis(field, true), PIECE_BYTES))
        });
        written.await?.ok_or(Error::PlanTablesNotReady)
    }

    /// Waits until the tables of a field are made.
    async fn tables_made(&self, field: &Arc<Field>) -> Result<(), Error> {
        let mut made = self.planner.fields.made();
        while field.plans().is_none() {
            tokio::select! {
                changed = made.changed() => changed.map_err(|_| Error::Stopping)?,
                () = self.stop.cancelled() => return Err(Error::Stopping),
            }
        }
        Ok(())
    }
}
