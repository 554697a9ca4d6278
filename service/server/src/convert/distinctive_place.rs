//! Distinctive places and the edges between them.

use meetpoint_places::qualitative::{
    Averaged, KnownPlace, NearObject, OpenDirection, PlaceGraph, TravelEdge,
};
use meetpoint_places::{ControlLaw, Gateway, PlaceId};
use meetpoint_proto::v1;

use super::hypothesis::small;
use super::qualitative::{goal, strategy};

/// A direction of a place.
pub(crate) fn direction(gateway: Gateway) -> v1::PlaceDirection {
    v1::PlaceDirection { place: gateway.place.0, direction: gateway.index.into() }
}

/// A way to go.
pub(crate) fn open_direction(of: OpenDirection, leads_to: Option<Gateway>) -> v1::OpenDirection {
    let OpenDirection { heading_rad, control_law } = of;
    let law = match control_law {
        ControlLaw::Midline => v1::TravelLaw::Midline,
        ControlLaw::LeftWall => v1::TravelLaw::LeftWall,
        ControlLaw::RightWall => v1::TravelLaw::RightWall,
        ControlLaw::BlindStep => v1::TravelLaw::BlindStep,
    };
    let leads_to = leads_to.map(direction);
    v1::OpenDirection { heading_rad, law: law.into(), leads_to }
}

/// What stands near.
pub(crate) fn objects(objects: &[NearObject]) -> Vec<v1::NearObject> {
    let object = |&NearObject { heading_rad, distance_m }: &NearObject| v1::NearObject {
        heading_rad,
        distance_m,
    };
    objects.iter().map(object).collect()
}

/// All places, in the order of their numbers.
pub(crate) fn places(graph: &PlaceGraph) -> Vec<v1::DistinctivePlace> {
    let ids = graph.map().places().map(|(id, _)| id);
    ids.filter_map(|id| Some(place(graph, id, graph.place(id)?))).collect()
}

fn place(graph: &PlaceGraph, id: PlaceId, known: &KnownPlace) -> v1::DistinctivePlace {
    let KnownPlace { seen, reckoned_from: _, n_visits } = known;
    let open = |(index, of): (u8, &OpenDirection)| {
        open_direction(*of, graph.map().leads_to(Gateway { place: id, index }))
    };
    v1::DistinctivePlace {
        number: id.0,
        star: seen.observation().star.to_string(),
        goal: goal(seen.goal).into(),
        home: seen.is_home,
        visits: *n_visits,
        position: Some(v1::Point { x_m: seen.position.x, y_m: seen.position.y }),
        directions: (0..).zip(&seen.directions).map(open).collect(),
        objects: objects(&seen.objects),
    }
}

/// All edges, in the order in which they were found.
pub(crate) fn edges(graph: &PlaceGraph) -> Vec<v1::TravelEdge> {
    graph.edges().iter().map(edge).collect()
}

fn edge(edge: &TravelEdge) -> v1::TravelEdge {
    let TravelEdge { ends: [from, to], strategy: by, length_m, width_m, turned_rad } = edge;
    v1::TravelEdge {
        from: Some(direction(*from)),
        to: Some(direction(*to)),
        strategy: strategy(*by).into(),
        traversals: length_m.n,
        length_m: Some(averaged(length_m)),
        width_m: Some(averaged(width_m)),
        turned_rad: Some(averaged(turned_rad)),
        curvature_rad_per_m: edge.curvature_rad_per_m(),
    }
}

fn averaged(of: &Averaged) -> v1::Averaged {
    let mean = (0 < of.n).then_some(of.mean);
    v1::Averaged { measured: small(of.n as usize), mean, std: of.std() }
}
