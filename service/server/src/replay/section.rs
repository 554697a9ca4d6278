//! Which part of a recording is sent: `--from` and `--to`.

use std::str::FromStr;

/// Nanoseconds in a second.
const SECOND_NS: f64 = 1e9;

/// A place in a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// Seconds after the first scan or sighting.
    Seconds(f64),
    /// A share of the time between the first and the last of these, 0 to 1.
    Fraction(f64),
}

impl FromStr for Place {
    type Err = String;

    /// `90s` and `90` are seconds, `25%` and `0.25` are a share; a bare number up to 1 is a share.
    fn from_str(text: &str) -> Result<Self, String> {
        let number = |text: &str| {
            text.parse::<f64>()
                .ok()
                .filter(|number| number.is_finite() && 0.0 <= *number)
                .ok_or_else(|| format!("`{text}` is not a number of 0 or more"))
        };
        let place = if let Some(seconds) = text.strip_suffix('s') {
            Self::Seconds(number(seconds)?)
        } else if let Some(percent) = text.strip_suffix('%') {
            Self::Fraction(number(percent)? / 100.0)
        } else {
            match number(text)? {
                share if share <= 1.0 => Self::Fraction(share),
                seconds => Self::Seconds(seconds),
            }
        };
        match place {
            Self::Fraction(share) if 1.0 < share => Err(format!("`{text}` is more than 100%")),
            _ => Ok(place),
        }
    }
}

impl Place {
    /// The stamp at this place of a recording that has stamps from `first_ns` to `last_ns`.
    fn stamp_ns(self, (first_ns, last_ns): (i64, i64)) -> i64 {
        let offset_ns = match self {
            Self::Seconds(seconds) => seconds * SECOND_NS,
            Self::Fraction(share) => last_ns.saturating_sub(first_ns) as f64 * share,
        };
        #[expect(clippy::cast_possible_truncation, reason = "`as` saturates, as is wanted")]
        first_ns.saturating_add(offset_ns as i64)
    }
}

/// The part of a recording between two stamps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Section {
    from_ns: i64,
    to_ns: i64,
}

impl Section {
    /// From `from` on and before `to`, in a recording whose readings have stamps from the first to
    /// the last of `stamps_ns`. Absent bounds leave out nothing.
    pub(crate) fn new(from: Option<Place>, to: Option<Place>, stamps_ns: (i64, i64)) -> Self {
        let to = to.filter(|place| *place != Place::Fraction(1.0));
        Self {
            from_ns: from.map_or(i64::MIN, |place| place.stamp_ns(stamps_ns)),
            to_ns: to.map_or(i64::MAX, |place| place.stamp_ns(stamps_ns)),
        }
    }

    /// True if an observation of that stamp belongs to the part.
    pub(crate) fn contains(&self, stamp_ns: i64) -> bool {
        self.from_ns <= stamp_ns && (stamp_ns < self.to_ns || self.to_ns == i64::MAX)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_written_as_people_would() {
        for (text, place) in [
            ("90", Place::Seconds(90.0)),
            ("0.5s", Place::Seconds(0.5)),
            ("0.25", Place::Fraction(0.25)),
            ("25%", Place::Fraction(0.25)),
            ("1", Place::Fraction(1.0)),
            ("0", Place::Fraction(0.0)),
        ] {
            assert_eq!(text.parse(), Ok(place), "{text}");
        }
        for text in ["", "-1", "x", "101%", "nan", "infs"] {
            assert!(text.parse::<Place>().is_err(), "{text}");
        }
    }

    #[test]
    fn halves_meet_without_overlap() {
        let stamps_ns = (1_000, 2_001);
        let half = Some(Place::Fraction(0.5));
        let first = Section::new(None, half, stamps_ns);
        let second = Section::new(half, Some(Place::Fraction(1.0)), stamps_ns);
        for stamp_ns in 900..2_100 {
            assert!(first.contains(stamp_ns) != second.contains(stamp_ns), "{stamp_ns}");
        }
        assert!(second.contains(2_001), "the last scan belongs to the end");
    }
}
