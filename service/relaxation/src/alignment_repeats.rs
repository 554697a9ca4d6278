//! Patterns that repeat: doors at equal distances, identical wings, a room like twenty others.
//!
//! Where what two maps have in common is found a second time within one of them, a building repeats
//! itself, and what looks like the same place may be a third one that is in one of the maps only.
//! That explanation costs the chance that it repeats once more, and loses what is matched and not
//! repeated:
//!
//! ```text
//! ln P(repeats)  =  ln P(placement)  -  sum of gains of what is not repeated  +  ln share
//! ```

use meetpoint_geometry::Pose;

use crate::alignment::placements;
use crate::alignment_fit::{Fitted, Judge};
use crate::constellation::{Constellation, Star};
use crate::coverage::Coverage;

/// Repetitions within a map that are looked at.
const N_REPEATS_MAX: usize = 5;

/// Logarithm of the evidence for a place that only looks like the one that a placement says; `None`
/// if neither map repeats what is matched.
pub(crate) fn log_evidence_of_repeats(judge: &Judge<'_>, best: &Fitted) -> Option<f64> {
    let of_site: Vec<usize> = best.matches.iter().map(|it| it.site).collect();
    let of_other: Vec<usize> = best.matches.iter().map(|it| it.other).collect();
    let mut logs = repeats(judge, judge.site, (&of_site, best));
    logs.extend(repeats(judge, judge.other, (&of_other, best)));
    // Repetitions of a repetition are no further places: the best counts.
    logs.into_iter().max_by(f64::total_cmp)
}

/// The same for each repetition within one of the maps, whose matched landmarks have these indices.
fn repeats(
    judge: &Judge<'_>,
    map: &Constellation,
    (matched, best): (&[usize], &Fitted),
) -> Vec<f64> {
    // What was matched is laid over all of its own map; where it was looked for says nothing here.
    let stars: Vec<Star> = matched.iter().map(|&index| map.stars[index].clone()).collect();
    let pattern = Constellation { stars, coverage: Coverage::default() };
    let itself = Judge::new(map, &pattern, judge.params);
    let is_elsewhere = |placed: Pose| {
        let off_m =
            pattern.stars.iter().map(|star| (placed * star.position - star.position).norm());
        let mean_m = off_m.sum::<f64>() / pattern.stars.len().max(1) as f64;
        judge.params.apart_m < mean_m
    };
    let found = placements(&itself, is_elsewhere).into_iter().take(N_REPEATS_MAX);
    let is_proven = found.filter(|again| 0.0 < again.log_evidence);
    is_proven
        .map(|again| {
            let is_repeated = |index: usize| again.matches.iter().any(|it| it.other == index);
            let lost = best.matches.iter().enumerate().filter(|(index, _)| !is_repeated(*index));
            let lost: f64 = lost.map(|(_, it)| it.gain.max(0.0)).sum();
            best.log_evidence - lost + judge.params.repeats_share.ln()
        })
        .collect()
}
