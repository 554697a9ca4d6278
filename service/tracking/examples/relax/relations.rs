//! Errors of a trajectory against relations between its poses: R. Kuemmerle et al., "On measuring the
//! accuracy of SLAM algorithms", Autonomous Robots 27 (2009).

use std::collections::BTreeMap;
use std::error::Error;
use std::fmt;

use meetpoint_geometry::Pose;

use crate::log::stamp_ns;

/// How poses at two stamps relate.
pub(crate) struct Relations(Vec<(i64, i64, Pose)>);

/// Mean absolute errors.
pub(crate) struct Errors {
    n: usize,
    n_missing: usize,
    translation_m: f64,
    translation_max_m: f64,
    rotation_deg: f64,
    n_far: usize,
    far_translation_m: f64,
}

/// Stamps may differ by as much, in nanoseconds.
const TOLERANCE_NS: i64 = 100_000;
/// Relations across more than this show loops, in nanoseconds.
const FAR_NS: i64 = 60_000_000_000;

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

    /// Those whose two stamps lie on different sides of one.
    pub(crate) fn across(&self, cut_ns: i64) -> Self {
        let is_across = |&&(from, to, _): &&(i64, i64, Pose)| (from < cut_ns) != (to < cut_ns);
        Self(self.0.iter().filter(is_across).copied().collect())
    }

    /// Errors of poses by stamp.
    pub(crate) fn errors(&self, poses: &BTreeMap<i64, Pose>) -> Errors {
        let near = |stamp_ns: i64| {
            let range = poses.range(stamp_ns - TOLERANCE_NS..=stamp_ns + TOLERANCE_NS);
            range.min_by_key(|(at, _)| at.abs_diff(stamp_ns)).map(|(_, &pose)| pose)
        };
        let mut errors = Errors {
            n: 0,
            n_missing: 0,
            translation_m: 0.0,
            translation_max_m: 0.0,
            rotation_deg: 0.0,
            n_far: 0,
            far_translation_m: 0.0,
        };
        for &(from, to, relation) in &self.0 {
            let (Some(a), Some(b)) = (near(from), near(to)) else {
                errors.n_missing += 1;
                continue;
            };
            let error = relation.step_to(a.step_to(b));
            errors.n += 1;
            errors.translation_m += error.distance_m();
            errors.translation_max_m = errors.translation_max_m.max(error.distance_m());
            errors.rotation_deg += error.theta_rad.abs().to_degrees();
            if FAR_NS < (to - from).abs() {
                errors.n_far += 1;
                errors.far_translation_m += error.distance_m();
            }
        }
        errors
    }
}

impl fmt::Display for Errors {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let n = self.n.max(1) as f64;
        write!(
            formatter,
            "{:.4} m (max {:.3}), {:.3} deg; far apart {:.4} m of {}; {} relations, {} missing",
            self.translation_m / n,
            self.translation_max_m,
            self.rotation_deg / n,
            self.far_translation_m / self.n_far.max(1) as f64,
            self.n_far,
            self.n,
            self.n_missing,
        )
    }
}
