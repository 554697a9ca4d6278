//! The relaxation of sessions by their scans: from the journal to what the journal keeps, stage by stage.

use std::time::Instant;

use meetpoint_proto::v1;
use meetpoint_storage::{ClosureFilter, SessionId, SessionRecord};
use meetpoint_tracking::{LaserOutcome, LaserProgress};

use super::super::running::Stopped;
use super::super::workbench::Next;
use super::live_poses::{KnownPoses, live_poses, newest_poses};
use super::saved::Saved;
use super::several::{self, KnownClosures, Several};
use super::way::{Way, way};
use super::{Found, REPORT_EVERY, Relaxing, SHARE_RELAXED, cannot_relax, share};
use crate::convert::closure;

/// Closures of the ledger read at a time.
const N_CLOSURES_READ: u32 = 1000;
/// A map with so many times the entropy a cell that it had before has lost its walls: relaxing found the
/// wrong closures, or gave up the right ones.
const BLURRED: f64 = 1.05;
/// Share of the work at which live mapping is known again.
const SHARE_MAPPED: f64 = 0.4;

impl Relaxing<'_> {
    /// Relaxes the next sessions by their scans, together; those with too few are left out. What is
    /// interrupted begins again: it is a matter of seconds.
    pub(super) async fn relax_by_scans(&self, saved: &mut Saved) -> Result<Vec<Found>, Stopped> {
        let ways = self.ways(saved).await?;
        if ways.is_empty() {
            return Ok(Vec::new());
        }
        let wanted: Vec<(SessionId, usize)> =
            ways.iter().map(|(record, way)| (record.id, way.course.moments.len())).collect();
        let poses = self.poses(&wanted, saved).await?;
        let several = self.bench.slice(move || Several::new(ways, poses)).await?;
        if several.sessions().is_empty() {
            return Ok(Vec::new());
        }
        let known = self.known_closures(&several.sessions()).await?;
        let outcome = self.staged(&several, known, saved).await?;
        let (job, forgets_identities) = (self.job.id, self.params.forget_identities);
        let found = move || several::found(job, &several, &outcome, forgets_identities);
        let (found, closures) = self.bench.slice(found).await?;
        for (_, told) in &found {
            self.running.progress(share(saved, 1.0), Some(&text(told))).await?;
        }
        if let Some(text) = text_of_all(&found, &closures) {
            self.running.progress(share(saved, 1.0), Some(&text)).await?;
        }
        saved.closures.extend(closures);
        Ok(found)
    }

    /// Where robots were, before the relaxation: by live mapping alone, or by all that is known.
    async fn poses(
        &self,
        wanted: &[(SessionId, usize)],
        saved: &Saved,
    ) -> Result<Vec<KnownPoses>, Stopped> {
        let wanted = (self.map, wanted);
        if self.params.going_on {
            return newest_poses(self.service, wanted).await;
        }
        let shares = share(saved, 0.0)..share(saved, SHARE_MAPPED);
        let at_work = (self.running, self.bench);
        let live = live_poses(self.service, wanted, &saved.found, at_work, shares).await?;
        let all_new = |poses| KnownPoses { poses, n_relaxed: 0 };
        Ok(live.into_iter().map(all_new).collect())
    }

    /// What people and the newest relaxation said of closures of these sessions.
    async fn known_closures(&self, sessions: &[SessionId]) -> Result<KnownClosures, Stopped> {
        let store = &self.service.store;
        let off = closure::keys_among(sessions, &store.closures_off(&self.map.id).await?);
        if !self.params.going_on {
            return Ok(KnownClosures { off, judged: None });
        }
        let (mut judged, mut after) = (Vec::new(), None);
        loop {
            let filter = ClosureFilter::default();
            let page = store.closures(&self.map.id, filter, after, N_CLOSURES_READ).await?;
            let Some(last) = page.last() else { break };
            after = Some(last.position);
            judged.extend(page.iter().filter_map(|record| closure::known(sessions, record)));
        }
        Ok(KnownClosures { off, judged: Some(judged) })
    }

    /// The ways of the next sessions, as far as their scans may be in memory together.
    async fn ways(&self, saved: &Saved) -> Result<Vec<(SessionRecord, Way)>, Stopped> {
        let mut bytes_left = self.service.settings.jobs.scans_bytes_max;
        let mut ways: Vec<(SessionRecord, Way)> = Vec::new();
        let reader = (self.service, self.bench);
        for planned in saved.together() {
            let record = self.service.session_record(&planned.session.0.to_string()).await?;
            match way(reader, &record, planned.through, Some(bytes_left)).await? {
                Ok(way) if way.scans.is_empty() => {}
                Ok(way) => {
                    bytes_left = bytes_left.saturating_sub(way.n_scan_bytes());
                    ways.push((record, way));
                }
                Err(problem) if ways.is_empty() => return Err(cannot_relax(&record, problem)),
                Err(problem) => {
                    let (session, n_before) = (record.id.0, ways.len());
                    let text = format!(
                        "session {session} is left out and stays where it is: beside the {n_before} \
                         before it, {problem}"
                    );
                    self.running.progress(share(saved, 0.0), Some(&text)).await?;
                }
            }
        }
        Ok(ways)
    }

    /// Goes through the stages, and tells of each that is behind.
    async fn staged(
        &self,
        several: &Several,
        known: KnownClosures,
        saved: &Saved,
    ) -> Result<LaserOutcome, Stopped> {
        let sessions = several.sessions();
        let mut frames = Vec::new();
        for &session in &sessions {
            frames.push(self.unsure_frames(session).await?);
        }
        let travels = several.travels(self.params.forget_identities, &frames);
        let first = sessions.first().map_or_else(String::new, |first| first.0.to_string());
        let mut pieces = self.bench.pieces(move |teller| {
            several::relaxed(travels, known, teller.n_threads(), |progress| {
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
                    session: first.clone(),
                    iteration: n_stages,
                    stage: several::stage(behind).to_owned(),
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
    let scans = told.scans.unwrap_or_default();
    let v1::ScanRelaxation { closures_accepted, closures_refused, before, after, .. } = scans;
    let mean_bits = |sharpness: v1::GridSharpness| sharpness.entropy_mean_bits;
    let sharpness = before.zip(after).map_or_else(String::new, |(before, after)| {
        format!(" {:.4} bits a cell, {:.4} before;", mean_bits(after), mean_bits(before))
    });
    format!(
        "session {}: {closures_accepted} closures accepted, {closures_refused} refused;{}{sharpness} \
         poses moved by up to {:.2} m{}",
        told.session,
        text_of_sightings(&scans),
        told.correction_max_m,
        text_of_blur(before, after)
    )
}

/// That people should look before robots drive by the new version; nothing if the map is as sharp as it was.
fn text_of_blur(
    before: Option<v1::GridSharpness>,
    after: Option<v1::GridSharpness>,
) -> &'static str {
    let mean_bits = |sharpness: v1::GridSharpness| sharpness.entropy_mean_bits;
    let is_blurred = before.zip(after).is_some_and(|(a, b)| BLURRED * mean_bits(a) < mean_bits(b));
    if is_blurred {
        "; the map is less sharp than before: look at the version before and at the closures, and go back \
         if walls have come apart"
    } else {
        ""
    }
}

/// What came of sightings of landmarks, for people; nothing without any.
fn text_of_sightings(scans: &v1::ScanRelaxation) -> String {
    let v1::ScanRelaxation { sightings_in_graph, sightings_fitted_only, .. } = *scans;
    let n_sightings = sightings_in_graph + sightings_fitted_only;
    if n_sightings == 0 {
        return String::new();
    }
    let doubted = match scans.sightings_doubted {
        0 => String::new(),
        n_doubted => format!(" ({n_doubted} of others seen again, but not where they were)"),
    };
    format!(" {sightings_in_graph} of {n_sightings} sightings of landmarks in the graph{doubted};")
}

/// What came of several sessions together, for people; `None` of one.
fn text_of_all(found: &[Found], closures: &[v1::Closure]) -> Option<String> {
    if found.len() < 2 {
        return None;
    }
    let accepted = i32::from(v1::ClosureVerdict::Accepted);
    let between = closures.iter().filter(|one| one.from_session != one.to_session);
    let between: Vec<&v1::Closure> = between.filter(|one| one.verdict == accepted).collect();
    let is_met = |session: &str| {
        between.iter().any(|one| one.from_session == session || one.to_session == session)
    };
    let sessions = found.iter().map(|(_, told)| told.session.as_str());
    let alone: Vec<&str> = sessions.filter(|session| !is_met(session)).collect();
    let met = format!(
        "{} sessions relaxed together: {} closures accepted between them",
        found.len(),
        between.len()
    );
    Some(if alone.is_empty() {
        met
    } else {
        format!("{met}; these meet none of the others: {}", alone.join(", "))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_that_lost_its_walls_is_told_of() {
        let told = |before_bits: f64, after_bits: f64| {
            let sharpness = |entropy_mean_bits: f64| {
                Some(v1::GridSharpness { entropy_mean_bits, ..v1::GridSharpness::default() })
            };
            text(&v1::RelaxedSession {
                session: "s".to_owned(),
                scans: Some(v1::ScanRelaxation {
                    before: sharpness(before_bits),
                    after: sharpness(after_bits),
                    ..v1::ScanRelaxation::default()
                }),
                ..v1::RelaxedSession::default()
            })
        };
        assert!(told(0.30, 0.34).contains("less sharp than before"), "{}", told(0.30, 0.34));
        assert!(!told(0.30, 0.27).contains("less sharp"), "{}", told(0.30, 0.27));
        assert!(!told(0.30, 0.305).contains("less sharp"), "{}", told(0.30, 0.305));
    }
}
