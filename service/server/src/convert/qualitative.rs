//! Explorations by small steps: what is told to robots and people.

use meetpoint_geometry::angle_between;
use meetpoint_places::Gateway;
use meetpoint_places::qualitative::{
    Command, Explorer, ExplorerState, Goal, Guide, N_CONES, Outlook, SelectionRule, Strategy,
    Whereabouts,
};
use meetpoint_proto::v1;

use super::distinctive_place::{direction, objects, open_direction};
use super::hypothesis::small;
use crate::error::Error;
use crate::qualitative::Explored;

/// How it explores.
pub(crate) fn exploration(map: &str, explored: &Explored) -> v1::QualitativeExploration {
    let (begun, begun_after_batch) = explored.begun();
    v1::QualitativeExploration {
        session: explored.session().0.to_string(),
        map: map.to_owned(),
        sensor: explored.eye().sensor().to_owned(),
        cones: small(N_CONES),
        folded: explored.eye().is_folded(),
        compass: begun.has_compass,
        selection: match begun.selection {
            SelectionRule::LeastRotation => v1::TravelSelection::LeastRotation,
            SelectionRule::MostRotation => v1::TravelSelection::MostRotation,
        }
        .into(),
        corridor_width_m: begun.corridor_width_m,
        rehearsal_edges_max: small(begun.n_rehearsal_edges_max),
        begun_after_batch,
        read_through: explored.read_through(),
        firings_left_out: explored.n_left_out(),
        batches_skipped: explored.n_batches_skipped(),
    }
}

/// A rule of selection; the first one where nothing is said.
///
/// # Errors
/// [`Error::InvalidField`].
pub(crate) fn selection(wire: i32) -> Result<SelectionRule, Error> {
    match v1::TravelSelection::try_from(wire) {
        Ok(v1::TravelSelection::Unspecified | v1::TravelSelection::LeastRotation) => {
            Ok(SelectionRule::LeastRotation)
        }
        Ok(v1::TravelSelection::MostRotation) => Ok(SelectionRule::MostRotation),
        Err(_) => Err(Error::field("selection", format!("{wire} is none of its values"))),
    }
}

/// What the robot is to do next.
pub(crate) fn step(guide: &Guide, stamp_ns: i64) -> v1::QualitativeStep {
    let (kind, turn_rad, move_m) = match guide.next() {
        Command::Turn { by_rad } => (v1::StepKind::Turn, Some(by_rad), None),
        Command::Move { by_m } => (v1::StepKind::Move, None, Some(by_m)),
        Command::Look => (v1::StepKind::Look, None, None),
        Command::Done => (v1::StepKind::Done, None, None),
    };
    let state = match guide.explorer().state() {
        ExplorerState::Starting => v1::QualitativeState::Starting,
        ExplorerState::Exploring => v1::QualitativeState::Exploring,
        ExplorerState::Rehearsing => v1::QualitativeState::Rehearsing,
        ExplorerState::Travelling => v1::QualitativeState::Travelling,
        ExplorerState::Complete => v1::QualitativeState::Complete,
        ExplorerState::GaveUp => v1::QualitativeState::GaveUp,
    };
    v1::QualitativeStep {
        kind: kind.into(),
        turn_rad,
        move_m,
        state: state.into(),
        stamp_ns,
        firings: guide.n_firings(),
        steps: guide.n_steps(),
        standing: guide.n_standing(),
    }
}

/// Where the robot is.
pub(crate) fn whereabouts(explorer: &Explorer) -> v1::TopologicalWhereabouts {
    use v1::TopologicalWhereaboutsKind as Kind;
    let of = |kind: Kind, place: Option<Gateway>, heading_rad| v1::TopologicalWhereabouts {
        kind: kind.into(),
        place: place.map(direction),
        facing: None,
        may_be: None,
        heading_rad,
    };
    match explorer.whereabouts() {
        Whereabouts::AtPlace { came_by, heading_rad } => {
            let facing = facing(explorer, came_by, heading_rad);
            v1::TopologicalWhereabouts { facing, ..of(Kind::AtPlace, Some(came_by), heading_rad) }
        }
        Whereabouts::OnEdge { since: Some(since), heading_rad } => {
            of(Kind::OnEdge, Some(since), heading_rad)
        }
        Whereabouts::OnEdge { since: None, heading_rad } => of(Kind::Nowhere, None, heading_rad),
        Whereabouts::InQuestion { since, may_be, heading_rad } => v1::TopologicalWhereabouts {
            may_be: Some(direction(may_be)),
            ..of(Kind::InQuestion, Some(since), heading_rad)
        },
    }
}

/// The direction of a place that is nearest to where the robot looks.
fn facing(explorer: &Explorer, at: Gateway, heading_rad: f64) -> Option<u32> {
    let known = explorer.graph().place(at.place)?;
    let off_rad =
        |index: usize| angle_between(heading_rad, known.seen.directions[index].heading_rad).abs();
    let nearest =
        (0..known.seen.directions.len()).min_by(|&a, &b| off_rad(a).total_cmp(&off_rad(b)))?;
    Some(small(nearest))
}

/// What it has before it.
pub(crate) fn outlook(outlook: &Outlook) -> v1::Outlook {
    let Outlook {
        heading_rad,
        ring: _,
        measures,
        has_before,
        around,
        goal: to_maximise,
        climb,
        strategy: fitting,
        steering_rad,
    } = outlook;
    let mut directions = around.directions.clone();
    if let Some((ahead, _)) = around.direction_towards(*heading_rad) {
        directions.rotate_left(ahead);
    }
    let (sin, cos) = heading_rad.sin_cos();
    let gained = i32::try_from(measures.n_open_directions_gained).unwrap_or(i32::MAX);
    v1::Outlook {
        distance_difference_m: measures.distance_difference_m,
        symmetry_about_center: measures.symmetry_about_center,
        symmetry_about_line: measures.symmetry_about_line,
        discontinuity: has_before.then_some(measures.discontinuity),
        open_directions: small(measures.n_open_directions),
        open_directions_gained: has_before.then_some(gained),
        lateral_m: Some(measures.lateral_m).filter(|lateral_m| lateral_m.is_finite()),
        goal: goal(*to_maximise).into(),
        rule: rule(*to_maximise, around.objects.len()),
        climb: climb.map(|step| v1::Point {
            x_m: cos * step.x + sin * step.y,
            y_m: cos * step.y - sin * step.x,
        }),
        strategy: strategy(*fitting).into(),
        steering_rad: *steering_rad,
        directions: directions.iter().map(|of| open_direction(*of, None)).collect(),
        objects: objects(&around.objects),
    }
}

/// What is to be maximised.
pub(crate) fn goal(goal: Goal) -> v1::DistinctivenessGoal {
    match goal {
        Goal::Passage => v1::DistinctivenessGoal::Passage,
        Goal::EqualDistances => v1::DistinctivenessGoal::EqualDistances,
        Goal::WallDistances => v1::DistinctivenessGoal::WallDistances,
        Goal::ComeCloser => v1::DistinctivenessGoal::ComeCloser,
    }
}

/// By which rule, for people.
fn rule(goal: Goal, n_objects: usize) -> String {
    match goal {
        Goal::Passage => {
            "two ways and walls between them on either side: one passes here".to_owned()
        }
        Goal::EqualDistances => format!(
            "no open space and {n_objects} near objects, at least 3: proper to maximise is the likeness \
             of distances to them (DP-R10)"
        ),
        Goal::WallDistances => format!(
            "open space and {n_objects} near objects, at least 2: proper to maximise is the likeness of \
             their distances to that at which walls are walked along"
        ),
        Goal::ComeCloser => {
            format!("no passage, and {n_objects} near objects, too few: come closer")
        }
    }
}

/// How one goes along an edge.
pub(crate) fn strategy(strategy: Strategy) -> v1::ControlStrategy {
    match strategy {
        Strategy::FollowMidline => v1::ControlStrategy::FollowMidline,
        Strategy::WalkAlongLeft => v1::ControlStrategy::WalkAlongLeft,
        Strategy::WalkAlongRight => v1::ControlStrategy::WalkAlongRight,
        Strategy::BlindStep => v1::ControlStrategy::BlindStep,
    }
}

/// The exploration agenda, the nearest first.
pub(crate) fn agenda(explorer: &Explorer) -> Vec<v1::UnexploredDirection> {
    let Some(came_by) = explorer.last_place() else { return Vec::new() };
    let (graph, whereabouts) = (explorer.graph(), explorer.whereabouts());
    let looking_rad = match whereabouts {
        Whereabouts::AtPlace { heading_rad, .. } => Some(heading_rad),
        _ => None,
    };
    let rotation_rad = |at: Gateway| {
        let known = graph.place(at.place).filter(|_| at.place == came_by.place)?;
        let heading_rad = known.seen.directions.get(usize::from(at.index))?.heading_rad;
        Some(angle_between(looking_rad?, heading_rad).abs())
    };
    let agenda = graph.map().agenda(came_by);
    let here = || agenda.iter().filter_map(|(at, _)| Some((*at, rotation_rad(*at)?)));
    let least = here().min_by(|a, b| a.1.total_cmp(&b.1)).map(|(at, _)| at);
    let most = here().max_by(|a, b| a.1.total_cmp(&b.1)).map(|(at, _)| at);
    let item = |(at, turns): &(Gateway, Vec<u8>)| v1::UnexploredDirection {
        at: Some(direction(*at)),
        turns: turns.iter().map(|&turn| turn.into()).collect(),
        rotation_rad: rotation_rad(*at),
        least_rotation: least == Some(*at),
        most_rotation: most == Some(*at),
    };
    agenda.iter().map(item).collect()
}

/// The rehearsal under way.
pub(crate) fn rehearsal(explorer: &Explorer) -> Option<v1::QualitativeRehearsal> {
    let of = explorer.rehearsing()?;
    let graph = explorer.graph();
    let last = of.route.last().copied();
    let expected = last.and_then(|leg| graph.map().leads_to(leg));
    let expected = expected.map(|at| graph.map().observation(at).star.to_string());
    Some(v1::QualitativeRehearsal {
        from: Some(direction(of.from)),
        may_be: Some(direction(of.may_be)),
        route: of.route.iter().copied().map(direction).collect(),
        done: small(of.n_done),
        expected: expected.unwrap_or_default(),
        expected_length_m: last.and_then(|leg| graph.edge(leg)).map(|edge| edge.length_m.mean),
        as_predicted: of.outcome,
        others: small(of.n_others),
    })
}
