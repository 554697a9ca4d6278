//! Where sessions that saw landmarks and no walls lie: by what their landmarks have in common.
//!
//! Each is relaxed by itself; then, as one robot after the other comes to a map, whichever is surest is put
//! where it lies among those before, and all are fitted together, until nobody is sure any more: TBF98
//! section 8, with the whole of each travel at once.

use meetpoint_geometry::Pose;
use meetpoint_proto::v1;
use meetpoint_relaxation::{
    AlignmentParams, Constellation, LandmarkAlignment, LandmarkAlignments, LandmarkKind, Placed,
    Travel, aligned, joint,
};
use meetpoint_storage::{SessionId, SessionRecord};

use super::super::relax::landmark_travel::{LandmarkTravel, landmark_travel};
use super::super::relax::names::LandmarkNames;
use super::super::running::Stopped;
use super::parts::Parts;
use super::{Merging, SHARE_SEARCHED, SHARE_WALLS};
use crate::convert::merge;
use crate::settings::MergingSettings;

/// Landmarks with names that two sessions must have in common to be merged by names: they say where it is
/// and which way it looks.
const N_NAMED_MIN: usize = 2;

/// What landmarks say of one newcomer.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct LandmarksFound {
    pub(super) verdict: v1::MergeVerdict,
    pub(super) reasons: Vec<String>,
    pub(super) alignments: Vec<v1::MergeAlignment>,
    /// Whether its frame is what the others are looked for in.
    pub(super) is_base: bool,
}

/// A session past landmarks.
struct Starred {
    session: SessionId,
    /// Its number among the newcomers; `None` for one that lies in the map.
    newcomer: Option<usize>,
    /// Where it lies in what the others are looked for in, once that is known.
    base_from_session: Option<Pose>,
    past: LandmarkTravel,
}

/// Limits of what is believed.
#[derive(Clone, Copy)]
struct Limits {
    log_odds_min: f64,
    contradiction_max: f64,
    /// Whether landmarks without names are enough to merge by.
    accepts_nameless: bool,
}

/// What is found of a session among those that lie in the base.
struct Judged {
    alignments: LandmarkAlignments,
    /// Landmarks with a name among those that are one in the best of them.
    n_named: usize,
}

impl Merging<'_> {
    /// What landmarks say of each newcomer; `None` of those that saw none, or walls too.
    pub(super) async fn search_landmarks(
        &self,
        parts: &Parts,
    ) -> Result<Vec<Option<LandmarksFound>>, Stopped> {
        let n = parts.newcomers.len();
        let is_newcomer = |record: &SessionRecord| {
            parts.newcomers.iter().position(|newcomer| newcomer.session == record.id)
        };
        if !parts.starred.iter().any(|record| is_newcomer(record).is_some()) {
            return Ok(vec![None; n]);
        }
        let (mut starred, mut names) = (Vec::new(), LandmarkNames::default());
        let n_all = parts.starred.len() as f64;
        for (index, record) in parts.starred.iter().enumerate() {
            let extent = (SHARE_SEARCHED - SHARE_WALLS) / n_all;
            let shares = [SHARE_WALLS + extent * index as f64, extent];
            let at_work = (self.running, self.bench);
            let past = landmark_travel(self.service, record, &mut names, at_work, shares).await?;
            let Some(past) = past else { continue };
            starred.push(Starred {
                session: record.id,
                newcomer: is_newcomer(record),
                base_from_session: record.map_from_session.map(crate::convert::pose::from_record),
                past,
            });
        }
        let limits = limits(&self.service.settings.merging);
        Ok(self.bench.slice(move || found(starred, n, limits)).await?)
    }
}

fn limits(settings: &MergingSettings) -> Limits {
    Limits {
        log_odds_min: settings.landmarks_log_odds_min,
        contradiction_max: settings.landmarks_contradiction_max,
        accepts_nameless: settings.landmarks_accepts_nameless,
    }
}

/// What is found of `n` newcomers.
fn found(mut starred: Vec<Starred>, n: usize, limits: Limits) -> Vec<Option<LandmarksFound>> {
    let mut all = vec![None; n];
    let base = base(&mut starred, &mut all);
    loop {
        let Some((site, params)) = site(&starred) else { return all };
        let rest = starred.iter().enumerate().filter(|(_, it)| it.base_from_session.is_none());
        let judged: Vec<(usize, Judged)> = rest
            .map(|(index, it)| {
                let own = Constellation::of(&it.past.travel, &it.past.outcome);
                (index, Judged::new(aligned(&site, &own, &params), &site))
            })
            .collect();
        let log_odds = |found: &Judged| found.alignments.ranked.first().map(|it| it.log_odds);
        let sure = judged.iter().filter(|(_, it)| verdict(it, limits) == v1::MergeVerdict::Merged);
        let surest = sure.max_by(|a, b| {
            let [a, b] = [a, b].map(|(_, it)| log_odds(it).unwrap_or(f64::NEG_INFINITY));
            a.total_cmp(&b)
        });
        let Some((index, surest)) = surest else {
            for (index, judged) in &judged {
                tell(&starred[*index], base, judged, limits, &mut all);
            }
            return all;
        };
        tell(&starred[*index], base, surest, limits, &mut all);
        let at = surest.alignments.ranked.first().map(|best| best.site_from_other);
        starred[*index].base_from_session = at;
    }
}

/// The newcomer in whose frame the others are looked for; `None` if somebody lies in the map.
fn base(starred: &mut [Starred], all: &mut [Option<LandmarksFound>]) -> Option<SessionId> {
    if starred.iter().any(|it| it.base_from_session.is_some()) {
        return None;
    }
    let first = starred.first_mut()?;
    first.base_from_session = Some(Pose::IDENTITY);
    if let Some(index) = first.newcomer {
        all[index] = Some(LandmarksFound {
            verdict: v1::MergeVerdict::NotEnoughSeen,
            reasons: vec!["nothing is in the map yet that it could lie on".to_owned()],
            alignments: vec![merge::founding(first.session)],
            is_base: true,
        });
    }
    Some(first.session)
}

/// The landmarks of all that lie in the base, fitted together; `None` if they do not fit.
fn site(starred: &[Starred]) -> Option<(Constellation, AlignmentParams)> {
    let placed: Vec<Placed<'_>> = starred
        .iter()
        .filter_map(|it| {
            let LandmarkTravel { travel, outcome } = &it.past;
            Some(Placed { travel, outcome, site_from_travel: it.base_from_session? })
        })
        .collect();
    let travels: Vec<&Travel> = placed.iter().map(|it| it.travel).collect();
    let params = AlignmentParams::of_travels(travels.iter().copied());
    let outcome = joint(&placed, &params)?;
    Some((Constellation::of_joint(&travels, &outcome), params))
}

/// Keeps what is found of a session.
fn tell(
    starred: &Starred,
    base: Option<SessionId>,
    found: &Judged,
    limits: Limits,
    all: &mut [Option<LandmarksFound>],
) {
    let Some(index) = starred.newcomer else { return };
    let alignments = found.alignments.ranked.iter();
    all[index] = Some(LandmarksFound {
        verdict: verdict(found, limits),
        reasons: reasons(found, limits),
        alignments: alignments
            .map(|it| merge::landmark_alignment(starred.session, base, it))
            .collect(),
        is_base: false,
    });
}

/// Share of the landmarks that both should have seen which one did not.
fn contradiction(of: &LandmarkAlignment) -> f64 {
    let (matched, contradicted) = (of.n_matched as f64, of.n_contradicted as f64);
    contradicted / (matched + contradicted).max(1.0)
}

impl Judged {
    fn new(alignments: LandmarkAlignments, site: &Constellation) -> Self {
        let best = alignments.ranked.first();
        let matches = best.map_or(&[][..], |best| &best.matches);
        let named = matches.iter().filter(|(of_site, _)| {
            site.stars
                .get(*of_site)
                .is_some_and(|star| matches!(star.kind, LandmarkKind::Identity(_)))
        });
        Self { n_named: named.count(), alignments }
    }

    /// Whether something that no other place has says that it is this place.
    fn is_named(&self) -> bool {
        N_NAMED_MIN <= self.n_named
    }
}

fn verdict(found: &Judged, limits: Limits) -> v1::MergeVerdict {
    let is_enough = limits.accepts_nameless || found.is_named();
    let found = &found.alignments;
    let Some(best) = found.ranked.first().filter(|_| found.is_enough) else {
        return if found.is_enough {
            v1::MergeVerdict::NoOverlap
        } else {
            v1::MergeVerdict::NotEnoughSeen
        };
    };
    if best.log_evidence < -limits.log_odds_min {
        v1::MergeVerdict::NoOverlap
    } else if best.log_odds < limits.log_odds_min {
        v1::MergeVerdict::Ambiguous
    } else if limits.contradiction_max < contradiction(best) || !is_enough {
        v1::MergeVerdict::Proposed
    } else {
        v1::MergeVerdict::Merged
    }
}

fn reasons(judged: &Judged, limits: Limits) -> Vec<String> {
    let found = &judged.alignments;
    let Some(best) = found.ranked.first().filter(|_| found.is_enough) else {
        let text = if found.is_enough {
            "its landmarks fit nowhere"
        } else {
            "too few landmarks were seen to tell"
        };
        return vec![text.to_owned()];
    };
    let Limits { log_odds_min, contradiction_max, accepts_nameless } = limits;
    let (log_odds, share) = (best.log_odds, 100.0 * contradiction(best));
    let mut reasons = vec![format!(
        "{} landmarks are the same, {} should have been seen and were not ({share:.0} %, allowed are {:.0} %)",
        best.n_matched,
        best.n_contradicted,
        100.0 * contradiction_max
    )];
    reasons.push(format!("log odds {log_odds:.1} against all else, needed are {log_odds_min:.1}"));
    if !accepts_nameless && !judged.is_named() {
        reasons.push(format!(
            "{} of them have names, {N_NAMED_MIN} are needed: landmarks that look alike may look so \
             elsewhere too, so that a person has to know that this is the place",
            judged.n_named
        ));
    }
    if found.is_repeated {
        reasons
            .push("such a pattern is repeated there: it may be a place nobody has seen".to_owned());
    }
    reasons
}
