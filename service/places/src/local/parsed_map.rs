//! A grid parsed into places: gateways, stars, and which gateway leads to which.
//!
//! Every neighborhood of the medial axis has a gateway on each line that leaves it. It is a place if
//! robots have a choice there: not if a single path passes and nothing else, for then it lies on
//! that path, which goes on through it (HSSH 2004, section III-B). So the corner of a corridor is no
//! place, and a dead end is one. What remains is a topological map of which everything is known.
//!
//! Time O(cells log cells) for the axis, see `branch.rs` for gateways; space O(cells).

use std::collections::BTreeMap;
use std::f64::consts::PI;

use meetpoint_geometry::{Point2, Pose, wrap_angle};
use meetpoint_occupancy::Raster;

use crate::local::branch::Branch;
use crate::local::fragments::passages;
use crate::local::gateway::LocalGateway;
use crate::local::medial_axis::MedialAxis;
use crate::local::neighborhood::{Departure, Neighborhood, neighborhoods};
use crate::local::params::LocalParams;
use crate::local::sight::free_way_m;
use crate::local::small_scale_star::{SmallScaleStar, from_north_rad};
use crate::local::walls::control_law;
use crate::observation::Observation;
use crate::place_map::{Gateway, PlaceId, PlaceMap};
use crate::star::{N_GATEWAYS_MAX, Opening, Star};

/// A neighborhood with its gateways: a place, or on a path.
#[derive(Clone, Debug, PartialEq)]
pub struct LocalPlace {
    /// The middle of its widest cell, in the map's frame, in metres.
    pub core: Point2<f64>,
    /// How far the walls are from there, in metres.
    pub clearance_m: f64,
    /// Clockwise, from north on as seen from the core.
    pub gateways: Vec<LocalGateway>,
    /// Directed path fragments, clockwise.
    pub small_scale_star: SmallScaleStar,
    /// Local topology, read from the first gateway.
    pub star: Star,
    /// Which place of the map it is; `None` if it lies on a path.
    pub place: Option<PlaceId>,
    departures: Vec<Departure>,
}

impl LocalPlace {
    /// Whether a single path passes, and nothing else.
    fn is_on_path(&self) -> bool {
        self.gateways.len() == 2 && self.gateways[0].continues_to.is_some()
    }

    /// Whether a point is so near to the core that it is at this place and not on the way there.
    pub fn holds(&self, point: Point2<f64>, params: &LocalParams) -> bool {
        let reach_m = params.neighborhood.junction_reach * self.clearance_m;
        (point - self.core).norm() <= reach_m
    }

    /// The same as seen from another frame, where `frame_from_map` says the map lies. Gateways keep
    /// their order, though another may be the northernmost.
    pub fn in_frame(&self, frame_from_map: Pose) -> Self {
        let gateways = self.gateways.iter().map(|gateway| LocalGateway {
            ends: gateway.ends.map(|end| frame_from_map * end),
            heading_rad: wrap_angle(frame_from_map.theta_rad + gateway.heading_rad),
            ..*gateway
        });
        Self { core: frame_from_map * self.core, gateways: gateways.collect(), ..self.clone() }
    }
}

/// A grid's places.
#[derive(Clone, Debug, PartialEq)]
pub struct ParsedMap {
    /// All neighborhoods with gateways; those on paths too. By the clearance of their cores,
    /// falling.
    pub neighborhoods: Vec<LocalPlace>,
    /// The places among them, in their order, and how paths join them.
    pub map: PlaceMap,
}

impl ParsedMap {
    /// The places, in the order of their ids.
    pub fn places(&self) -> impl Iterator<Item = (PlaceId, &LocalPlace)> {
        self.neighborhoods.iter().filter_map(|local| Some((local.place?, local)))
    }

    /// The neighborhood that a point is in: of those that hold it the one with the nearest core.
    pub fn at(&self, point: Point2<f64>, params: &LocalParams) -> Option<&LocalPlace> {
        let holding = self.neighborhoods.iter().filter(|local| local.holds(point, params));
        let away = |local: &LocalPlace| (local.core - point).norm();
        holding.min_by(|a, b| away(a).total_cmp(&away(b)))
    }
}

/// Parses a grid into places. A place of more gateways than any star has keeps the widest.
pub fn parsed_map(raster: &Raster, params: &LocalParams) -> ParsedMap {
    let axis = MedialAxis::new(raster, params);
    let mut surveys: Vec<Survey> = neighborhoods(&axis, &params.neighborhood)
        .into_iter()
        .map(|neighborhood| Survey::new(&axis, neighborhood, params))
        .collect();
    let all = surveys.iter().flat_map(|survey| &survey.found);
    let cells: BTreeMap<Departure, usize> = all.map(|found| (found.departure, found.at)).collect();
    for survey in &mut surveys {
        survey.find_laws(&axis, params, |departure| cells.get(&departure).copied());
    }
    let places = surveys.into_iter().filter_map(|survey| survey.local_place(&axis, params));
    let mut places: Vec<LocalPlace> = places.collect();
    let mut map = PlaceMap::default();
    for local in &mut places {
        if !local.is_on_path() {
            local.place = Some(map.add_place(&Observation::from(local.star.clone())));
        }
    }
    link(&mut map, &places);
    ParsedMap { neighborhoods: places, map }
}

/// The same as [`ParsedMap::at`] of [`parsed_map`], but for ids: the one place of a map counts as
/// the first. Gateways elsewhere are not looked for.
pub(crate) fn place_at(
    raster: &Raster,
    point: Point2<f64>,
    params: &LocalParams,
) -> Option<LocalPlace> {
    let axis = MedialAxis::new(raster, params);
    let groups = neighborhoods(&axis, &params.neighborhood);
    let clearance_m: BTreeMap<Departure, f64> = groups
        .iter()
        .flat_map(|group| group.departures.iter().map(|&departure| (departure, group.core)))
        .map(|(departure, core)| (departure, axis.clearance_at_m(core)))
        .collect();
    let surveys = groups.into_iter().filter_map(|group| {
        let core = axis.point(axis.nodes[group.core].cell);
        let reach_m = params.neighborhood.junction_reach * axis.clearance_at_m(group.core);
        let away_m = (core - point).norm();
        (away_m <= reach_m).then_some((away_m, group))
    });
    let mut near: Vec<(f64, Neighborhood)> = surveys.collect();
    near.sort_by(|a, b| a.0.total_cmp(&b.0));
    let other = |departure: Departure| {
        let found = Found::new(&axis, departure, *clearance_m.get(&departure)?, params)?;
        Some(found.at)
    };
    near.into_iter().find_map(|(_, group)| {
        let mut survey = Survey::new(&axis, group, params);
        survey.find_laws(&axis, params, other);
        let mut local = survey.local_place(&axis, params)?;
        local.place = (!local.is_on_path()).then_some(PlaceId(0));
        Some(local)
    })
}

/// A gateway on its branch.
struct Found {
    gateway: LocalGateway,
    departure: Departure,
    /// Which cell of the branch.
    at: usize,
}

impl Found {
    /// `None` if there is none on that branch, or only a crack, or a corner.
    fn new(
        axis: &MedialAxis,
        departure: Departure,
        core_m: f64,
        params: &LocalParams,
    ) -> Option<Self> {
        let branch = Branch::new(axis, departure);
        let at = branch.gateway(core_m, params)?;
        let gateway = LocalGateway::new(axis, &branch, at);
        let [left, right] = gateway.ends.map(|end| end - axis.point(branch.cells[at]));
        let is_passable = params.gateway.width_min_m <= gateway.width_m()
            && params.gateway.opening_min_rad <= left.angle(&right);
        is_passable.then_some(Self { gateway, departure, at })
    }
}

/// The gateways of a neighborhood, clockwise.
struct Survey {
    core: Point2<f64>,
    clearance_m: f64,
    found: Vec<Found>,
}

impl Survey {
    fn new(axis: &MedialAxis, neighborhood: Neighborhood, params: &LocalParams) -> Self {
        let Neighborhood { core, departures } = neighborhood;
        let clearance_m = axis.clearance_at_m(core);
        let core = axis.point(axis.nodes[core].cell);
        let found = departures
            .into_iter()
            .filter_map(|departure| Found::new(axis, departure, clearance_m, params));
        let mut found: Vec<Found> = found.collect();
        found.sort_by(|a, b| b.gateway.width_m().total_cmp(&a.gateway.width_m()));
        found.truncate(N_GATEWAYS_MAX);
        let bearing_rad = |found: &Found| {
            let offset = found.gateway.center() - core;
            from_north_rad(offset.y.atan2(offset.x))
        };
        found.sort_by(|a, b| bearing_rad(a).total_cmp(&bearing_rad(b)));
        Self { core, clearance_m, found }
    }

    /// Finds by which law one travels from each gateway: that of the middle of the way to the gateway
    /// that `other` says is at the other end of the line, or of a point beyond, if there is none.
    fn find_laws(
        &mut self,
        axis: &MedialAxis,
        params: &LocalParams,
        other: impl Fn(Departure) -> Option<usize>,
    ) {
        for Found { gateway, departure, at } in &mut self.found {
            let branch = Branch::new(axis, *departure);
            let Departure { line, end } = *departure;
            let middle = match other(Departure { line, end: 1 - end }) {
                Some(other) => {
                    (branch.cells.len() - 1).saturating_sub(other).midpoint(*at).max(*at)
                }
                None => branch.beyond(*at, params.law.beyond_m),
            };
            gateway.control_law = control_law(&axis.space, branch.pose(middle), &params.law);
        }
    }

    /// The place; `None` if it has no gateway.
    fn local_place(self, axis: &MedialAxis, params: &LocalParams) -> Option<LocalPlace> {
        let Self { core, clearance_m, found } = self;
        let departures = found.iter().map(|found| found.departure).collect();
        let mut gateways: Vec<LocalGateway> =
            found.into_iter().map(|found| found.gateway).collect();
        let passages = fragments(&gateways, clearance_m, params);
        for (gateway, onward) in gateways.iter_mut().zip(passages) {
            gateway.continues_to = onward.and_then(|onward| u8::try_from(onward).ok());
        }
        let star = star(&gateways)?;
        let small_scale_star = SmallScaleStar::new(&gateways, core, |index| {
            let gateway = &gateways[usize::from(index)];
            let sight_m = 2.0 * (gateway.center() - core).norm() + params.law.wall_range_max_m;
            let inward_rad = gateway.heading_rad + PI;
            free_way_m(&axis.space, gateway.center(), inward_rad, sight_m) < sight_m
        });
        let place = None;
        Some(LocalPlace { core, clearance_m, gateways, small_scale_star, star, place, departures })
    }
}

/// Passages, and the only way on in a corridor that turns.
fn fragments(
    gateways: &[LocalGateway],
    clearance_m: f64,
    params: &LocalParams,
) -> Vec<Option<usize>> {
    let narrowest_m = gateways.iter().map(LocalGateway::width_m).fold(f64::INFINITY, f64::min);
    let is_corridor = 2.0 * clearance_m < params.neighborhood.room_widening_min * narrowest_m;
    if gateways.len() == 2 && is_corridor {
        return vec![Some(1), Some(0)];
    }
    passages(gateways, &params.fragment)
}

/// The star of gateways in clockwise order; `None` without gateways.
fn star(gateways: &[LocalGateway]) -> Option<Star> {
    let n = gateways.len();
    let openings = gateways.iter().enumerate().map(|(index, gateway)| {
        let onward = gateway.continues_to.map_or(0, |to| (usize::from(to) + n - index) % n);
        let continues_after = u8::try_from(onward).unwrap_or(0);
        Opening { continues_after, control_law: gateway.control_law }
    });
    Star::new(openings.collect()).ok()
}

/// Says which gateway leads to which: along its line, and on through all that lies on paths.
fn link(map: &mut PlaceMap, places: &[LocalPlace]) {
    let ends = places.iter().enumerate().flat_map(|(local, place)| {
        let ends = place.departures.iter().enumerate();
        ends.map(move |(index, &departure)| (departure, (local, index)))
    });
    let ends: BTreeMap<Departure, (usize, usize)> = ends.collect();
    let gateway = |(local, index): (usize, usize)| {
        let place: PlaceId = places[local].place?;
        Some(Gateway { place, index: u8::try_from(index).ok()? })
    };
    for &from in ends.values() {
        let Some(here) = gateway(from) else { continue };
        let mut at = from;
        // A path meets no gateway twice on its way to the next place.
        for _ in 0..ends.len() {
            let Departure { line, end } = places[at.0].departures[at.1];
            let Some(&arrival) = ends.get(&Departure { line, end: 1 - end }) else { break };
            if let Some(there) = gateway(arrival) {
                // Each way is found from both of its ends.
                if here < there {
                    map.link(here, there);
                }
                break;
            }
            at = (arrival.0, 1 - arrival.1);
        }
    }
}
