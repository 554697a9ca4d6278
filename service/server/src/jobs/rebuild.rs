//! `rebuild`: all that is derived, computed again from the journal with the parameters in force.
//!
//! It works beside the living map and hands its result over at the end; the map's actor takes in
//! what came meanwhile, so that nothing waits.

use meetpoint_storage::JobRecord;

use super::Done;
use super::drawing::drawn_again;
use super::running::{Running, Stopped};
use super::workbench::Workbench;
use crate::convert::job::REBUILD;
use crate::service::Service;

/// Computes the map again.
pub(super) async fn run(
    service: &Service,
    job: &JobRecord,
    running: &Running<'_>,
    bench: &Workbench,
) -> Result<Done, Stopped> {
    let record = service.map_record(&job.map.0).await?;
    let drawn = drawn_again(service, &record, (running, bench), 0.0).await?;
    running.decide();
    let version = service.actors.replace(&job.map, drawn.into_replacement(REBUILD)).await?;
    Ok(Done { version, result: None })
}
