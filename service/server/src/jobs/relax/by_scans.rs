//! The relaxation of one session by its scans: from the journal to what the journal keeps, stage by
//! stage.

use std::time::Instant;

use meetpoint_proto::v1;
use meetpoint_storage::SessionRecord;
use meetpoint_tracking::{LaserOutcome, LaserProgress, LaserTravel};

use super::super::running::Stopped;
use super::super::workbench::Next;
use super::driven::{self, Driven};
use super::live_poses::live_poses;
use super::saved::Saved;
use super::way::Way;
use super::{Found, REPORT_EVERY, Relaxing, SHARE_RELAXED, share};

/// Scans without which there is nothing to hold against another.
const N_SCANS_MIN: usize = 2;
/// Share of a session's work at which live mapping is known again.
const SHARE_MAPPED: f64 = 0.4;

impl Relaxing<'_> {
    /// Relaxes a session by its scans; `None` if there are too few. What is interrupted begins again:
    /// it is a matter of seconds.
    pub(super) async fn relax_by_scans(
        &self,
        record: &SessionRecord,
        way: Way,
        saved: &mut Saved,
    ) -> Result<Option<Found>, Stopped> {
        if way.scans.len() < N_SCANS_MIN {
            return Ok(None);
        }
        let shares = share(saved, 0.0)..share(saved, SHARE_MAPPED);
        let (at_work, wanted) =
            ((self.running, self.bench), (self.map, record.id, way.course.moments.len()));
        let live = live_poses(self.service, wanted, &saved.found, at_work, shares).await?;
        let switched_off = self.service.store.closures_off(record.id).await?;
        let driven = self.bench.slice(move || Driven::new(way, live)).await?;
        let outcome = self.staged(record, driven.travel(), switched_off, saved).await?;
        let (job, record) = (self.job.id, record.clone());
        let forgets_identities = self.params.forget_identities;
        let found = self
            .bench
            .slice(move || driven::found((job, &record), &driven, &outcome, forgets_identities));
        let driven::Found { kept, told, closures } = found.await?;
        self.running.progress(share(saved, 1.0), Some(&text(&told))).await?;
        Ok(Some((kept, told, closures)))
    }

    /// Goes through the stages, and tells of each that is behind.
    async fn staged(
        &self,
        record: &SessionRecord,
        travel: LaserTravel,
        switched_off: Vec<[i64; 2]>,
        saved: &Saved,
    ) -> Result<LaserOutcome, Stopped> {
        let mut pieces = self.bench.pieces(move |teller| {
            driven::relaxed(travel, &switched_off, teller.n_threads(), |progress| {
                teller.tell(progress).map_continue(|()| teller.n_threads())
            })
        })?;
        let (mut reported, mut stage, mut n_stages) = (Instant::now(), None, 0);
        loop {
            let LaserProgress { share: of_rest, stage: next, .. } = match pieces.next().await? {
                Next::Piece(progress) => progress,
                Next::Done(outcome) => return outcome?.ok_or(Stopped::Left),
            };
            let of_session = SHARE_MAPPED + (1.0 - SHARE_MAPPED) * of_rest;
            let progress = share(saved, of_session).min(SHARE_RELAXED);
            let behind = stage.replace(next).filter(|before| *before != next);
            if let Some(behind) = behind {
                n_stages += 1;
                let figures = v1::RelaxFigures {
                    session: record.id.0.to_string(),
                    iteration: n_stages,
                    stage: driven::stage(behind).to_owned(),
                    log_likelihood: None,
                };
                self.tell(progress, figures, saved).await?;
            } else if REPORT_EVERY <= reported.elapsed() {
                self.running.progress(progress, None).await?;
            } else {
                continue;
            }
            reported = Instant::now();
        }
    }
}

/// What came of a session, for people.
fn text(told: &v1::RelaxedSession) -> String {
    let v1::ScanRelaxation { closures_accepted, closures_refused, before, after, .. } =
        told.scans.unwrap_or_default();
    let mean_bits =
        |sharpness: Option<v1::GridSharpness>| sharpness.unwrap_or_default().entropy_mean_bits;
    format!(
        "session {}: {closures_accepted} closures accepted, {closures_refused} refused; {:.4} bits a \
         cell, {:.4} before; poses moved by up to {:.2} m",
        told.session,
        mean_bits(after),
        mean_bits(before),
        told.correction_max_m
    )
}
