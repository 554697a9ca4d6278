//! Seconds as decimal text to whole nanoseconds, without a detour by floating point: a stamp is a
//! scan's name, and an `f64` of today's time holds steps of 240 nanoseconds.

/// Decimals of a nanosecond.
const N_DECIMALS: usize = 9;
/// Nanoseconds in a second.
const SECOND_NS: i64 = 1_000_000_000;

/// The nanoseconds of `seconds`, a plain decimal number; decimals beyond the ninth are cut off.
/// `None` for anything else, and beyond the range of `i64`.
pub(crate) fn nanoseconds(seconds: &str) -> Option<i64> {
    let (negative, digits) = match seconds.strip_prefix('-') {
        Some(digits) => (true, digits),
        None => (false, seconds),
    };
    let (whole, decimals) = digits.split_once('.').unwrap_or((digits, ""));
    let all_digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    if whole.is_empty() || !all_digits(whole) || !all_digits(decimals) {
        return None;
    }
    let mut fraction_ns = 0;
    for place in 0..N_DECIMALS {
        let digit = decimals.as_bytes().get(place).map_or(0, |byte| i64::from(byte - b'0'));
        fraction_ns = fraction_ns * 10 + digit;
    }
    let magnitude = whole.parse::<i64>().ok()?.checked_mul(SECOND_NS)?.checked_add(fraction_ns)?;
    Some(if negative { -magnitude } else { magnitude })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn every_digit_counts() {
        assert_eq!(nanoseconds("976052857.337530"), Some(976_052_857_337_530_000), "six");
        assert_eq!(nanoseconds("1134864629.895182"), Some(1_134_864_629_895_182_000), "six");
        assert_eq!(nanoseconds("12"), Some(12_000_000_000), "no decimals");
        assert_eq!(nanoseconds("0.1234567899"), Some(123_456_789), "cut off");
        assert_eq!(nanoseconds("-1.5"), Some(-1_500_000_000), "before the clock's zero");
        assert_eq!(nanoseconds("7."), Some(7_000_000_000), "a bare point");
    }

    #[test]
    fn what_is_not_plain_is_refused() {
        for text in ["", ".", ".5", "-", "+1", "1e9", "1.2.3", "nan", "1,5", "9223372037", "0x1"] {
            assert_eq!(nanoseconds(text), None, "{text}");
        }
    }

    proptest! {
        #[test]
        fn nanoseconds_survive(ns in 0..i64::MAX) {
            let text = format!("{}.{:09}", ns / SECOND_NS, ns % SECOND_NS);
            prop_assert_eq!(nanoseconds(&text), Some(ns));
        }
    }
}
