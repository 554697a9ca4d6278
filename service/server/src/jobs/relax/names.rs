//! What landmarks are called, in numbers: relaxation and the graph of scans know no names.

use std::collections::BTreeMap;

use meetpoint_relaxation::Travel;

/// Types and identities, numbered in the order of first mention. An identity names a landmark among those
/// of its type only.
#[derive(Clone, Debug, Default)]
pub(in crate::jobs) struct LandmarkNames {
    types: Numbered<String>,
    /// Type and identity.
    identities: Numbered<(String, String)>,
}

#[derive(Clone, Debug)]
struct Numbered<T> {
    numbers: BTreeMap<T, u32>,
    names: Vec<T>,
}

impl LandmarkNames {
    /// The number of a type.
    pub(super) fn landmark_type(&mut self, landmark_type: &str) -> u32 {
        self.types.number(landmark_type.to_owned())
    }

    /// The number of a landmark of that type and identity.
    pub(super) fn landmark(&mut self, landmark_type: &str, identity: &str) -> u32 {
        self.identities.number((landmark_type.to_owned(), identity.to_owned()))
    }

    /// What a type is called.
    pub(super) fn type_name(&self, number: u32) -> Option<&str> {
        self.types.name(number).map(String::as_str)
    }

    /// The identity that a number is of.
    pub(super) fn identity(&self, number: u32) -> Option<&str> {
        self.identities.name(number).map(|(_, identity)| identity.as_str())
    }

    /// A travel whose sightings have the numbers of these names, to which its own are added.
    pub(super) fn renamed(&mut self, travel: &Travel, own: &Self) -> Travel {
        let mut travel = travel.clone();
        for sighting in travel.steps.iter_mut().flat_map(|step| &mut step.sightings) {
            if let Some(name) = own.types.name(sighting.landmark_type) {
                sighting.landmark_type = self.types.number(name.clone());
            }
            if let Some(name) = sighting.identity.and_then(|number| own.identities.name(number)) {
                sighting.identity = Some(self.identities.number(name.clone()));
            }
        }
        travel
    }
}

impl<T> Default for Numbered<T> {
    fn default() -> Self {
        Self { numbers: BTreeMap::new(), names: Vec::new() }
    }
}

impl<T: Clone + Ord> Numbered<T> {
    fn number(&mut self, name: T) -> u32 {
        if let Some(&number) = self.numbers.get(&name) {
            return number;
        }
        let number = u32::try_from(self.names.len()).unwrap_or(u32::MAX);
        self.names.push(name.clone());
        self.numbers.insert(name, number);
        number
    }

    fn name(&self, number: u32) -> Option<&T> {
        usize::try_from(number).ok().and_then(|index| self.names.get(index))
    }
}

#[cfg(test)]
mod tests {
    use meetpoint_relaxation::{Detector, Motion, Sighting, Step};

    use super::*;

    #[test]
    fn a_landmark_is_named_by_type_and_identity() {
        let mut names = LandmarkNames::default();
        let named = [("tag", "a"), ("tag", "b"), ("door", "a"), ("tag", "a")];
        let numbers = named.map(|(of_type, identity)| names.landmark(of_type, identity));
        assert_eq!(numbers, [0, 1, 2, 0], "by both");
        assert_eq!(names.identity(2), Some("a"), "{names:?}");
        assert_eq!(names.identity(3), None, "nobody was called that");
    }

    #[test]
    fn travels_of_several_sessions_have_the_same_numbers() {
        let travel = |own: &mut LandmarkNames, seen: &[(&str, Option<&str>)]| {
            let sightings = seen.iter().map(|&(of_type, identity)| Sighting {
                identity: identity.map(|identity| own.landmark(of_type, identity)),
                landmark_type: own.landmark_type(of_type),
                range_m: 1.0,
                bearing_rad: 0.0,
            });
            let step = Step { motion: Motion::NONE, sightings: sightings.collect() };
            let detector = Detector { range_max_m: 4.0, half_field_of_view_rad: 1.0 };
            Travel { detector, steps: vec![step] }
        };
        let (mut all, mut first, mut second) =
            <(LandmarkNames, LandmarkNames, LandmarkNames)>::default();
        let a = travel(&mut first, &[("tag", Some("7")), ("lamp", None)]);
        let b = travel(&mut second, &[("lamp", None), ("tag", Some("8")), ("tag", Some("7"))]);
        let numbers = |travel: &Travel| -> Vec<(u32, Option<u32>)> {
            let seen = travel.steps[0].sightings.iter();
            seen.map(|seen| (seen.landmark_type, seen.identity)).collect()
        };
        assert_eq!(numbers(&all.renamed(&a, &first)), [(0, Some(0)), (1, None)], "as they come");
        let renamed = all.renamed(&b, &second);
        assert_eq!(
            numbers(&renamed),
            [(1, None), (0, Some(1)), (0, Some(0))],
            "known ones as before"
        );
    }
}
