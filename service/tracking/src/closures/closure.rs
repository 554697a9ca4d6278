//! Closures: that two moments of travels are near one another, by what was seen.

use meetpoint_geometry::Pose;
use nalgebra::Vector3;

/// A moment of a travel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ClosureMoment {
    /// The travel's place among those that are relaxed together.
    pub travel: usize,
    /// Stamp of the moment's scan, in nanoseconds of the clock of that travel's robot.
    pub stamp_ns: i64,
}

/// The two moments that a closure joins. The same travels and parameters give the same keys.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ClosureKey {
    /// The earlier moment, or that on the travel that comes before the other in their list.
    pub from: ClosureMoment,
    /// The later one.
    pub to: ClosureMoment,
}

/// What became of a closure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The poses rest on it.
    Accepted,
    /// They do not.
    Refused(Refusal),
}

/// Why a closure was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// An operator switched it off.
    SwitchedOff,
    /// Another pose within reach explains what was seen nearly as well, and not all such poses lie on one
    /// line: across a line a closure says something all the same.
    Ambiguous,
    /// Too few of the scans taken there agree by themselves.
    FewScansAgree,
    /// What was seen from one moment contradicts what was seen from the other.
    Contradicted,
    /// It is far from what the way driven says, and no other closure says the same.
    Unsupported,
    /// The other closures and the way driven say otherwise.
    Inconsistent,
}

/// A closure that was considered: the robot at two moments, and how the two poses relate by what was
/// seen.
#[derive(Clone, Debug, PartialEq)]
pub struct Closure {
    /// Which moments.
    pub key: ClosureKey,
    /// Pose at the second moment seen from the first, by matching.
    pub from_to: Pose,
    /// Covariance of the three numbers of `from_to`: x, y in metres, theta in radians, row by row. Of a
    /// closure that says nothing along a line, as in a bare corridor, it is some 100 m along it.
    pub covariance: [[f64; 3]; 3],
    /// Mean agreement of what was seen at both, in 0..=1.
    pub score: f64,
    /// Poses found within reach that nearly agree as well, with their scores; best first. Empty for
    /// a closure that is beyond doubt; of one that was accepted, they lie along its open line or what else
    /// is known speaks against them.
    pub alternatives: Vec<(Pose, f64)>,
    /// Distance between `from_to` and what the relaxed poses say, in metres.
    pub residual_m: f64,
    /// The same for the heading, in radians, not negative.
    pub residual_rad: f64,
    /// Square of the residual in units of the covariance; of three degrees of freedom.
    pub chi2: f64,
    /// What became of it.
    pub verdict: Verdict,
}

impl Closure {
    /// The same with what the relaxed poses say of it: difference, its square in units of the covariance,
    /// and what became of it.
    pub(crate) fn judged(self, (error, chi2): (Vector3<f64>, f64), verdict: Verdict) -> Self {
        let (residual_m, residual_rad) = (error.x.hypot(error.y), error.z.abs());
        Self { residual_m, residual_rad, chi2, verdict, ..self }
    }
}
