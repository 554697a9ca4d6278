//! 64-bit integers in JSON: numbers below 2⁵³, which every reader holds exactly, strings above.

use std::marker::PhantomData;

use serde::de::{self, Deserialize, Deserializer, Visitor};
use serde::ser::{Serialize, Serializer};
use utoipa::openapi::schema::{KnownFormat, OneOfBuilder, SchemaFormat, SchemaType, Type};
use utoipa::openapi::{ObjectBuilder, RefOr, Schema};
use utoipa::{PartialSchema, ToSchema};

/// Magnitudes below this are written as numbers: IEEE 754 doubles hold them exactly.
const EXACT_BELOW: u64 = 1 << 53;

/// A signed 64-bit integer, times in nanoseconds above all.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Signed64(pub(crate) i64);

/// An unsigned 64-bit integer: counts and numbers of batches and versions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Unsigned64(pub(crate) u64);

impl Unsigned64 {
    /// Absent where the wire says 0 for "none".
    pub(super) fn above_zero(number: u64) -> Option<Self> {
        (number != 0).then_some(Self(number))
    }
}

impl Serialize for Signed64 {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if self.0.unsigned_abs() < EXACT_BELOW {
            serializer.serialize_i64(self.0)
        } else {
            serializer.collect_str(&self.0)
        }
    }
}

impl Serialize for Unsigned64 {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if self.0 < EXACT_BELOW {
            serializer.serialize_u64(self.0)
        } else {
            serializer.collect_str(&self.0)
        }
    }
}

impl<'de> Deserialize<'de> for Signed64 {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Digits::within("-2^63 to 2^63 - 1")).map(Self)
    }
}

impl<'de> Deserialize<'de> for Unsigned64 {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Digits::within("0 to 2^64 - 1")).map(Self)
    }
}

/// Reads either form; holds the range for messages.
struct Digits<T> {
    range: &'static str,
    integer: PhantomData<T>,
}

impl<T> Digits<T> {
    fn within(range: &'static str) -> Self {
        Self { range, integer: PhantomData }
    }
}

impl<T: TryFrom<i128>> Visitor<'_> for Digits<T> {
    type Value = T;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "a whole number from {}, as a number or as a string", self.range)
    }

    fn visit_i64<E: de::Error>(self, number: i64) -> Result<T, E> {
        T::try_from(i128::from(number))
            .map_err(|_| E::invalid_value(de::Unexpected::Signed(number), &self))
    }

    fn visit_u64<E: de::Error>(self, number: u64) -> Result<T, E> {
        T::try_from(i128::from(number))
            .map_err(|_| E::invalid_value(de::Unexpected::Unsigned(number), &self))
    }

    /// JSON does not tell 3.0 from 3: what is whole and exact is taken.
    #[expect(clippy::cast_possible_truncation, reason = "whole and below 2^53")]
    fn visit_f64<E: de::Error>(self, number: f64) -> Result<T, E> {
        let is_exact = number.fract() == 0.0 && number.abs() < EXACT_BELOW as f64;
        let whole = is_exact.then_some(number as i128);
        whole
            .and_then(|number| T::try_from(number).ok())
            .ok_or_else(|| E::invalid_value(de::Unexpected::Float(number), &self))
    }

    fn visit_str<E: de::Error>(self, text: &str) -> Result<T, E> {
        text.parse::<i128>()
            .ok()
            .and_then(|number| T::try_from(number).ok())
            .ok_or_else(|| E::invalid_value(de::Unexpected::Str(text), &self))
    }
}

impl ToSchema for Signed64 {}

impl PartialSchema for Signed64 {
    fn schema() -> RefOr<Schema> {
        number_or_string(None, "^-?[0-9]{1,19}$", "1700000000000000000")
    }
}

impl ToSchema for Unsigned64 {}

impl PartialSchema for Unsigned64 {
    fn schema() -> RefOr<Schema> {
        number_or_string(Some(0), "^[0-9]{1,20}$", "42")
    }
}

fn number_or_string(minimum: Option<i64>, pattern: &str, example: &str) -> RefOr<Schema> {
    let number = ObjectBuilder::new()
        .schema_type(SchemaType::new(Type::Integer))
        .format(Some(SchemaFormat::KnownFormat(KnownFormat::Int64)))
        .minimum(minimum);
    let digits =
        ObjectBuilder::new().schema_type(SchemaType::new(Type::String)).pattern(Some(pattern));
    OneOfBuilder::new()
        .item(number)
        .item(digits)
        .description(Some("A 64-bit integer: a number below 2^53, a string of digits above."))
        .examples([serde_json::Value::from(example)])
        .into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn strings_above_two_to_the_53() {
        let written = |number| serde_json::to_string(&Signed64(number)).expect("an integer");
        assert_eq!(written(9_007_199_254_740_991), "9007199254740991", "2^53 - 1");
        assert_eq!(written(9_007_199_254_740_992), "\"9007199254740992\"", "2^53");
        assert_eq!(written(-9_007_199_254_740_992), "\"-9007199254740992\"", "below 0 too");
    }

    #[test]
    fn refuses_what_is_no_such_integer() {
        for bad in [
            "-1",
            "-1.0",
            "1e300",
            "\"-1\"",
            "1.5",
            "\"1e3\"",
            "\"\"",
            "18446744073709551616",
            "null",
            "[]",
        ] {
            let read: Result<Unsigned64, _> = serde_json::from_str(bad);
            assert!(read.is_err(), "{bad} is none");
        }
    }

    #[test]
    fn whole_numbers_however_written() {
        for three in ["3", "3.0", "3e0", "\"3\""] {
            let read: Unsigned64 = serde_json::from_str(three).expect("a whole number");
            assert_eq!(read, Unsigned64(3), "{three} is three");
        }
    }

    proptest! {
        #[test]
        fn both_forms_are_read(number: i64) {
            let bare: Signed64 = serde_json::from_str(&number.to_string())?;
            let quoted: Signed64 = serde_json::from_str(&format!("\"{number}\""))?;
            prop_assert_eq!(bare, Signed64(number));
            prop_assert_eq!(quoted, Signed64(number));
        }

        #[test]
        fn reads_what_it_wrote(number: u64) {
            let text = serde_json::to_string(&Unsigned64(number))?;
            let back: Unsigned64 = serde_json::from_str(&text)?;
            prop_assert_eq!(back, Unsigned64(number));
        }
    }
}
