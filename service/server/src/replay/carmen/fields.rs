//! The fields of a line, one after the other.

use std::str::SplitAsciiWhitespace;

use meetpoint_geometry::Pose;

use super::BadLine;
use crate::replay::stamp;

/// Readings a line may have: as many as a session may declare.
pub(super) const READINGS_MAX: u32 = 8192;
/// Characters of a wrong field that are repeated in a message.
const SHOWN: usize = 40;

/// What is left of a line.
#[derive(Clone)]
pub(super) struct Fields<'a> {
    rest: SplitAsciiWhitespace<'a>,
}

impl<'a> Fields<'a> {
    /// All fields of a line.
    pub(super) fn new(line: &'a str) -> Self {
        Self { rest: line.split_ascii_whitespace() }
    }

    /// The next field, if there is one.
    pub(super) fn next(&mut self) -> Option<&'a str> {
        self.rest.next()
    }

    /// How many fields are left.
    pub(super) fn n_left(&self) -> usize {
        self.rest.clone().count()
    }

    /// The next field, called `what`.
    pub(super) fn text(&mut self, what: &'static str) -> Result<&'a str, BadLine> {
        self.next().ok_or(BadLine::Missing(what))
    }

    /// A finite number.
    pub(super) fn number(&mut self, field: &'static str) -> Result<f64, BadLine> {
        let text = self.text(field)?;
        match text.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => Err(BadLine::NotANumber { field, text: shown(text) }),
        }
    }

    /// `x y theta`.
    pub(super) fn pose(&mut self) -> Result<Pose, BadLine> {
        Ok(Pose::new(self.number("x")?, self.number("y")?, self.number("theta")?))
    }

    /// A count of readings, from `least` on.
    pub(super) fn count(&mut self, least: u32) -> Result<u32, BadLine> {
        let text = self.text("number of readings")?;
        match text.parse::<u32>() {
            Ok(count) if (least..=READINGS_MAX).contains(&count) => Ok(count),
            _ => Err(BadLine::WrongCount { count: shown(text), limit: READINGS_MAX }),
        }
    }

    /// So many readings, of any value: what is not finite is an erroneous reading, not a bad line.
    pub(super) fn readings(
        &mut self,
        field: &'static str,
        count: u32,
    ) -> Result<Vec<f32>, BadLine> {
        let mut readings = Vec::with_capacity(count as usize);
        for _ in 0..count {
            let text = self.text(field)?;
            let reading =
                text.parse().map_err(|_| BadLine::NotANumber { field, text: shown(text) })?;
            readings.push(reading);
        }
        Ok(readings)
    }

    /// The three fields at the end of every line; the stamp in nanoseconds.
    pub(super) fn trailers(&mut self) -> Result<i64, BadLine> {
        let text = self.text("stamp")?;
        let stamp_ns = stamp::nanoseconds(text).ok_or_else(|| BadLine::NotAStamp(shown(text)))?;
        self.text("host")?;
        self.text("logger's stamp")?;
        match self.n_left() {
            0 => Ok(stamp_ns),
            n => Err(BadLine::TooMany(n)),
        }
    }
}

/// The beginning of a field.
fn shown(text: &str) -> String {
    text.chars().take(SHOWN).collect()
}
