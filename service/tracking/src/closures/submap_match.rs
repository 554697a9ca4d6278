//! Two submaps laid over one another: the pose that fits best, and how sure it is.
//!
//! Each scan of the one is matched with the scans of the other that were taken nearest to it
//! ([`pair_form`]), and the sum of their forms, seen as a form of the one pose that relates the two
//! submaps, is minimised by Gauss-Newton steps.

use meetpoint_geometry::Pose;
use nalgebra::Matrix3;

use crate::scans::key_scan::KeyScan;
use crate::scans::scan_pair::{PairForm, PairParams, moved, pair_form};

/// A key scan and its pose seen from its submap's anchor.
pub(crate) type Placed<'a> = (&'a KeyScan, Pose);

/// How two submaps fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SubmapFit {
    /// The second submap's anchor seen from the first's.
    pub(crate) from_to: Pose,
    /// Information about its three numbers.
    pub(crate) information: Matrix3<f64>,
}

/// Facets of a scan that are asked, at most.
const N_FACETS_MAX: usize = 60;
/// Scans of the first submap that a scan of the second is matched with.
const N_NEAREST: usize = 2;
/// Gauss-Newton steps.
const N_STEPS: u32 = 6;
/// Metres that a radian counts as in choosing the nearest scan.
const LEVER_M: f64 = 1.0;

/// The fit of submap `there` on submap `here` near `start`.
pub(crate) fn fit(
    here: &[Placed<'_>],
    there: &[Placed<'_>],
    start: Pose,
    params: &PairParams,
) -> SubmapFit {
    let mut fit = SubmapFit { from_to: start, information: Matrix3::zeros() };
    for _ in 0..N_STEPS {
        let mut sum = PairForm::NONE;
        for &(key, pose) in there {
            let form = form_of_scan(here, (key, pose), fit.from_to, params);
            sum.hessian += form.hessian;
            sum.gradient += form.gradient;
        }
        fit.information = sum.hessian;
        fit.from_to = moved(fit.from_to, sum.step());
    }
    fit
}

/// What one scan says of `from_to`.
fn form_of_scan(
    here: &[Placed<'_>],
    (key, pose): Placed<'_>,
    from_to: Pose,
    params: &PairParams,
) -> PairForm {
    let place = from_to * pose;
    let mut order: Vec<(f64, usize)> = here
        .iter()
        .enumerate()
        .map(|(index, (_, other))| {
            let step = other.step_to(place);
            (step.distance_m() + LEVER_M * step.theta_rad.abs(), index)
        })
        .collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut sum = PairForm::NONE;
    let stride = key.surface.facets().len().div_ceil(N_FACETS_MAX).max(1);
    for &(_, index) in order.iter().take(N_NEAREST) {
        let (other, other_pose) = here[index];
        let seen = other_pose.step_to(place);
        let form = pair_form(&other.surface, key.surface.facets(), seen, params, stride);
        let by = by_relation(other_pose, from_to, pose);
        sum.hessian += by.transpose() * form.hessian * by;
        sum.gradient += by.transpose() * form.gradient;
    }
    sum
}

/// Derivative of `here^-1 * from_to * there` by the three numbers of `from_to`.
fn by_relation(here: Pose, from_to: Pose, there: Pose) -> Matrix3<f64> {
    let (sin, cos) = from_to.theta_rad.sin_cos();
    let (x, y) = (cos * there.x_m - sin * there.y_m, sin * there.x_m + cos * there.y_m);
    let (sin, cos) = here.theta_rad.sin_cos();
    let back = Matrix3::new(cos, sin, 0.0, -sin, cos, 0.0, 0.0, 0.0, 1.0);
    back * Matrix3::new(1.0, 0.0, -y, 0.0, 1.0, x, 0.0, 0.0, 1.0)
}
