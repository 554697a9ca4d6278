//! Distinctive places, the edges between them and what was measured of both, in JSON.

use meetpoint_proto::v1;
use serde::Serialize;
use utoipa::ToSchema;

use super::geometry::Point;
use super::places::TravelLaw;

/// What is to be maximised where a robot stands.
#[derive(Clone, Copy, Debug, Serialize, ToSchema)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
pub(crate) enum DistinctivenessGoal {
    /// Not told by the service of that version.
    Unspecified,
    /// Nothing: a robot passes here.
    Passage,
    /// The likeness of distances to all near objects: three at least, and no open space.
    EqualDistances,
    /// The likeness of the distances to two near objects to that at which walls are walked along: beside
    /// open space.
    WallDistances,
    /// Nothing yet: something is there, to be seen from nearer.
    ComeCloser,
}

impl DistinctivenessGoal {
    /// As the message has it.
    pub(super) fn of(wire: i32) -> Self {
        match v1::DistinctivenessGoal::try_from(wire).unwrap_or_default() {
            v1::DistinctivenessGoal::Unspecified => Self::Unspecified,
            v1::DistinctivenessGoal::Passage => Self::Passage,
            v1::DistinctivenessGoal::EqualDistances => Self::EqualDistances,
            v1::DistinctivenessGoal::WallDistances => Self::WallDistances,
            v1::DistinctivenessGoal::ComeCloser => Self::ComeCloser,
        }
    }
}

/// How one goes on along an edge.
#[derive(Clone, Copy, Debug, Serialize, ToSchema)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
pub(crate) enum ControlStrategy {
    /// Not told by the service of that version.
    Unspecified,
    /// In the middle between an object on either side.
    FollowMidline,
    /// At a distance from the object on the left.
    WalkAlongLeft,
    /// At a distance from the object on the right.
    WalkAlongRight,
    /// Straight on: there is nothing to go by.
    BlindStep,
}

impl ControlStrategy {
    /// As the message has it.
    pub(super) fn of(wire: i32) -> Self {
        match v1::ControlStrategy::try_from(wire).unwrap_or_default() {
            v1::ControlStrategy::Unspecified => Self::Unspecified,
            v1::ControlStrategy::FollowMidline => Self::FollowMidline,
            v1::ControlStrategy::WalkAlongLeft => Self::WalkAlongLeft,
            v1::ControlStrategy::WalkAlongRight => Self::WalkAlongRight,
            v1::ControlStrategy::BlindStep => Self::BlindStep,
        }
    }
}

/// A gateway of a place: one of its open directions, from 0, clockwise from the one by which it was found.
#[derive(Clone, Copy, Debug, Serialize, ToSchema)]
pub(crate) struct PlaceDirection {
    place: u32,
    direction: u32,
}

impl From<v1::PlaceDirection> for PlaceDirection {
    fn from(wire: v1::PlaceDirection) -> Self {
        let v1::PlaceDirection { place, direction } = wire;
        Self { place, direction }
    }
}

/// A way to go.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct OpenDirection {
    /// In the frame of headings, radians.
    heading_rad: f64,
    law: TravelLaw,
    /// Where it leads; absent where nobody knows.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    leads_to: Option<PlaceDirection>,
}

impl From<v1::OpenDirection> for OpenDirection {
    fn from(wire: v1::OpenDirection) -> Self {
        let v1::OpenDirection { heading_rad, law, leads_to } = wire;
        let law = v1::TravelLaw::try_from(law).unwrap_or_default().into();
        Self { heading_rad, law, leads_to: leads_to.map(PlaceDirection::from) }
    }
}

/// A wall or a corner nearby.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct NearObject {
    /// Where it is nearest, in the frame of headings, radians.
    heading_rad: f64,
    /// How far it is there, in metres.
    distance_m: f64,
}

impl From<v1::NearObject> for NearObject {
    fn from(wire: v1::NearObject) -> Self {
        let v1::NearObject { heading_rad, distance_m } = wire;
        Self { heading_rad, distance_m }
    }
}

/// A distinctive place.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct DistinctivePlace {
    /// From 0, in the order in which they were found.
    number: u32,
    /// Its directions as a star.
    #[schema(example = "aba")]
    star: String,
    goal: DistinctivenessGoal,
    /// Whether it is marked as unique.
    home: bool,
    /// How often it was visited and recognised.
    visits: u32,
    /// Where it is by dead reckoning from the start of the exploration: near, and no more.
    position: Point,
    /// Clockwise, from the one by which it was found. Headings are means over visits.
    directions: Vec<OpenDirection>,
    /// As seen when it was found.
    objects: Vec<NearObject>,
}

impl From<v1::DistinctivePlace> for DistinctivePlace {
    fn from(wire: v1::DistinctivePlace) -> Self {
        let v1::DistinctivePlace {
            number,
            star,
            goal,
            home,
            visits,
            position,
            directions,
            objects,
        } = wire;
        Self {
            number,
            star,
            goal: DistinctivenessGoal::of(goal),
            home,
            visits,
            position: position.unwrap_or_default().into(),
            directions: directions.into_iter().map(OpenDirection::from).collect(),
            objects: objects.into_iter().map(NearObject::from).collect(),
        }
    }
}

/// Several measurements of one thing.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Averaged {
    /// How many; the rest is absent of none.
    measured: u32,
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    mean: Option<f64>,
    /// Standard deviation of one of them; absent of fewer than two.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    std: Option<f64>,
}

impl From<Option<v1::Averaged>> for Averaged {
    fn from(wire: Option<v1::Averaged>) -> Self {
        let v1::Averaged { measured, mean, std } = wire.unwrap_or_default();
        Self { measured, mean, std }
    }
}

/// A way between two places, averaged over its traversals.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct TravelEdge {
    /// Where it was left when it was found.
    from: PlaceDirection,
    /// Where it arrived then.
    to: PlaceDirection,
    /// That fitted most of the way, as travelled from its first end.
    strategy: ControlStrategy,
    /// How often it was travelled from end to end.
    traversals: u32,
    /// In metres.
    length_m: Averaged,
    /// From wall to wall, in metres.
    width_m: Averaged,
    /// Net change of orientation from the first end to the second, radians counter-clockwise.
    turned_rad: Averaged,
    /// Mean curvature as travelled from the first end, radians a metre.
    curvature_rad_per_m: f64,
}

impl From<v1::TravelEdge> for TravelEdge {
    fn from(wire: v1::TravelEdge) -> Self {
        let v1::TravelEdge {
            from,
            to,
            strategy,
            traversals,
            length_m,
            width_m,
            turned_rad,
            curvature_rad_per_m,
        } = wire;
        Self {
            from: from.unwrap_or_default().into(),
            to: to.unwrap_or_default().into(),
            strategy: ControlStrategy::of(strategy),
            traversals,
            length_m: length_m.into(),
            width_m: width_m.into(),
            turned_rad: turned_rad.into(),
            curvature_rad_per_m,
        }
    }
}
