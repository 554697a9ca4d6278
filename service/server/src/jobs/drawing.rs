//! A map drawn again from its journal, by all that was decided, beside the living map.

use std::collections::BTreeMap;
use std::ops::Range;
use std::time::{Duration, Instant};

use meetpoint_proto::v1;
use meetpoint_storage::{JournalSeq, MapRecord, PoseRecord, SessionId};

use super::running::{Running, Stopped};
use super::workbench::Workbench;
use crate::error::Error;
use crate::mapping::{Decisions, MapState, Replacement};
use crate::service::Service;

/// How often the job says how far it is.
const REPORT_EVERY: Duration = Duration::from_secs(1);

/// A map drawn again.
pub(super) struct Drawn {
    state: MapState,
    /// Scans mapped.
    pub(super) n_scans: u64,
    /// Of each open session the newest.
    corrections: BTreeMap<SessionId, v1::PoseCorrection>,
}

impl Drawn {
    /// The poses of a session in its own frame; none of a session that the map does not know.
    pub(super) fn poses(&self, session: SessionId) -> &[PoseRecord] {
        self.state.poses_of(session)
    }

    /// What the living map is to be replaced by.
    pub(super) fn into_replacement(self, origin: &'static str) -> Replacement {
        let Self { state, n_scans: _, corrections } = self;
        Replacement { state, origin, corrections: corrections.into_iter().collect() }
    }
}

/// Draws a map up to the end that its journal has now, by all that was decided, while the job's
/// progress goes from `share_before` to 1.
pub(super) async fn drawn_again(
    service: &Service,
    record: &MapRecord,
    at_work: (&Running<'_>, &Workbench),
    share_before: f64,
) -> Result<Drawn, Stopped> {
    let end = service.store.journal_end(&record.id).await?;
    let decisions = Decisions::load(&service.store, &record.id, end).await?;
    drawn(service, (record, end), decisions, at_work, share_before..1.0).await
}

/// Draws a map up to a place in its journal by these decisions, while the job's progress goes through
/// `shares`.
pub(super) async fn drawn(
    service: &Service,
    (record, end): (&MapRecord, JournalSeq),
    decisions: Decisions,
    (running, bench): (&Running<'_>, &Workbench),
    shares: Range<f64>,
) -> Result<Drawn, Stopped> {
    let state = MapState::new(service.actors.sensing(), record.resolution_m, decisions)?;
    let mut drawn = Drawn { state, n_scans: 0, corrections: BTreeMap::new() };
    let text = format!("journal entries up to {}", end.0);
    running.progress(shares.start, Some(&text)).await?;
    let mut reported = Instant::now();
    while drawn.state.position() < end {
        let settings = &service.settings.mapping;
        let (n_max, bytes_max) = (settings.read_ahead_n_max, settings.read_ahead_bytes_max);
        let position = drawn.state.position();
        let entries = service.store.journal(&record.id, position, n_max, bytes_max).await?;
        if entries.is_empty() {
            break;
        }
        let applied = bench.slice(move || {
            for entry in entries {
                apply(&mut drawn, entry)?;
            }
            Ok::<_, Error>(drawn)
        });
        drawn = applied.await??;
        if reported.elapsed() >= REPORT_EVERY {
            let share = share(drawn.state.position(), end);
            let share = shares.start + (shares.end - shares.start) * share;
            running.progress(share, None).await?;
            reported = Instant::now();
        }
    }
    let text = format!("{} scans mapped again", drawn.n_scans);
    running.progress(shares.end, Some(&text)).await?;
    Ok(drawn)
}

fn apply(drawn: &mut Drawn, entry: meetpoint_storage::JournalEntry) -> Result<(), Error> {
    let applied = drawn.state.apply(entry)?;
    drawn.n_scans += applied.n_scans;
    let Some(session) = applied.session else { return Ok(()) };
    if applied.ended {
        drawn.corrections.remove(&session);
    } else if let Some(correction) = applied.correction {
        drawn.corrections.insert(session, correction);
    }
    Ok(())
}

fn share(position: JournalSeq, end: JournalSeq) -> f64 {
    if end.0 == 0 { 1.0 } else { position.0 as f64 / end.0 as f64 }
}
