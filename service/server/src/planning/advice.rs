//! What can be done where there is no path, for people.

use meetpoint_geometry::Point2;
use meetpoint_planning::{Space, TolledSearch, Tolls, enterable, nearest_enterable};

use super::costs::CostKind;
use super::ends::Nowhere;
use super::field::Field;

/// So far is looked for a point where the robot fits, in metres.
const NEAREST_MAX_M: f64 = 10.0;

/// What to do about an end (`start` or `goal`) where the robot cannot be.
pub(crate) fn nowhere(field: &Field, end: &str, point: Point2<f64>, why: Nowhere) -> String {
    let radius_m = field.profile.radius_m;
    let reason = match why {
        Nowhere::Occupied => {
            format!(
                "a robot of {radius_m} m radius does not fit at the {end}: an obstacle is nearer"
            )
        }
        Nowhere::Unknown => {
            format!("the {end} was never observed: map the place, or choose another")
        }
        Nowhere::Outside => {
            let info = field.info();
            let (low, side_m) = (info.origin(), field.ground.side_m());
            let high = |low: f64, n: u32| low + f64::from(n) * side_m;
            return format!(
                "the {end} lies outside of the map, which reaches from ({:.2}, {:.2}) to ({:.2}, \
                 {:.2}) m",
                low.x,
                low.y,
                high(low.x, info.width),
                high(low.y, info.height),
            );
        }
    };
    match nearest_enterable(&field.space, point, NEAREST_MAX_M) {
        Some(nearest) => format!(
            "{reason}; the nearest point where it fits is ({:.3}, {:.3}) m, {:.2} m away",
            nearest.point.x, nearest.point.y, nearest.moved_m
        ),
        None => format!("{reason}; it fits nowhere within {NEAREST_MAX_M} m"),
    }
}

/// What to do where no path leads from one cell to another.
pub(crate) fn no_route(field: &Field, from: usize, to: usize) -> String {
    let mut search = TolledSearch::default();
    let open = Tolls::default();
    if search.between(&field.space, &open, from, to).is_some() {
        let cells = search.path(&field.space, &open, to);
        return format!("a way would lead through closed arcs: open {}", closed(field, &cells));
    }
    let ground = &field.ground;
    let space = |radius_m: f64| Space::uniform(field.info(), &enterable(&ground.free, radius_m));
    let mut is_joined = |radius_m: f64| {
        let space = space(radius_m).ok();
        space.is_some_and(|space| search.between(&space, &open, from, to).is_some())
    };
    if field.costs.obstacles().next().is_some() && is_joined(field.profile.radius_m) {
        return "obstacles that were drawn stand in the way: take one back (costs)".to_owned();
    }
    if 0.0 < field.profile.radius_m && is_joined(0.0) {
        let radius_m = field.profile.radius_m;
        return format!("the only ways are too narrow for a robot of {radius_m} m radius");
    }
    "nothing that was observed joins the two places: map the way between them".to_owned()
}

/// The closed arcs that a path crosses, with who closed them.
fn closed(field: &Field, cells: &[u32]) -> String {
    let ground = &field.ground;
    let graph = ground.topology.graph();
    let route = meetpoint_planning::stretches(&field.space, &ground.partition, graph, cells);
    let described = route.iter().filter_map(|stretch| {
        let id = ground.arc_id(stretch.arc?);
        let cost = field.costs.of_arc(id)?;
        if !matches!(cost.kind, CostKind::Closure(_)) {
            return None;
        }
        let by =
            if cost.author.is_empty() { String::new() } else { format!(" by {}", cost.author) };
        let why = if cost.reason.is_empty() { String::new() } else { format!(": {}", cost.reason) };
        Some(format!("arc {id} (closed{by}{why})"))
    });
    described.collect::<Vec<_>>().join(", ")
}
