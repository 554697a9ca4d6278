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

    /// Of those whose one end is in the one and whose other in the other: poses by stamp, in one frame.
    pub(crate) fn across(&self, a: &BTreeMap<i64, Pose>, b: &BTreeMap<i64, Pose>) -> Across {
        let near = |poses: &BTreeMap<i64, Pose>, stamp_ns: i64| {
            let range = poses.range(stamp_ns - TOLERANCE_NS..=stamp_ns + TOLERANCE_NS);
            range.min_by_key(|(at, _)| at.abs_diff(stamp_ns)).map(|(_, &pose)| pose)
        };
        let mut across = Across::default();
        for &(from, to, relation) in &self.0 {
            let there = near(a, from).zip(near(b, to)).map(|(a, b)| relation.step_to(a.step_to(b)));
            let back = near(b, from).zip(near(a, to)).map(|(b, a)| relation.step_to(b.step_to(a)));
            let Some(error) = there.or(back) else { continue };
            across.n += 1;
            across.mean_m += error.distance_m();
            across.mean_deg += error.theta_rad.abs().to_degrees();
        }
        let n = across.n.max(1) as f64;
        Across { mean_m: across.mean_m / n, mean_deg: across.mean_deg / n, ..across }
    }
}
