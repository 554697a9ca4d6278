//! Sightings of landmarks that have names, as the graph of laser sessions takes them.

use meetpoint_geometry::Point2;
use meetpoint_tracking::LandmarkSighting;

use super::course::Seen;
use super::names::LandmarkNames;

/// What a sighting is off, in metres, wherever the landmark is: how detectors sit and how clocks run...
const STD_M: f64 = 0.2;
/// ...and for each metre of range: 3 degrees, or 5 % of the range.
const STD_PER_M: f64 = 0.05;

/// A sighting for the graph, from a scan that has the landmark at `scan_from_landmark`; `None` if it is
/// of no landmark by name.
pub(super) fn named_sighting(
    names: &mut LandmarkNames,
    seen: &Seen,
    (scan, scan_from_landmark): (usize, Point2<f64>),
) -> Option<LandmarkSighting> {
    let Seen { identity, landmark_type, robot_from_landmark } = seen;
    let landmark = names.landmark(landmark_type, identity.as_deref()?);
    let landmark = usize::try_from(landmark).ok()?;
    let std_m = STD_M.hypot(STD_PER_M * robot_from_landmark.coords.norm());
    Some(LandmarkSighting { scan, robot_from_landmark: scan_from_landmark, landmark, std_m })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_has_a_name_is_told() {
        let mut names = LandmarkNames::default();
        let mut number = |landmark_type: &str, identity: Option<&str>| {
            let (landmark_type, identity) = (landmark_type.to_owned(), identity.map(str::to_owned));
            let at = Point2::new(3.0, 4.0);
            let seen = Seen { identity, landmark_type, robot_from_landmark: at };
            named_sighting(&mut names, &seen, (7, at))
        };
        let first = number("tag", Some("a")).expect("it has a name");
        assert_eq!((first.scan, first.landmark), (7, 0), "{first:?}");
        assert!((first.std_m - 0.2_f64.hypot(0.25)).abs() < 1e-12, "5 m off: {first:?}");
        assert_eq!(number("tag", None), None, "without a name");
        let again = number("tag", Some("a")).map(|one| one.landmark);
        assert_eq!(again, Some(0), "the same");
        let other = number("tag", Some("b")).map(|one| one.landmark);
        assert_eq!(other, Some(1), "another");
    }
}
