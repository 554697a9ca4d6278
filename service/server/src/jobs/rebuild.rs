//! `rebuild`: all that is derived, computed again from the journal with the parameters in force.
//!
//! It works beside the living map and hands its result over at the end; the map's actor takes in
//! what came meanwhile, so that nothing waits.

use std::time::{Duration, Instant};

use meetpoint_storage::{JobRecord, JournalSeq};
use meetpoint_tracking::MappingParams;

use super::{Running, Stopped};
use crate::mapping::MapState;
use crate::{error::Error, service::Service};

/// How often the job says how far it is.
const REPORT_EVERY: Duration = Duration::from_secs(1);

/// Computes the map again; the number of the version that it became.
pub(super) async fn run(
    service: &Service,
    job: &JobRecord,
    running: &Running<'_>,
) -> Result<u64, Stopped> {
    let record = service.map_record(&job.map.0).await?;
    let mut state = MapState::new(&MappingParams::INDOOR, record.resolution_m)?;
    let end = service.store.journal_end(&job.map).await.map_err(Error::from)?;
    running.progress(0.0, Some(&format!("journal entries up to {}", end.0))).await?;
    let mut reported = Instant::now();
    let mut n_scans = 0;
    while state.position() < end {
        let settings = &service.settings.mapping;
        let (n_max, bytes_max) = (settings.read_ahead_n_max, settings.read_ahead_bytes_max);
        let read = service.store.journal(&job.map, state.position(), n_max, bytes_max).await;
        let entries = read.map_err(Error::from)?;
        if entries.is_empty() {
            break;
        }
        let applied = tokio::task::spawn_blocking(move || {
            let mut n_scans = 0;
            for entry in entries {
                n_scans += state.apply(entry)?.n_scans;
            }
            Ok::<_, Error>((state, n_scans))
        });
        let (next, n) = applied.await.map_err(Error::internal)??;
        state = next;
        n_scans += n;
        if reported.elapsed() >= REPORT_EVERY {
            running.progress(share(state.position(), end), None).await?;
            reported = Instant::now();
        }
    }
    running.progress(1.0, Some(&format!("{n_scans} scans mapped again"))).await?;
    Ok(service.actors.replace(&job.map, state).await?)
}

fn share(position: JournalSeq, end: JournalSeq) -> f64 {
    if end.0 == 0 { 1.0 } else { position.0 as f64 / end.0 as f64 }
}
