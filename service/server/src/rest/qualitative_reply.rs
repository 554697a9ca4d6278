//! Explorations by small steps, in JSON.

use meetpoint_proto::v1;
use serde::Serialize;
use utoipa::ToSchema;

use super::distinctive_places::{
    ControlStrategy, DistinctivePlace, DistinctivenessGoal, NearObject, OpenDirection,
    PlaceDirection, TravelEdge,
};
use super::geometry::Point;
use super::integer::{Signed64, Unsigned64};
use super::travels::TravelSelection;

/// What the robot is about.
#[derive(Clone, Copy, Debug, Serialize, ToSchema)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
pub(crate) enum QualitativeState {
    /// Not told by the service of that version.
    Unspecified,
    /// It looks for its first place.
    Starting,
    /// It is on its way into the unknown.
    Exploring,
    /// It tests whether a place is one that it knows.
    Rehearsing,
    /// It is on its way to a place that has something unexplored.
    Travelling,
    /// Nothing is left to be explored.
    Complete,
    /// There are more places than are kept.
    GaveUp,
}

/// What a step is.
#[derive(Clone, Copy, Debug, Serialize, ToSchema)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
pub(crate) enum StepKind {
    /// Not told by the service of that version.
    Unspecified,
    /// Turn on the spot by `turn_rad`, and fire.
    Turn,
    /// Go straight by `move_m`, and fire.
    Move,
    /// Stay, and fire.
    Look,
    /// Nothing: all is explored, or the service gave up.
    Done,
}

/// One small motion.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct QualitativeStep {
    kind: StepKind,
    /// Counter-clockwise, in (-pi, pi]; only of `TURN`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false, example = 0.2)]
    turn_rad: Option<f64>,
    /// Ahead, or back below 0; only of `MOVE`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false, example = 0.15)]
    move_m: Option<f64>,
    state: QualitativeState,
    /// Stamp of the newest firing that was taken in: a robot whose own is newer asks again.
    stamp_ns: Signed64,
    /// Firings taken in since the exploration began.
    firings: Unsigned64,
    /// Steps that were told and done, or given up.
    steps: Unsigned64,
    /// Firings in a row at which the robot stood though it was told to move. A step is given up at 5.
    standing: u32,
}

impl From<v1::QualitativeStep> for QualitativeStep {
    fn from(wire: v1::QualitativeStep) -> Self {
        let v1::QualitativeStep {
            kind,
            turn_rad,
            move_m,
            state,
            stamp_ns,
            firings,
            steps,
            standing,
        } = wire;
        let kind = match v1::StepKind::try_from(kind).unwrap_or_default() {
            v1::StepKind::Unspecified => StepKind::Unspecified,
            v1::StepKind::Turn => StepKind::Turn,
            v1::StepKind::Move => StepKind::Move,
            v1::StepKind::Look => StepKind::Look,
            v1::StepKind::Done => StepKind::Done,
        };
        let state = match v1::QualitativeState::try_from(state).unwrap_or_default() {
            v1::QualitativeState::Unspecified => QualitativeState::Unspecified,
            v1::QualitativeState::Starting => QualitativeState::Starting,
            v1::QualitativeState::Exploring => QualitativeState::Exploring,
            v1::QualitativeState::Rehearsing => QualitativeState::Rehearsing,
            v1::QualitativeState::Travelling => QualitativeState::Travelling,
            v1::QualitativeState::Complete => QualitativeState::Complete,
            v1::QualitativeState::GaveUp => QualitativeState::GaveUp,
        };
        let (stamp_ns, firings) = (Signed64(stamp_ns), Unsigned64(firings));
        let steps = Unsigned64(steps);
        Self { kind, turn_rad, move_m, state, stamp_ns, firings, steps, standing }
    }
}

/// How a session explores, and what is not as one might think.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct QualitativeExploration {
    session: String,
    map: String,
    /// The sensor whose firings count.
    sensor: String,
    /// Cones of the ring, evenly around, the first ahead.
    #[schema(example = 16)]
    cones: u32,
    /// Whether the sensor's readings were folded into these: each cone is the median of what looks along
    /// its middle.
    folded: bool,
    /// Whether headings are a compass's.
    compass: bool,
    selection: TravelSelection,
    /// Width of corridors that was assumed at the start, in metres; it is measured on the way.
    corridor_width_m: f64,
    /// A rehearsal leads so many edges away at most.
    rehearsal_edges_max: u32,
    /// The batch after which it began: 0 for the beginning of the session.
    begun_after_batch: Unsigned64,
    /// Batches up to this number are in it.
    read_through: Unsigned64,
    /// Firings that are not: without odometry before them, or more than `qualitative.n_firings_max`.
    firings_left_out: Unsigned64,
    /// Batches that the session skipped since: steps across these are read off odometry all the same.
    batches_skipped: Unsigned64,
}

impl From<v1::QualitativeExploration> for QualitativeExploration {
    fn from(wire: v1::QualitativeExploration) -> Self {
        let v1::QualitativeExploration {
            session,
            map,
            sensor,
            cones,
            folded,
            compass,
            selection,
            corridor_width_m,
            rehearsal_edges_max,
            begun_after_batch,
            read_through,
            firings_left_out,
            batches_skipped,
        } = wire;
        let selection = match v1::TravelSelection::try_from(selection).unwrap_or_default() {
            v1::TravelSelection::Unspecified | v1::TravelSelection::LeastRotation => {
                TravelSelection::LeastRotation
            }
            v1::TravelSelection::MostRotation => TravelSelection::MostRotation,
        };
        Self {
            session,
            map,
            sensor,
            cones,
            folded,
            compass,
            selection,
            corridor_width_m,
            rehearsal_edges_max,
            begun_after_batch: Unsigned64(begun_after_batch),
            read_through: Unsigned64(read_through),
            firings_left_out: Unsigned64(firings_left_out),
            batches_skipped: Unsigned64(batches_skipped),
        }
    }
}

/// Where a robot is.
#[derive(Clone, Copy, Debug, Serialize, ToSchema)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
pub(crate) enum TopologicalWhereaboutsKind {
    /// Not told by the service of that version.
    Unspecified,
    /// At a place.
    AtPlace,
    /// On an edge since a place.
    OnEdge,
    /// Beyond a direction into the unexplored, at a known place or a new one that looks like it, and on
    /// its way to find out.
    InQuestion,
    /// It has not come to any place yet.
    Nowhere,
}

/// Where a robot is, topologically.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct TopologicalWhereabouts {
    kind: TopologicalWhereaboutsKind,
    /// `AT_PLACE`: the place, and the direction by which it came. `ON_EDGE` and `IN_QUESTION`: the place that
    /// it left, and the direction in which it left.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    place: Option<PlaceDirection>,
    /// `AT_PLACE`: the direction that it faces, the nearest to its heading.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    facing: Option<u32>,
    /// `IN_QUESTION`: the place where it may be, and the direction by which it came in there.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    may_be: Option<PlaceDirection>,
    /// Where it looks, in the frame of headings, radians.
    heading_rad: f64,
}

impl From<v1::TopologicalWhereabouts> for TopologicalWhereabouts {
    fn from(wire: v1::TopologicalWhereabouts) -> Self {
        use v1::TopologicalWhereaboutsKind as Wire;
        let v1::TopologicalWhereabouts { kind, place, facing, may_be, heading_rad } = wire;
        let kind = match Wire::try_from(kind).unwrap_or_default() {
            Wire::Unspecified => TopologicalWhereaboutsKind::Unspecified,
            Wire::AtPlace => TopologicalWhereaboutsKind::AtPlace,
            Wire::OnEdge => TopologicalWhereaboutsKind::OnEdge,
            Wire::InQuestion => TopologicalWhereaboutsKind::InQuestion,
            Wire::Nowhere => TopologicalWhereaboutsKind::Nowhere,
        };
        let [place, may_be] = [place, may_be].map(|of| of.map(PlaceDirection::from));
        Self { kind, place, facing, may_be, heading_rad }
    }
}

/// What is read off the newest firings, the mean of four.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Outlook {
    /// Of distances to near objects, the largest less the smallest, in metres; 0 with fewer than two.
    distance_difference_m: f64,
    /// How little the ring differs from itself turned by half: 1 is the same.
    symmetry_about_center: f64,
    /// The same, mirrored at the best of all lines through the robot.
    symmetry_about_line: f64,
    /// Largest change of a reading since one small step ago, as a share of the smaller of both.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    discontinuity: Option<f64>,
    /// Directions in which one can go.
    open_directions: u32,
    /// How many more there are than one small step ago.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    open_directions_gained: Option<i32>,
    /// From left to right across the heading, in metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    lateral_m: Option<f64>,
    /// What is to be maximised.
    goal: DistinctivenessGoal,
    /// By which rule, for people.
    rule: String,
    /// The next step of the hill-climb, forward and left of the robot, in metres; absent where nothing can
    /// be climbed.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    climb: Option<Point>,
    /// The strategy by which one goes on ahead.
    strategy: ControlStrategy,
    /// How far to turn for it before the next small step, radians.
    steering_rad: f64,
    /// Ways to go, clockwise, from the one ahead on.
    directions: Vec<OpenDirection>,
    /// What stands near, counter-clockwise.
    objects: Vec<NearObject>,
}

impl From<v1::Outlook> for Outlook {
    fn from(wire: v1::Outlook) -> Self {
        let v1::Outlook {
            distance_difference_m,
            symmetry_about_center,
            symmetry_about_line,
            discontinuity,
            open_directions,
            open_directions_gained,
            lateral_m,
            goal,
            rule,
            climb,
            strategy,
            steering_rad,
            directions,
            objects,
        } = wire;
        Self {
            distance_difference_m,
            symmetry_about_center,
            symmetry_about_line,
            discontinuity,
            open_directions,
            open_directions_gained,
            lateral_m,
            goal: DistinctivenessGoal::of(goal),
            rule,
            climb: climb.map(Point::from),
            strategy: ControlStrategy::of(strategy),
            steering_rad,
            directions: directions.into_iter().map(OpenDirection::from).collect(),
            objects: objects.into_iter().map(NearObject::from).collect(),
        }
    }
}

/// A (place, direction) pair of the exploration agenda.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct UnexploredDirection {
    at: PlaceDirection,
    /// Turns, each followed by a travel, from the place where the robot is or was last to beyond the direction:
    /// counted clockwise from where it came in.
    turns: Vec<u32>,
    /// Of a direction of the place where the robot is: how far it would have to turn.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    rotation_rad: Option<f64>,
    /// Whether it is the one that takes the least rotation of those.
    least_rotation: bool,
    /// Whether it is the one that takes the most.
    most_rotation: bool,
}

impl From<v1::UnexploredDirection> for UnexploredDirection {
    fn from(wire: v1::UnexploredDirection) -> Self {
        let v1::UnexploredDirection { at, turns, rotation_rad, least_rotation, most_rotation } =
            wire;
        let at = at.unwrap_or_default().into();
        Self { at, turns, rotation_rad, least_rotation, most_rotation }
    }
}

/// A way there and back whose outcome tells whether a place is the one that it looks like.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct QualitativeRehearsal {
    /// Where the robot left, into the unexplored.
    from: PlaceDirection,
    /// Where it came in, if the place is known.
    may_be: PlaceDirection,
    /// Departures along known edges, if it is.
    route: Vec<PlaceDirection>,
    /// Edges of the route that were travelled there.
    done: u32,
    /// What has to be seen at the end of the route for the place to be the known one, as a star.
    expected: String,
    /// How far it has to be there from the place before, in metres, to within a tenth and 1 m.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    expected_length_m: Option<f64>,
    /// Whether all was as predicted; absent while the robot is on its way there.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    as_predicted: Option<bool>,
    /// Other places that are tested if this is not it.
    others: u32,
}

impl From<v1::QualitativeRehearsal> for QualitativeRehearsal {
    fn from(wire: v1::QualitativeRehearsal) -> Self {
        let v1::QualitativeRehearsal {
            from,
            may_be,
            route,
            done,
            expected,
            expected_length_m,
            as_predicted,
            others,
        } = wire;
        Self {
            from: from.unwrap_or_default().into(),
            may_be: may_be.unwrap_or_default().into(),
            route: route.into_iter().map(PlaceDirection::from).collect(),
            done,
            expected,
            expected_length_m,
            as_predicted,
            others,
        }
    }
}

/// All that is known of an exploration.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct QualitativeDetail {
    exploration: QualitativeExploration,
    step: QualitativeStep,
    whereabouts: TopologicalWhereabouts,
    outlook: Outlook,
    /// In the order in which they were found.
    places: Vec<DistinctivePlace>,
    /// Likewise.
    edges: Vec<TravelEdge>,
    /// Directions that nobody explored, the nearest first.
    agenda: Vec<UnexploredDirection>,
    /// The rehearsal under way; absent if there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    rehearsal: Option<QualitativeRehearsal>,
    /// Rehearsals begun.
    rehearsals: u32,
    /// Those that went otherwise than predicted.
    rehearsals_refuted: u32,
    /// How often a place did not look as known at the end of a known edge.
    surprises: u32,
}

impl From<v1::GetQualitativeExplorationResponse> for QualitativeDetail {
    fn from(wire: v1::GetQualitativeExplorationResponse) -> Self {
        let v1::GetQualitativeExplorationResponse {
            exploration,
            step,
            whereabouts,
            outlook,
            places,
            edges,
            agenda,
            rehearsal,
            rehearsals,
            rehearsals_refuted,
            surprises,
            png: _,
        } = wire;
        Self {
            exploration: exploration.unwrap_or_default().into(),
            step: step.unwrap_or_default().into(),
            whereabouts: whereabouts.unwrap_or_default().into(),
            outlook: outlook.unwrap_or_default().into(),
            places: places.into_iter().map(DistinctivePlace::from).collect(),
            edges: edges.into_iter().map(TravelEdge::from).collect(),
            agenda: agenda.into_iter().map(UnexploredDirection::from).collect(),
            rehearsal: rehearsal.map(QualitativeRehearsal::from),
            rehearsals,
            rehearsals_refuted,
            surprises,
        }
    }
}
