//! Places of grids on the wire.

use meetpoint_geometry::Point2;
use meetpoint_places::{
    ControlLaw, DirectedFragment, Gateway, LocalGateway, LocalPlace, PlaceId, PlaceMap, TravelLaw,
};
use meetpoint_proto::v1;

/// A place for the wire, with where its gateways lead.
pub(crate) fn to_wire(id: PlaceId, local: &LocalPlace, map: &PlaceMap) -> v1::Place {
    let gateways = (0..).zip(&local.gateways).map(|(index, gateway)| {
        let to = map.leads_to(Gateway { place: id, index });
        gateway_to_wire(gateway, to)
    });
    let fragments = local.small_scale_star.fragments().iter().copied().map(fragment_to_wire);
    v1::Place {
        number: id.0,
        core: Some(point(local.core)),
        clearance_m: local.clearance_m,
        star: local.star.to_string(),
        gateways: gateways.collect(),
        fragments: fragments.collect(),
    }
}

/// A number of what a map has, as far as 32 bits go.
pub(crate) fn count(n: usize) -> u32 {
    u32::try_from(n).unwrap_or(u32::MAX)
}

fn gateway_to_wire(gateway: &LocalGateway, to: Option<Gateway>) -> v1::PlaceGateway {
    let width_m = gateway.width_m();
    let LocalGateway { ends: [left, right], heading_rad, control_law, continues_to } = *gateway;
    v1::PlaceGateway {
        left: Some(point(left)),
        right: Some(point(right)),
        heading_rad,
        width_m,
        law: law(TravelLaw::By(control_law)).into(),
        continues_to: continues_to.map(u32::from),
        to_place: to.map(|to| to.place.0),
        to_gateway: to.map_or(0, |to| u32::from(to.index)),
    }
}

fn fragment_to_wire(tuple: DirectedFragment) -> v1::PathFragment {
    let DirectedFragment { fragment, is_plus, outward, inward, law: travel_law } = tuple;
    v1::PathFragment {
        number: u32::from(fragment),
        plus: is_plus,
        outward: outward.map(u32::from),
        inward: inward.map(u32::from),
        law: law(travel_law).into(),
    }
}

fn law(law: TravelLaw) -> v1::TravelLaw {
    match law {
        TravelLaw::By(ControlLaw::Midline) => v1::TravelLaw::Midline,
        TravelLaw::By(ControlLaw::LeftWall) => v1::TravelLaw::LeftWall,
        TravelLaw::By(ControlLaw::RightWall) => v1::TravelLaw::RightWall,
        TravelLaw::By(ControlLaw::BlindStep) => v1::TravelLaw::BlindStep,
        TravelLaw::DeadEnd => v1::TravelLaw::DeadEnd,
        TravelLaw::None => v1::TravelLaw::None,
    }
}

fn point(at: Point2<f64>) -> v1::Point {
    v1::Point { x_m: at.x, y_m: at.y }
}
