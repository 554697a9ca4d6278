//! One line of an MRCLAM file.

use std::f64::consts::PI;

use crate::replay::stamp;

/// Characters of a wrong column that are repeated in a message.
const SHOWN: usize = 40;
/// Farther than any camera reads a barcode, in metres: what the service lets a sensor declare.
const RANGE_MAX_M: f64 = 1000.0;

/// Why a line cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub(super) enum BadRow {
    /// It is not text.
    #[error("not UTF-8")]
    NotText,
    /// It is longer than any line of such a file.
    #[error("longer than a mebibyte")]
    TooLong,
    /// It has too few columns, or too many.
    #[error("{n} columns, must be {expected}")]
    WrongCount { n: usize, expected: usize },
    /// A number that is none.
    #[error("the {column} is `{text}`, not a finite number")]
    NotANumber { column: &'static str, text: String },
    /// A subject or barcode that is none.
    #[error("the {column} is `{text}`, not a whole number from 0 to 4294967295")]
    NotACount { column: &'static str, text: String },
    /// A time that cannot be kept to the nanosecond.
    #[error("the time is `{0}`, not seconds as a plain decimal number")]
    NotAStamp(String),
    /// A distance that no camera sees.
    #[error("the range is {0} m, must be above 0 and at most {RANGE_MAX_M} m")]
    WrongRange(f64),
    /// A direction beyond a turn.
    #[error("the bearing is {0} rad, must be -pi to pi")]
    WrongBearing(f64),
    /// A number that stands for two things.
    #[error("the {column} {number} stands in a line before")]
    Twice { column: &'static str, number: u32 },
}

/// Velocities, in force from their time until the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct OdometryRow {
    pub(super) stamp_ns: i64,
    /// Metres a second.
    pub(super) forward_m_per_s: f64,
    /// Radians a second, counter-clockwise.
    pub(super) turn_rad_per_s: f64,
}

/// A barcode seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MeasurementRow {
    pub(super) stamp_ns: i64,
    pub(super) barcode: u32,
    /// Metres, above 0.
    pub(super) range_m: f64,
    /// Radians counter-clockwise from where the robot heads, in [-pi, pi].
    pub(super) bearing_rad: f64,
}

/// Whose a barcode is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct BarcodeRow {
    pub(super) subject: u32,
    pub(super) barcode: u32,
}

/// `time forward-velocity angular-velocity`; `None` for a comment or an empty line.
pub(super) fn odometry(line: &[u8]) -> Result<Option<OdometryRow>, BadRow> {
    let Some([time, forward, turn]) = columns(line)? else { return Ok(None) };
    Ok(Some(OdometryRow {
        stamp_ns: nanoseconds(time)?,
        forward_m_per_s: number("forward velocity", forward)?,
        turn_rad_per_s: number("angular velocity", turn)?,
    }))
}

/// `time barcode range bearing`; `None` for a comment or an empty line. (The files' own heads call
/// the second column the subject.)
pub(super) fn measurement(line: &[u8]) -> Result<Option<MeasurementRow>, BadRow> {
    let Some([time, barcode, range, bearing]) = columns(line)? else { return Ok(None) };
    let stamp_ns = nanoseconds(time)?;
    let barcode = count("barcode", barcode)?;
    let range_m = number("range", range)?;
    let bearing_rad = number("bearing", bearing)?;
    if !(0.0 < range_m && range_m <= RANGE_MAX_M) {
        return Err(BadRow::WrongRange(range_m));
    }
    if PI < bearing_rad.abs() {
        return Err(BadRow::WrongBearing(bearing_rad));
    }
    Ok(Some(MeasurementRow { stamp_ns, barcode, range_m, bearing_rad }))
}

/// `subject barcode`; `None` for a comment or an empty line.
pub(super) fn barcode(line: &[u8]) -> Result<Option<BarcodeRow>, BadRow> {
    let Some([subject, barcode]) = columns(line)? else { return Ok(None) };
    let (subject, barcode) = (count("subject", subject)?, count("barcode", barcode)?);
    Ok(Some(BarcodeRow { subject, barcode }))
}

/// The columns of a line, if it is one that has them.
fn columns<const N: usize>(line: &[u8]) -> Result<Option<[&str; N]>, BadRow> {
    let text = std::str::from_utf8(line).map_err(|_| BadRow::NotText)?.trim();
    if text.is_empty() || text.starts_with('#') {
        return Ok(None);
    }
    let mut columns = [""; N];
    let mut n = 0;
    for word in text.split_ascii_whitespace() {
        if let Some(column) = columns.get_mut(n) {
            *column = word;
        }
        n += 1;
    }
    if n == N { Ok(Some(columns)) } else { Err(BadRow::WrongCount { n, expected: N }) }
}

fn nanoseconds(text: &str) -> Result<i64, BadRow> {
    stamp::nanoseconds(text).ok_or_else(|| BadRow::NotAStamp(shown(text)))
}

fn number(column: &'static str, text: &str) -> Result<f64, BadRow> {
    let number = text.parse().ok().filter(|number: &f64| number.is_finite());
    number.ok_or_else(|| BadRow::NotANumber { column, text: shown(text) })
}

fn count(column: &'static str, text: &str) -> Result<u32, BadRow> {
    text.parse().map_err(|_| BadRow::NotACount { column, text: shown(text) })
}

fn shown(text: &str) -> String {
    text.chars().take(SHOWN).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn lines_as_in_the_files() {
        let velocities = OdometryRow {
            stamp_ns: 1_248_000_187_156_000_000,
            forward_m_per_s: 0.086,
            turn_rad_per_s: -0.398,
        };
        let read = odometry(b"1248000187.156 \t  0.086 \t -0.398\r");
        assert_eq!(read, Ok(Some(velocities)), "blanks and tabs");
        let seen = MeasurementRow {
            stamp_ns: 99_599_000_000,
            barcode: 14,
            range_m: 3.787,
            bearing_rad: -0.25,
        };
        assert_eq!(measurement(b"99.599 14 3.787 -0.25"), Ok(Some(seen)), "a sighting");
        let row = BarcodeRow { subject: 6, barcode: 63 };
        assert_eq!(barcode(b"  6 \t  63"), Ok(Some(row)), "a barcode");
        assert_eq!(odometry(b"# Time [s]    forward velocity [m/s]"), Ok(None), "a comment");
        assert_eq!(barcode(b" \t"), Ok(None), "nothing");
    }

    #[test]
    fn a_bad_line_says_what_is_wrong_with_it() {
        for (line, reason) in [
            ("1.5 14 3.0", "3 columns, must be 4"),
            ("1.5 14 3.0 0.1 7", "5 columns, must be 4"),
            ("1e9 14 3.0 0.1", "the time is `1e9`, not seconds as a plain decimal number"),
            ("1.5 -4 3.0 0.1", "the barcode is `-4`, not a whole number from 0 to 4294967295"),
            ("1.5 14 far 0.1", "the range is `far`, not a finite number"),
            ("1.5 14 nan 0.1", "the range is `nan`, not a finite number"),
            ("1.5 14 0 0.1", "the range is 0 m, must be above 0 and at most 1000 m"),
            ("1.5 14 3.0 4", "the bearing is 4 rad, must be -pi to pi"),
        ] {
            let read = measurement(line.as_bytes()).map_err(|error| error.to_string());
            assert_eq!(read, Err(reason.to_owned()), "{line}");
        }
        assert_eq!(odometry(b"1 0.1 \xff"), Err(BadRow::NotText), "not text");
    }

    proptest! {
        #[test]
        fn no_bytes_can_make_it_panic(line in prop::collection::vec(any::<u8>(), 0..100)) {
            let _ = (odometry(&line), measurement(&line), barcode(&line));
        }

        #[test]
        fn no_column_can_make_it_panic(
            place in 0_usize..4,
            column in prop_oneof![
                Just("NaN"), Just("-inf"), Just("1e400"), Just("-9223372036854775809"),
                Just("18446744073709551616"), Just("-1"), Just("."), Just("#")
            ],
        ) {
            let mut columns = ["1.5", "14", "3.0", "0.1"];
            columns[place] = column;
            if let Ok(Some(row)) = measurement(columns.join(" ").as_bytes()) {
                prop_assert!(row.range_m.is_finite() && row.bearing_rad.is_finite());
            }
        }
    }
}
