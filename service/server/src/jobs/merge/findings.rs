//! What a job makes of its searches: a merge for each session, and what rules decide about it.
//!
//! A rule decides only where nobody has decided before, and only what is beyond doubt: where the
//! alignments of several parts contradict one another around a ring, a person has to look.

use meetpoint_merging::{Alignments, PairAlignment, PairFate, Reason, Verdict, placed};
use meetpoint_proto::v1;
use meetpoint_storage::{NewMerge, SessionId};
use prost::Message;
use uuid::Uuid;

use super::constellations::LandmarksFound;
use super::parts::{Newcomer, Parts};
use super::searching::Searched;
use crate::clock;
use crate::convert::merge;
use crate::convert::merge_decision::{Deciding, MergeDecided};
use crate::error::Error;
use crate::merging::Known;
use crate::settings::MergingSettings;

/// Why no rule merges a session that has sonars only: said first.
const SONAR_ONLY: &str = "sonar only: walls that are heard lie decimetres off and rooms look alike, \
                          so that a person has to decide";

/// Who decides where nobody does.
const BY_RULE: &str = "rule";

/// How a job was asked for.
pub(super) struct Asked<'a> {
    pub(super) rules: &'a MergingSettings,
    /// Whether the oldest session's frame is to be the map's where the map is empty.
    pub(super) founds_map: bool,
}

/// What is to be recorded and told.
pub(super) struct Findings {
    pub(super) merges: Vec<NewMerge>,
    /// With what rules decide.
    pub(super) known: Known,
    pub(super) told: Vec<v1::MergedSession>,
    /// Sessions that rules put somewhere.
    pub(super) placed: Vec<SessionId>,
    /// For people.
    pub(super) lines: Vec<String>,
}

/// What speaks for one session.
#[derive(Clone, Debug, PartialEq)]
struct Found {
    verdict: v1::MergeVerdict,
    reasons: Vec<String>,
    alignments: Vec<v1::MergeAlignment>,
}

impl Findings {
    /// Judges all newcomers together, and decides by rule.
    ///
    /// # Errors
    /// [`Error::Internal`] for places that no search has made.
    pub(super) fn new(
        parts: &Parts,
        searched: &Searched,
        asked: &Asked<'_>,
        known: Known,
    ) -> Result<Self, Error> {
        let mut found = judged(parts, searched);
        let founds = founds(parts, &found, asked);
        // The oldest that has drawn anything; its frame would be the map's.
        let is_base = |index: usize| {
            let found = searched.by_landmarks.get(index).and_then(Option::as_ref);
            found.is_some_and(|found| found.is_base)
        };
        let founder = (0..parts.newcomers.len())
            .find(|&index| parts.newcomers[index].part.is_some() || is_base(index));
        let founder = founder.filter(|_| parts.site.is_none());
        if let Some(index) = founder {
            found[index].alignments = vec![merge::founding(parts.newcomers[index].session)];
            if founds {
                found[index].verdict = v1::MergeVerdict::Merged;
                found[index].reasons = vec!["the map is empty, and takes its frame".to_owned()];
            }
        }
        let (merges, told, placed, lines) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let mut findings = Self { merges, known, told, placed, lines };
        for (index, (newcomer, found)) in parts.newcomers.iter().zip(found).enumerate() {
            let is_asked = founder == Some(index) && asked.founds_map;
            let accepts = (asked.rules.accepts || is_asked)
                && newcomer.may_accept
                && found.verdict == v1::MergeVerdict::Merged;
            findings.add(parts, newcomer, found, accepts)?;
        }
        Ok(findings)
    }

    fn add(
        &mut self,
        parts: &Parts,
        newcomer: &Newcomer,
        found: Found,
        accepts: bool,
    ) -> Result<(), Error> {
        let Found { verdict, reasons, alignments } = found;
        let (session, id) = (newcomer.session, merge::id_of(newcomer.session));
        let first = alignments.first().filter(|_| accepts);
        if let Some(first) = first {
            let (onto, onto_from_session) = merge::place(first)?;
            let alignment = Uuid::parse_str(&first.id).map_err(Error::internal)?;
            let what = Deciding::Accepted { alignment, onto, onto_from_session };
            let (author, reason) = (BY_RULE.to_owned(), reasons.join("; "));
            self.placed.push(session);
            let merge = id;
            self.known.decide(&MergeDecided {
                merge,
                session,
                what,
                by_rule: true,
                author,
                reason,
            });
        }
        self.lines.push(line(newcomer, verdict, &reasons, first));
        self.told.push(v1::MergedSession {
            session: session.0.to_string(),
            merge: id.0.to_string(),
            verdict: verdict.into(),
            accepted: first.is_some(),
        });
        let payload = v1::Merge {
            verdict: verdict.into(),
            reasons,
            alignments,
            map_version: parts.version,
            update_time_ns: clock::now_ns(),
            ..v1::Merge::default()
        };
        self.merges.push(NewMerge {
            id,
            session,
            n_poses: newcomer.n_poses,
            n_scans_drawn: parts.n_scans_drawn,
            payload: payload.encode_to_vec(),
        });
        Ok(())
    }
}

/// What speaks for each newcomer: the best of what was found in the map and in older ones, unless that
/// contradicts what else was found.
fn judged(parts: &Parts, searched: &Searched) -> Vec<Found> {
    let fates = fates(parts.newcomers.len(), searched);
    (0..parts.newcomers.len()).map(|index| judged_one(parts, searched, (index, &fates))).collect()
}

fn judged_one(
    parts: &Parts,
    searched: &Searched,
    (index, fates): (usize, &[(usize, PairFate)]),
) -> Found {
    let newcomer = &parts.newcomers[index];
    if let Some(Some(found)) = searched.by_landmarks.get(index) {
        let LandmarksFound { verdict, reasons, alignments, is_base: _ } = found.clone();
        return Found { verdict, reasons, alignments };
    }
    let candidates = candidates(index, searched);
    let Some(best) = candidates.iter().min_by(|a, b| a.rank().total_cmp(&b.rank())) else {
        return nothing_drawn(newcomer);
    };
    let onto = best.onto.map(|older| parts.newcomers[older].session);
    let mut found = best.found(newcomer.session, onto);
    let rings = fates.iter().filter(|(younger, _)| *younger == index);
    let broken = rings.filter_map(|(_, fate)| match *fate {
        PairFate::Inconsistent { error_m, error_rad } => {
            Some(Reason::Inconsistent { error_m, error_rad }.to_string())
        }
        PairFate::Places | PairFate::Confirms { .. } => None,
    });
    let broken: Vec<String> = broken.collect();
    if !broken.is_empty() && found.verdict == v1::MergeVerdict::Merged {
        found.verdict = v1::MergeVerdict::Ambiguous;
        found.reasons = broken;
    }
    let is_onto_heard = best.onto.is_some_and(|older| parts.newcomers[older].hears_only);
    if newcomer.hears_only || is_onto_heard { heard(found) } else { found }
}

/// What was found of walls that were heard: at most a proposal, since the rules' limits were measured on walls
/// that were seen.
fn heard(found: Found) -> Found {
    let verdict = match found.verdict {
        v1::MergeVerdict::Merged => v1::MergeVerdict::Proposed,
        verdict => verdict,
    };
    let reasons = std::iter::once(SONAR_ONLY.to_owned()).chain(found.reasons).collect();
    Found { verdict, reasons, ..found }
}

/// What was found of a newcomer in one part.
struct Candidate<'a> {
    /// The older newcomer; `None` for the map.
    onto: Option<usize>,
    found: &'a Alignments,
}

impl Candidate<'_> {
    /// The least is the best: by verdict, the map before others, then by the odds.
    fn rank(&self) -> f64 {
        let verdict = match self.found.verdict {
            Verdict::Merged => 0.0,
            Verdict::Proposed => 1.0,
            Verdict::Ambiguous => 2.0,
            Verdict::NoOverlap => 3.0,
            Verdict::NotEnoughSeen => 4.0,
        };
        let log_odds = self.found.ranked.first().map_or(0.0, |first| first.log_odds.max(0.0));
        let of_odds = 0.5 / (1.0 + log_odds);
        verdict + if self.onto.is_none() { 0.0 } else { 0.25 + of_odds }
    }

    fn found(&self, session: SessionId, onto: Option<SessionId>) -> Found {
        let alignments = self.found.ranked.iter();
        Found {
            verdict: merge::verdict(self.found.verdict),
            reasons: self.found.reasons.iter().map(ToString::to_string).collect(),
            alignments: alignments.map(|found| merge::alignment(session, onto, found)).collect(),
        }
    }
}

fn candidates(newcomer: usize, searched: &Searched) -> Vec<Candidate<'_>> {
    let in_site = searched.in_site.get(newcomer).and_then(Option::as_ref);
    let in_site = in_site.map(|found| Candidate { onto: None, found });
    let in_others = searched.in_others.iter().filter(|([_, younger], _)| *younger == newcomer);
    let in_others = in_others.map(|([older, _], found)| Candidate { onto: Some(*older), found });
    in_site.into_iter().chain(in_others).collect()
}

fn nothing_drawn(newcomer: &Newcomer) -> Found {
    let reason = match newcomer.part {
        Some(_) => "nothing is drawn in the map yet, and no other session is there to lie on",
        None => "it has drawn nothing yet",
    };
    Found {
        verdict: v1::MergeVerdict::NotEnoughSeen,
        reasons: vec![reason.to_owned()],
        alignments: Vec::new(),
    }
}

/// What becomes of each alignment that is beyond doubt when all are taken together, with the number of
/// the newcomer that it places.
fn fates(n_newcomers: usize, searched: &Searched) -> Vec<(usize, PairFate)> {
    // Part 0 is the map.
    let pair = |a: usize, b: usize, found: &Alignments| {
        let first = found.ranked.first().filter(|_| found.verdict == Verdict::Merged)?;
        let (a_from_b, covariance) = (first.site_from_newcomer, first.covariance);
        Some(PairAlignment { a, b, a_from_b, covariance, log_odds: first.log_odds })
    };
    let in_site = searched.in_site.iter().enumerate();
    let in_site = in_site.filter_map(|(index, found)| pair(0, index + 1, found.as_ref()?));
    let in_others = searched.in_others.iter();
    let in_others =
        in_others.filter_map(|([older, younger], found)| pair(older + 1, younger + 1, found));
    let pairs: Vec<PairAlignment> = in_site.chain(in_others).collect();
    let placement = placed(n_newcomers + 1, &pairs);
    pairs.iter().map(|pair| pair.b - 1).zip(placement.pairs).collect()
}

/// True if the frame of the oldest newcomer is to become that of the map.
fn founds(parts: &Parts, found: &[Found], asked: &Asked<'_>) -> bool {
    let lies_on_another = |found: &Found| {
        let onto = found.alignments.first().map(|first| !first.onto_session.is_empty());
        found.verdict == v1::MergeVerdict::Merged && onto == Some(true)
    };
    let is_empty = parts.site.is_none() && !parts.has_placed;
    is_empty && (asked.founds_map || (asked.rules.founds_map && found.iter().any(lies_on_another)))
}

/// What came of a session, for people.
fn line(
    newcomer: &Newcomer,
    verdict: v1::MergeVerdict,
    reasons: &[String],
    accepted: Option<&v1::MergeAlignment>,
) -> String {
    let said = verdict.as_str_name().trim_start_matches("MERGE_VERDICT_");
    let Newcomer { session, robot, .. } = newcomer;
    let done = accepted.map_or_else(String::new, |first| {
        let v1::Pose { x_m, y_m, theta_rad } = first.onto_from_session.unwrap_or_default();
        let turn_deg = theta_rad.to_degrees();
        format!("; accepted by rule: it begins at ({x_m:.2}, {y_m:.2}) m, turned by {turn_deg:.1}°")
    });
    format!("{robot}, session {session}: {said}: {}{done}", reasons.join("; "))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use meetpoint_geometry::Pose;
    use meetpoint_merging::{Alignment, AlignmentParams, Part, SearchFigures};
    use meetpoint_occupancy::Grid;

    use super::*;

    fn part() -> Arc<Part> {
        let frame = meetpoint_geometry::GridFrame::new(0.1).expect("a length");
        Arc::new(Part::of_grid(&Grid::new(frame), &AlignmentParams::INDOOR))
    }

    fn parts(n: u128, has_site: bool) -> Parts {
        let newcomer = |id| Newcomer {
            session: SessionId(Uuid::from_u128(id)),
            robot: format!("robot {id}"),
            n_poses: 7,
            may_accept: true,
            hears_only: false,
            part: Some(part()),
        };
        Parts {
            version: 3,
            n_scans_drawn: 9,
            has_placed: has_site,
            starred: Vec::new(),
            site: has_site.then(part),
            newcomers: (0..n).map(newcomer).collect(),
        }
    }

    fn found(verdict: Verdict, x_m: f64, log_odds: f64) -> Alignments {
        let first = Alignment {
            site_from_newcomer: Pose::new(x_m, 0.0, 0.0),
            covariance: [[1e-4, 0.0, 0.0], [0.0, 1e-4, 0.0], [0.0, 0.0, 1e-6]],
            log_odds,
            margin: None,
            overlap_m2: 50.0,
            overlap_share: 0.5,
            agreement: 0.9,
            contradiction: 0.0,
            n_named: 0,
            n_named_agreeing: 0,
            n_nameless_agreeing: 0,
            n_nameless_alone: 0,
        };
        let (ranked, figures) = (vec![first], SearchFigures::default());
        Alignments { verdict, reasons: Vec::new(), ranked, figures }
    }

    fn verdicts(found: &[Found]) -> Vec<v1::MergeVerdict> {
        found.iter().map(|found| found.verdict).collect()
    }

    #[test]
    fn the_map_goes_before_others_and_others_before_nothing() {
        let searched = Searched {
            in_site: vec![
                Some(found(Verdict::NoOverlap, 0.0, 1.0)),
                Some(found(Verdict::NoOverlap, 0.0, 1.0)),
            ],
            in_others: vec![([0, 1], found(Verdict::Merged, 5.0, 40.0))],
            ..Searched::default()
        };
        let judged = judged(&parts(2, true), &searched);
        let expected = [v1::MergeVerdict::NoOverlap, v1::MergeVerdict::Merged];
        assert_eq!(verdicts(&judged), expected, "the younger lies on the older");
        let onto = &judged[1].alignments[0].onto_session;
        assert_eq!(*onto, Uuid::from_u128(0).to_string(), "by name");
    }

    #[test]
    fn what_is_heard_only_is_left_to_people_and_says_so() {
        let found = |verdict| Searched {
            in_site: vec![Some(found(verdict, 1.0, 90.0))],
            ..Searched::default()
        };
        let mut parts = parts(1, true);
        parts.newcomers[0].hears_only = true;
        let merged = judged(&parts, &found(Verdict::Merged));
        assert_eq!(verdicts(&merged), [v1::MergeVerdict::Proposed], "not by rule");
        assert_eq!(merged[0].reasons[0], SONAR_ONLY, "why");
        assert_eq!(merged[0].alignments.len(), 1, "a person may accept it");
        let nowhere = judged(&parts, &found(Verdict::NoOverlap));
        assert_eq!(verdicts(&nowhere), [v1::MergeVerdict::NoOverlap], "as it is");
    }

    #[test]
    fn a_ring_that_does_not_close_is_left_to_people() {
        let ring = |x_m| Searched {
            in_site: vec![
                Some(found(Verdict::Merged, 1.0, 90.0)),
                Some(found(Verdict::Merged, 3.0, 40.0)),
            ],
            in_others: vec![([0, 1], found(Verdict::Merged, x_m, 60.0))],
            ..Searched::default()
        };
        let merged = v1::MergeVerdict::Merged;
        let closed = judged(&parts(2, true), &ring(2.0));
        assert_eq!(verdicts(&closed), [merged; 2], "1 m and 2 m are 3 m");
        assert_eq!(closed[1].alignments[0].onto_session, "", "in the map");
        let broken = judged(&parts(2, true), &ring(7.0));
        assert_eq!(verdicts(&broken), [merged, v1::MergeVerdict::Ambiguous], "8 m are not 3 m");
        assert!(broken[1].reasons[0].contains("5.00 m"), "how far off: {:?}", broken[1].reasons);
    }

    #[test]
    fn an_empty_map_takes_a_frame_where_two_meet() {
        let rules = crate::settings::read(None, std::iter::empty()).expect("compiled in").merging;
        let asked = |founds_map| Asked { rules: &rules, founds_map };
        let alone = Searched { in_site: vec![None], in_others: Vec::new(), ..Searched::default() };
        let one = parts(1, false);
        let judged_alone = judged(&one, &alone);
        assert_eq!(verdicts(&judged_alone), [v1::MergeVerdict::NotEnoughSeen], "nothing there");
        assert!(!founds(&one, &judged_alone, &asked(false)), "others may know where they start");
        assert!(founds(&one, &judged_alone, &asked(true)), "a person knows better");
        let two = Searched {
            in_site: vec![None, None],
            in_others: vec![([0, 1], found(Verdict::Merged, 5.0, 40.0))],
            ..Searched::default()
        };
        let mut both = parts(2, false);
        let judged_both = judged(&both, &two);
        assert!(founds(&both, &judged_both, &asked(false)), "they meet");
        both.has_placed = true;
        assert!(!founds(&both, &judged_both, &asked(false)), "somebody knows where he starts");
    }
}
