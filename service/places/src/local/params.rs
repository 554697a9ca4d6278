//! What the parsing of grids into places goes by.

use std::f64::consts::{FRAC_PI_4, PI};

use meetpoint_topology::{MeetPointParams, TopologyParams, VoronoiParams};

use crate::local::gateway::GatewayCriterion;

/// Tunables of [`parsed_map`](crate::parsed_map).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalParams {
    /// By which criterion gateways are found.
    pub criterion: GatewayCriterion,
    /// An obstacle that stands alone is no wall if the diagonal of its bounding box is shorter, in
    /// metres.
    pub island_extent_max_m: f64,
    /// Of the diagram.
    pub voronoi: VoronoiParams,
    /// Shortest branch of the medial axis, in metres.
    pub arm_m: f64,
    /// Free cells that border on what was never observed make a branch that ends beside them lead
    /// on, from this length on, in metres.
    pub frontier_min_m: f64,
    /// Of neighborhoods of places.
    pub neighborhood: NeighborhoodParams,
    /// Of gateways.
    pub gateway: GatewayParams,
    /// Of path fragments.
    pub fragment: FragmentParams,
    /// Of control laws.
    pub law: LawParams,
}

/// What belongs to one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NeighborhoodParams {
    /// Junctions nearer to a place's core than so many times the core's clearance, along the medial
    /// axis, are part of it ...
    pub junction_reach: f64,
    /// ... and so are ends of the axis: what is left of a room behind its middle.
    pub end_reach: f64,
    /// Not if space between is narrower by this factor than on both of its sides: a door parts.
    pub narrowing_min: f64,
    /// A passage that is wider than its narrowest places on both sides by this factor is a room. A
    /// crossing of two corridors of one width is 1.41 times as wide as they are, the corner of a
    /// corridor 1.17 times.
    pub room_widening_min: f64,
}

/// Where on a branch of the medial axis the gateway is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GatewayParams {
    /// What is narrower is a crack and no gateway, in metres.
    pub width_min_m: f64,
    /// The walls on its two sides lie at least so far apart as seen from the axis, in radians: else it leads into
    /// their corner.
    pub opening_min_rad: f64,
    /// Constriction: what is wider by this factor than something a corridor's width ahead is none.
    pub fall_min: f64,
    /// Constriction: how far that looks ahead, as a multiple of the clearance.
    pub ahead: f64,
    /// Visibility: how far one sees, in metres.
    pub sight_m: f64,
    /// Visibility: from one point that is looked at to the next, in metres.
    pub stride_m: f64,
    /// Visibility: what of the area in view changes at a gateway while one goes as far as it is
    /// wide, at least.
    pub change_min: f64,
    /// Visibility: a gateway is no farther from the core than so many times its clearance.
    pub reach: f64,
}

/// Which gateways lie on one path fragment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FragmentParams {
    /// Who passes through a place straight on turns by no more than this in all, in radians.
    pub turn_max_rad: f64,
    /// A continuation is clear if every other one turns by more than it does by this much, in
    /// radians.
    pub margin_rad: f64,
}

/// By which control law one travels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LawParams {
    /// Walls up to so far from each other are followed in their middle, in metres.
    pub midline_width_max_m: f64,
    /// A wall is followed up to this distance, in metres.
    pub wall_range_max_m: f64,
    /// How far beyond a gateway its law is looked for where no other gateway is known on the way, but
    /// no farther than half the way to the next node of the medial axis, in metres.
    pub beyond_m: f64,
}

impl LocalParams {
    /// Buildings for people, and robots with a laser in them, gateways being constrictions as in
    /// the paper's figures. A gap under 0.5 m lets no robot through. A turn of half a right angle is no longer straight on; a sixth of it tells two
    /// ways apart. Corridors are up to 4 m wide.
    pub const INDOOR: Self = Self {
        criterion: GatewayCriterion::Constriction,
        island_extent_max_m: TopologyParams::INDOOR.island_extent_max_m,
        voronoi: TopologyParams::INDOOR.voronoi,
        arm_m: MeetPointParams::INDOOR.arm_m,
        frontier_min_m: 0.2,
        neighborhood: NeighborhoodParams {
            junction_reach: 1.5,
            end_reach: 2.0,
            narrowing_min: 1.2,
            room_widening_min: 1.5,
        },
        gateway: GatewayParams {
            width_min_m: 0.5,
            opening_min_rad: TopologyParams::INDOOR.critical.opening_min_rad,
            fall_min: 1.1,
            ahead: 2.0,
            sight_m: 4.0,
            stride_m: 0.2,
            change_min: 0.1,
            reach: 3.0,
        },
        fragment: FragmentParams { turn_max_rad: FRAC_PI_4, margin_rad: PI / 12.0 },
        law: LawParams { midline_width_max_m: 4.0, wall_range_max_m: 2.5, beyond_m: 0.5 },
    };

    /// The same with gateways found otherwise.
    pub fn by(self, criterion: GatewayCriterion) -> Self {
        Self { criterion, ..self }
    }
}
