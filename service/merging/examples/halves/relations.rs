//! Relations between poses at two stamps, held against an alignment.

use std::collections::BTreeMap;
use std::error::Error;

use meetpoint_geometry::Pose;

use crate::log::stamp_ns;

/// How poses at two stamps relate.
pub(crate) struct Relations(Vec<(i64, i64, Pose)>);

/// Errors of relations across a cut.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Across {
    pub(crate) n: usize,
    pub(crate) mean_m: f64,
    pub(crate) mean_deg: f64,
}

/// Transforms that are tried.
const N_TRIED_MAX: usize = 100;
/// Stamps may differ by as much, in nanoseconds.
const TOLERANCE_NS: i64 = 100_000;

impl Relations {
    /// From a file of lines `t1 t2 x y z roll pitch yaw`.
    pub(crate) fn read(path: &str) -> Result<Self, Box<dyn Error>> {
        let text = std::fs::read_to_string(path)?;
        let lines = text.lines().map(|line| line.split_whitespace().collect::<Vec<_>>());
        let relation = |words: Vec<&str>| -> Result<_, Box<dyn Error>> {
            let [from, to, x, y, _, _, _, yaw] = words.as_slice() else {
                return Err("8 words".into());
            };
            Ok((stamp_ns(from)?, stamp_ns(to)?, Pose::new(x.parse()?, y.parse()?, yaw.parse()?)))
        };
        lines.filter(|words| !words.is_empty()).map(relation).collect::<Result<_, _>>().map(Self)
    }

    /// The transform of `b` into the frame of `a` that relations across agree with best: of what some of
    /// them say, that with the least mean error.
    pub(crate) fn best(&self, a: &BTreeMap<i64, Pose>, b: &BTreeMap<i64, Pose>) -> Option<Pose> {
        let said = self.pairs(a, b).map(|(relation, a, b, is_back)| {
            let a_from_b = if is_back { relation.inverse() } else { relation };
            a * a_from_b * b.inverse()
        });
        let said: Vec<Pose> = said.collect();
        let stride = said.len().div_ceil(N_TRIED_MAX).max(1);
        let error_m = |pose: &Pose| {
            let placed = b.iter().map(|(&at, &b)| (at, *pose * b)).collect();
            self.across(a, &placed).mean_m
        };
        let tried = said.into_iter().step_by(stride).map(|pose| (error_m(&pose), pose));
        tried.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, pose)| pose)
    }

    /// Relations across, with the poses of both ends: that in `a` first; whether the relation is of that
    /// seen from the one in `b`.
    fn pairs(
        &self,
        a: &BTreeMap<i64, Pose>,
        b: &BTreeMap<i64, Pose>,
    ) -> impl Iterator<Item = (Pose, Pose, Pose, bool)> {
        let near = |poses: &BTreeMap<i64, Pose>, stamp_ns: i64| {
            let range = poses.range(stamp_ns - TOLERANCE_NS..=stamp_ns + TOLERANCE_NS);
            range.min_by_key(|(at, _)| at.abs_diff(stamp_ns)).map(|(_, &pose)| pose)
        };
        self.0.iter().filter_map(move |&(from, to, relation)| {
            let there = near(a, from).zip(near(b, to)).map(|(a, b)| (relation, a, b, false));
            there.or_else(|| Some((relation, near(a, to)?, near(b, from)?, true)))
        })
    }

    /// Of those whose one end is in the one and whose other in the other: poses by stamp, in one frame.
    pub(crate) fn across(&self, a: &BTreeMap<i64, Pose>, b: &BTreeMap<i64, Pose>) -> Across {
        let mut across = Across::default();
        for (relation, a, b, is_back) in self.pairs(a, b) {
            let error = relation.step_to(if is_back { b.step_to(a) } else { a.step_to(b) });
            across.n += 1;
            across.mean_m += error.distance_m();
            across.mean_deg += error.theta_rad.abs().to_degrees();
        }
        let n = across.n.max(1) as f64;
        Across { mean_m: across.mean_m / n, mean_deg: across.mean_deg / n, ..across }
    }
}
