//! Visits to places on the wire.

use meetpoint_geometry::Pose;
use meetpoint_places::{Observation, Star, TravelRecord, View};
use meetpoint_proto::v1;

use crate::hypotheses::Visit;

/// Characters of a view's name.
const VIEW_LEN_MAX: usize = 64;
/// Metres of a way, at most.
const LENGTH_MAX_M: f64 = 10_000.0;
/// Radians that a robot turns on a way, at most.
const TURNED_MAX_RAD: f64 = 100.0;
/// Gateways of a place, at most, as `meetpoint_places` has it.
const N_GATEWAYS_MAX: u32 = 32;

/// A code for programs and a sentence for people.
type Rejected = (&'static str, String);

/// A visit, or what is wrong with it.
pub(crate) fn visit(wire: &v1::PlaceVisit) -> Result<Visit, Rejected> {
    let v1::PlaceVisit { number, turn, star, view, view_is_unique, length_m, turned_rad, moved } =
        wire;
    // A letter and a sign for the control law each.
    if (2 * N_GATEWAYS_MAX as usize) < star.len() {
        return Err(("INVALID_STAR", format!("{} characters", star.len())));
    }
    let star: Star =
        star.parse().map_err(|error| ("INVALID_STAR", format!("`{star}`: {error}")))?;
    let is_gateway = |turn: &u8| u32::from(*turn) < N_GATEWAYS_MAX;
    let turn = match u8::try_from(*turn).ok().filter(is_gateway) {
        // Nobody looks at how the first place was come to.
        _ if *number == 0 => 0,
        Some(turn) => turn,
        None => return Err(("OUT_OF_RANGE", format!("turn {turn}, below {N_GATEWAYS_MAX}"))),
    };
    let n_chars = view.chars().count();
    if VIEW_LEN_MAX < n_chars {
        return Err(("TOO_LONG", format!("view: {n_chars} characters, at most {VIEW_LEN_MAX}")));
    }
    let is_compared = !view.is_empty();
    let view = is_compared.then(|| View { name: view.clone(), is_unique: *view_is_unique });
    let record = TravelRecord {
        length_m: measured("length_m", *length_m, 0.0..=LENGTH_MAX_M)?,
        turned_rad: measured("turned_rad", *turned_rad, -TURNED_MAX_RAD..=TURNED_MAX_RAD)?,
        moved: moved.map(motion).transpose()?,
    };
    Ok(Visit { number: *number, turn, seen: Observation { star, view }, record })
}

fn motion(wire: v1::Pose) -> Result<Pose, Rejected> {
    let v1::Pose { x_m, y_m, theta_rad } = wire;
    let reach = -LENGTH_MAX_M..=LENGTH_MAX_M;
    for (field, value, range) in [
        ("moved.x_m", x_m, reach.clone()),
        ("moved.y_m", y_m, reach),
        ("moved.theta_rad", theta_rad, -TURNED_MAX_RAD..=TURNED_MAX_RAD),
    ] {
        measured(field, Some(value), range)?;
    }
    Ok(Pose::new(x_m, y_m, theta_rad))
}

fn measured(
    field: &str,
    value: Option<f64>,
    range: std::ops::RangeInclusive<f64>,
) -> Result<Option<f64>, Rejected> {
    match value {
        Some(value) if !value.is_finite() => Err(("NOT_FINITE", format!("{field} is {value}"))),
        Some(value) if !range.contains(&value) => {
            let (least, most) = range.into_inner();
            Err(("OUT_OF_RANGE", format!("{field} {value}, must be {least} to {most}")))
        }
        value => Ok(value),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wire(star: &str) -> v1::PlaceVisit {
        v1::PlaceVisit { number: 1, turn: 2, star: star.to_owned(), ..Default::default() }
    }

    fn moved(x_m: f64) -> v1::PlaceVisit {
        let moved = Some(v1::Pose { x_m, ..v1::Pose::default() });
        v1::PlaceVisit { moved, ..wire("aa") }
    }

    fn code(wire: &v1::PlaceVisit) -> &'static str {
        visit(wire).map_or_else(|(code, _)| code, |_| "")
    }

    #[test]
    fn a_visit_is_what_was_told() {
        let told = v1::PlaceVisit {
            view: "home".into(),
            view_is_unique: true,
            length_m: Some(3.5),
            ..wire("ab>a")
        };
        let read = visit(&told).expect("nothing is wrong with it");
        assert_eq!((read.number, read.turn), (1, 2), "which, and how it came there");
        assert_eq!(read.seen.to_string(), "ab>a@home!", "what it saw");
        let expected = TravelRecord { length_m: Some(3.5), turned_rad: None, moved: None };
        assert_eq!(read.record, expected, "what it measured");
        assert_eq!(visit(&wire("aa")).expect("good").seen.view, None, "nobody compared it");
    }

    #[test]
    fn what_is_wrong_has_a_code() {
        for (bad, expected) in [
            (wire(""), "INVALID_STAR"),
            (wire("aaa"), "INVALID_STAR"),
            (wire(&"ab".repeat(100)), "INVALID_STAR"),
            (v1::PlaceVisit { turn: 32, ..wire("aa") }, "OUT_OF_RANGE"),
            (v1::PlaceVisit { view: "x".repeat(65), ..wire("aa") }, "TOO_LONG"),
            (v1::PlaceVisit { length_m: Some(f64::NAN), ..wire("aa") }, "NOT_FINITE"),
            (v1::PlaceVisit { length_m: Some(-1.0), ..wire("aa") }, "OUT_OF_RANGE"),
            (v1::PlaceVisit { turned_rad: Some(1e3), ..wire("aa") }, "OUT_OF_RANGE"),
            (moved(f64::INFINITY), "NOT_FINITE"),
            (moved(1e5), "OUT_OF_RANGE"),
            (moved(1e3), ""),
            (v1::PlaceVisit { number: 0, turn: 999, ..wire("aa") }, ""),
        ] {
            assert_eq!(code(&bad), expected, "{bad:?}");
        }
    }
}
