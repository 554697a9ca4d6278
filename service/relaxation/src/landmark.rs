//! Landmarks, and what may be told about them.

use meetpoint_geometry::Point2;
use nalgebra::Matrix2;

use crate::travel::{Sighting, Travel};

/// What a sighting says about the landmark that it is of: the types `l_1 ... l_n` of TBF98 section
/// 4.2, to which a landmark that can be told from all others belongs as the only one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum LandmarkKind {
    /// One that looks like others of its type.
    Type(u32),
    /// One that can be told from all others.
    Identity(u32),
}

impl LandmarkKind {
    /// What a sighting is of.
    pub fn of(sighting: &Sighting) -> Self {
        sighting.identity.map_or(Self::Type(sighting.landmark_type), Self::Identity)
    }
}

/// A landmark of a map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Landmark {
    /// Where it is, in metres.
    pub position: Point2<f64>,
    /// How wrong that may be, in square metres.
    pub covariance_m2: Matrix2<f64>,
    /// What it is.
    pub kind: LandmarkKind,
    /// How sure it is that there is one, in [0, 1].
    pub certainty: f64,
}

/// All kinds that are told apart, in order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Kinds(Vec<LandmarkKind>);

impl Kinds {
    /// Those of a travel's sightings and of landmarks known before.
    pub(crate) fn new(travel: &Travel, known: &[Landmark]) -> Self {
        let sightings = travel.steps.iter().flat_map(|step| &step.sightings);
        let mut kinds: Vec<_> = sightings.map(LandmarkKind::of).collect();
        kinds.extend(known.iter().map(|landmark| landmark.kind));
        Self::from_kinds(kinds)
    }

    pub(crate) fn from_kinds(mut kinds: Vec<LandmarkKind>) -> Self {
        kinds.sort_unstable();
        kinds.dedup();
        Self(kinds)
    }

    pub(crate) fn as_slice(&self) -> &[LandmarkKind] {
        &self.0
    }

    pub(crate) fn n(&self) -> usize {
        self.0.len()
    }

    /// The place of a kind, if it is one of these.
    pub(crate) fn index_of(&self, kind: LandmarkKind) -> Option<usize> {
        self.0.binary_search(&kind).ok()
    }
}
