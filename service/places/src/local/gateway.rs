//! Gateways of a place, as segments of a local map.
//!
//! "A gateway is a boundary between qualitatively different regions of the environment" (HSSH
//! 2004, section III-B), drawn as the line between the closest obstacles on both sides of a cell of
//! the medial axis (Fig. 3 (c)).

use meetpoint_geometry::{Point2, Vector2};
use meetpoint_topology::basis_points;

use crate::local::branch::Branch;
use crate::local::medial_axis::MedialAxis;
use crate::star::ControlLaw;

/// What makes a gateway (HSSH 2004, section III-B).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum GatewayCriterion {
    /// A constriction of the medial axis: the one of the paper's figures.
    Constriction,
    /// A major change of what is in view (E. Chown, S. Kaplan and D. Kortenkamp 1995).
    Visibility,
    /// Where another control law begins to apply.
    ControlLaw,
}

impl GatewayCriterion {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Constriction, Self::Visibility, Self::ControlLaw];
}

/// A gateway of a place, in the frame of the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalGateway {
    /// The nearest walls on the left and on the right of one who leaves, in metres.
    pub ends: [Point2<f64>; 2],
    /// The direction outward, across the segment, in radians.
    pub heading_rad: f64,
    /// By which law one travels away here.
    pub control_law: ControlLaw,
    /// The gateway where the path fragment of this one leaves the place again, if it passes.
    pub continues_to: Option<u8>,
}

impl LocalGateway {
    /// The middle of the segment, in metres.
    pub fn center(&self) -> Point2<f64> {
        self.ends[0] + (self.ends[1] - self.ends[0]) / 2.0
    }

    /// Length of the segment, in metres.
    pub fn width_m(&self) -> f64 {
        (self.ends[1] - self.ends[0]).norm()
    }

    /// The gateway at a cell of a branch that leaves a place; its law is to be found.
    pub(crate) fn new(axis: &MedialAxis, branch: &Branch, at: usize) -> Self {
        let basis = basis_points(&axis.clearance, branch.cells[at]);
        let [a, b] = basis.map(|index| axis.point(index));
        let outward = branch.direction(at);
        // Left is where a turn of a quarter circle from outward leads.
        let is_left = 0.0 <= (a - b).dot(&Vector2::new(-outward.y, outward.x));
        let ends = if is_left { [a, b] } else { [b, a] };
        let across = ends[1] - ends[0];
        let heading_rad = across.x.atan2(-across.y);
        Self { ends, heading_rad, control_law: ControlLaw::Midline, continues_to: None }
    }
}
