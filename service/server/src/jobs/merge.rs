//! `merge`: where sessions of unknown start lie in the map, and in one another.
//!
//! Every frame of the newest version is a part: the map's, and those of sessions that are not placed. Each
//! is looked for in the map, those that are not found there in one another, the younger in the older. What
//! is found becomes the merge of its session. What rules accept becomes entries of the journal, in one
//! transaction with that: until then the job can be cancelled; after it the job only draws.

mod constellations;
mod findings;
mod parts;
mod searching;

use meetpoint_proto::v1;
use meetpoint_storage::{FoundMerges, JobRecord, MapRecord};
use prost::Message;

use super::Done;
use super::drawing::drawn_again;
use super::running::{Running, Stopped};
use super::workbench::Workbench;
use crate::convert::job::{self, MERGE};
use crate::merging::Known;
use crate::{clock, error::Error, service::Service};
use findings::{Asked, Findings};
use parts::Parts;

/// Share of the progress at which walls were searched, and at which landmarks were; the rest is drawing.
const SHARE_WALLS: f64 = 0.3;
const SHARE_SEARCHED: f64 = 0.6;
/// The layout of [`Saved`]; field numbers are kept for ever.
const FORMAT: u32 = 1;

/// What a job has come to.
#[derive(Clone, PartialEq, Message)]
struct Saved {
    #[prost(uint32, tag = "1")]
    format: u32,
    /// Whether the map is to be drawn by what was decided.
    #[prost(bool, tag = "2")]
    draws: bool,
    /// What came of each session.
    #[prost(message, repeated, tag = "3")]
    told: Vec<v1::MergedSession>,
}

/// Looks for the sessions that were asked for, and draws the map with those that are placed.
pub(super) async fn run(
    service: &Service,
    job: &JobRecord,
    running: &Running<'_>,
    bench: &Workbench,
) -> Result<Done, Stopped> {
    let map = service.map_record(&job.map.0).await?;
    let params = job::merge_params(&job.params)?;
    let merging = Merging { service, job, map: &map, params: &params, running, bench };
    let saved = merging.searched().await?;
    let mut version = 0;
    if saved.draws {
        running.decide();
        let drawn = drawn_again(service, &map, (running, bench), SHARE_SEARCHED).await?;
        version = service.actors.replace(&map.id, drawn.into_replacement(MERGE)).await?;
    }
    let result = v1::MergeResult { sessions: saved.told };
    Ok(Done { version, result: Some(v1::job::Result::MergeResult(result)) })
}

/// A job at work.
struct Merging<'a> {
    service: &'a Service,
    job: &'a JobRecord,
    map: &'a MapRecord,
    params: &'a v1::MergeParams,
    running: &'a Running<'a>,
    bench: &'a Workbench,
}

impl Merging<'_> {
    /// What was found and decided, now or before the service was killed.
    async fn searched(&self) -> Result<Saved, Stopped> {
        if let Some(checkpoint) = self.job.checkpoint.as_deref() {
            let saved = Saved::decode(checkpoint).map_err(Error::internal)?;
            if saved.format == FORMAT {
                return Ok(saved);
            }
        }
        if self.params.draw_only {
            return Ok(Saved { format: FORMAT, draws: true, told: Vec::new() });
        }
        loop {
            let known = Known::load(&self.service.store, &self.map.id, clock::now_ns()).await?;
            let parts = Parts::load(self).await?;
            if parts.newcomers.is_empty() {
                return Err(Error::NothingToMerge(self.map.id.0.clone()).into());
            }
            let mut searched = self.search(&parts).await?;
            searched.by_landmarks = self.search_landmarks(&parts).await?;
            let asked =
                Asked { rules: &self.service.settings.merging, founds_map: self.params.found_map };
            let findings = Findings::new(&parts, &searched, &asked, known)?;
            match self.record(findings).await? {
                Some(saved) => return Ok(saved),
                // Somebody decided meanwhile: what was found may not fit any more.
                None => {
                    let text = "merges were decided about meanwhile: looking again";
                    self.running.progress(0.0, Some(text)).await?;
                }
            }
        }
    }

    /// Makes what was found, and what rules decide about it, durable; `None` if somebody decided
    /// meanwhile.
    async fn record(&self, findings: Findings) -> Result<Option<Saved>, Stopped> {
        let Findings { merges, mut known, told, placed, lines } = findings;
        let draws = known.decides();
        if draws && self.service.settings.merging.relaxes_after {
            known.then_relax();
        }
        let saved = Saved { format: FORMAT, draws, told };
        let found = FoundMerges {
            job: self.job.id,
            fence: self.running.fence(),
            merges,
            decided: known.into_decisions(),
            checkpoint: saved.encode_to_vec(),
        };
        match self.service.store.record_found_merges(&found).await {
            Ok(()) => {}
            Err(meetpoint_storage::Error::MergesChanged(_)) => return Ok(None),
            Err(error) => return Err(error.into()),
        }
        // The journal has grown by what was decided.
        self.service.actors.wake(&self.map.id);
        for session in placed {
            self.service.announce_place(session).await?;
        }
        for line in lines {
            self.running.progress(SHARE_SEARCHED, Some(&line)).await?;
        }
        Ok(Some(saved))
    }
}
