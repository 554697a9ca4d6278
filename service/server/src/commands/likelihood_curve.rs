//! A likelihood as it climbs, in one line of characters.

/// From the least value to the greatest.
const LEVELS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];

/// A character a value, or of neighbours their last where there are more than `n_columns`. What is no
/// number is a gap; equal values lie on top.
pub(super) fn curve(values: &[f64], n_columns: usize) -> String {
    let n = values.len().min(n_columns);
    let shown = (1..=n).map(|column| values[column * values.len() / n - 1]);
    let finite = || shown.clone().filter(|value| value.is_finite());
    let least = finite().fold(f64::INFINITY, f64::min);
    let most = finite().fold(f64::NEG_INFINITY, f64::max);
    let top = LEVELS.len() - 1;
    let level = |value: f64| {
        let height = if most <= least { 1.0 } else { (value - least) / (most - least) };
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 7")]
        let level = (height * top as f64).round() as usize;
        LEVELS[level.min(top)]
    };
    shown.clone().map(|value| if value.is_finite() { level(value) } else { ' ' }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn climbs_as_the_values_do() {
        assert_eq!(curve(&[-90.0, -20.0, -20.0, f64::NAN, -20.0], 60), "▁██ █", "one each");
        assert_eq!(curve(&[0.0, 1.0, 2.0, 3.0], 2), "▁█", "the last of two");
        assert_eq!(curve(&[-5.0], 60), "█", "one alone");
        assert_eq!(curve(&[], 60), "", "none");
    }
}
