//! Error of a trajectory against relations between poses.
//!
//! R. Kümmerle et al., "On measuring the accuracy of SLAM algorithms", Autonomous Robots 27 (2009):
//! a relation is the true pose at one time seen from the true pose at another; the error of an
//! estimate is what is left after taking the relation off, averaged over all relations.

use std::collections::BTreeMap;

use anyhow::Context;
use meetpoint_geometry::Pose;

/// Stamps of a relation and of a scan that differ by less are the same, in nanoseconds: relation
/// files are written with fewer digits.
const TOLERANCE_NS: i64 = 100_000;

/// The true pose at `to` seen from the true pose at `from`.
pub(super) struct Relation {
    from_ns: i64,
    to_ns: i64,
    step: Pose,
}

/// Errors over all relations.
pub(super) struct Errors {
    /// Relations with both poses.
    pub(super) n: usize,
    /// Relations that lack one.
    pub(super) n_missing: usize,
    /// Mean absolute translational error, in metres.
    pub(super) translation_m: f64,
    /// Mean absolute rotational error, in radians.
    pub(super) rotation_rad: f64,
}

/// Reads lines of `t1 t2 x y z roll pitch yaw`: seconds, metres, radians; `#` begins a comment.
pub(super) fn read(text: &str) -> anyhow::Result<Vec<Relation>> {
    let lines = text.lines().enumerate().filter(|(_, line)| {
        let line = line.trim_start();
        !line.is_empty() && !line.starts_with('#')
    });
    lines
        .map(|(index, line)| {
            relation(line).with_context(|| format!("line {} is no relation", index + 1))
        })
        .collect()
}

fn relation(line: &str) -> Option<Relation> {
    let words: Vec<f64> = line.split_whitespace().map(str::parse).collect::<Result<_, _>>().ok()?;
    let [from_s, to_s, x_m, y_m, _, _, _, theta_rad] = words[..] else { return None };
    Some(Relation {
        from_ns: nanoseconds(from_s),
        to_ns: nanoseconds(to_s),
        step: Pose::new(x_m, y_m, theta_rad),
    })
}

#[expect(clippy::cast_possible_truncation, reason = "stamps of this century fit; others saturate")]
fn nanoseconds(seconds: f64) -> i64 {
    (seconds * 1e9).round() as i64
}

impl Relation {
    /// Whether it leads across a time: one end lies before it and the other at it or after.
    pub(super) fn leads_across(&self, time_ns: i64) -> bool {
        (self.from_ns < time_ns) != (self.to_ns < time_ns)
    }

    /// Time between its ends, in nanoseconds.
    pub(super) fn gap_ns(&self) -> i64 {
        self.to_ns.saturating_sub(self.from_ns).saturating_abs()
    }

    /// By how much the robot turned from one end to the other, in radians.
    pub(super) fn turn_rad(&self) -> f64 {
        self.step.theta_rad
    }
}

/// What is left of each relation that has both poses: metres and radians.
pub(super) fn residuals(poses: &BTreeMap<i64, Pose>, relations: &[&Relation]) -> Vec<(f64, f64)> {
    let off = relations.iter().filter_map(|relation| left(poses, relation));
    off.map(|off| (off.distance_m(), off.theta_rad.abs())).collect()
}

/// What is left of a relation: the estimated step seen from its end. `None` if a pose is missing.
pub(super) fn left(poses: &BTreeMap<i64, Pose>, relation: &Relation) -> Option<Pose> {
    let from = at(poses, relation.from_ns)?;
    let to = at(poses, relation.to_ns)?;
    Some(relation.step.inverse() * from.step_to(to))
}

/// The errors that these residuals of so many relations come to. `None` if there are none.
pub(super) fn errors(off: &[(f64, f64)], n_relations: usize) -> Option<Errors> {
    let n = off.len();
    if n == 0 {
        return None;
    }
    Some(Errors {
        n,
        n_missing: n_relations - n,
        translation_m: off.iter().map(|(metres, _)| metres).sum::<f64>() / n as f64,
        rotation_rad: off.iter().map(|(_, radians)| radians).sum::<f64>() / n as f64,
    })
}

/// The pose whose stamp is nearest, if it is the same.
fn at(poses: &BTreeMap<i64, Pose>, stamp_ns: i64) -> Option<Pose> {
    let near = poses.range(stamp_ns - TOLERANCE_NS..=stamp_ns + TOLERANCE_NS);
    near.min_by_key(|(stamp, _)| (*stamp - stamp_ns).abs()).map(|(_, pose)| *pose)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of_all(poses: &BTreeMap<i64, Pose>, relations: &[Relation]) -> Option<Errors> {
        let all: Vec<&Relation> = relations.iter().collect();
        errors(&residuals(poses, &all), all.len())
    }

    #[test]
    fn a_true_trajectory_has_no_error() {
        let relations = read("# t1 t2 x y z roll pitch yaw\n1.0 2.0 1 0 0 0 0 1.5\n").expect("one");
        let start = Pose::new(3.0, -2.0, 0.7);
        let poses = BTreeMap::from([
            (1_000_000_000, start),
            (2_000_000_040, start * Pose::new(1.0, 0.0, 1.5)),
        ]);
        let errors = of_all(&poses, &relations).expect("both poses are there");
        assert_eq!((errors.n, errors.n_missing), (1, 0), "40 ns off is the same time");
        assert_eq!(relations[0].gap_ns(), 1_000_000_000, "a second");
        let across = [999_999_999, 1_500_000_000, 2_000_000_000, 2_000_000_001];
        let across = across.map(|time_ns| relations[0].leads_across(time_ns));
        assert_eq!(across, [false, true, true, false], "between its ends, the later included");
        assert!(errors.translation_m < 1e-12 && errors.rotation_rad < 1e-12, "no error");
    }

    #[test]
    fn says_what_is_missing_and_where_it_is_wrong() {
        let relations = read("1 2 1 0 0 0 0 0\n1 3 1 0 0 0 0 0\n").expect("two");
        let poses = BTreeMap::from([
            (1_000_000_000, Pose::IDENTITY),
            (2_000_000_000, Pose::new(1.5, 0.0, 0.0)),
        ]);
        let errors = of_all(&poses, &relations).expect("one is there");
        assert_eq!((errors.n, errors.n_missing), (1, 1), "no pose at 3 s");
        assert!((errors.translation_m - 0.5).abs() < 1e-12, "half a metre too far");
        let wrong = read("1 2 1 0\n").err().map(|error| error.to_string());
        assert_eq!(wrong.as_deref(), Some("line 1 is no relation"), "the line is named");
    }
}
