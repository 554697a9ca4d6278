//! Errors as samples: a triangular (TBF98 footnote 1) or normal error becomes a row of equally
//! spaced values with weights that sum to one.

/// Normal errors are followed to three standard deviations: 0.3 % lie beyond.
const N_STD: f64 = 3.0;

/// One possible displacement, with its probability.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Spread {
    pub(crate) x_m: f64,
    pub(crate) y_m: f64,
    pub(crate) turn_rad: f64,
    pub(crate) weight: f64,
}

/// A triangular error of variance `variance`, at most `spacing` between neighbours. Its density is
/// `max(0, 1/w - |x|/w^2)` with `w = sqrt(6 variance)`.
pub(crate) fn triangular(variance: f64, spacing: f64) -> Vec<(f64, f64)> {
    let width = (6.0 * variance.max(0.0)).sqrt();
    sampled(width, spacing, |x| (width - x.abs()).max(0.0))
}

/// A normal error of variance `variance`.
pub(crate) fn normal(variance: f64, spacing: f64) -> Vec<(f64, f64)> {
    let reach = N_STD * variance.max(0.0).sqrt();
    sampled(reach, spacing, |x| (-0.5 * x * x / variance).exp())
}

/// Values in the middles of an odd number of equal parts of `-reach ..= reach`, stretched so that
/// their variance is not lost to the parts' width.
fn sampled(reach: f64, spacing: f64, density: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
    /// Finer than this no error of a grid needs to be.
    const N_SIDE_MAX: f64 = 50.0;
    if reach < spacing / 4.0 {
        return vec![(0.0, 1.0)];
    }
    let n_side = (reach / spacing).ceil().min(N_SIDE_MAX);
    let part = 2.0 * reach / (2.0 * n_side + 1.0);
    let values = std::iter::successors(Some(-n_side), |&i| (i < n_side).then_some(i + 1.0));
    let mut samples: Vec<_> = values.map(|i| (i * part, density(i * part))).collect();
    let sum: f64 = samples.iter().map(|sample| sample.1).sum();
    for sample in &mut samples {
        sample.1 /= sum;
    }
    samples
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn variance_is_what_was_asked_for(std in 0.3_f64..5.0) {
            for samples in [triangular(std * std, 0.1), normal(std * std, 0.1)] {
                let sum: f64 = samples.iter().map(|sample| sample.1).sum();
                let variance: f64 = samples.iter().map(|(x, weight)| x * x * weight).sum();
                prop_assert!((sum - 1.0).abs() < 1e-9, "weights sum to {}", sum);
                prop_assert!((variance / (std * std) - 1.0).abs() < 0.06, "variance {}", variance);
            }
        }
    }
}
