//! The small-scale star: directed path fragments of a place in clockwise order.
//!
//! HSSH 2004, section III-C: tuples of a fragment and a direction along it, the directed gateways on it
//! that face that way, and the law of travel away from the place. First come those with outward
//! gateways, in their order; each of the others is a fragment that ends at the place, and is put
//! where it would go on if it did not end.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::fmt;

use meetpoint_geometry::{Point2, Vector2};

use crate::local::gateway::LocalGateway;
use crate::star::ControlLaw;

/// How one travels away from a place along a fragment, in one direction of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum TravelLaw {
    /// By this law.
    By(ControlLaw),
    /// Not at all: a wall is in the way.
    DeadEnd,
    /// Not at all: no law applies, though nothing is in the way.
    None,
}

/// A path fragment in one of its directions: a tuple of the paper.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct DirectedFragment {
    /// Which fragment of the place, counted from 1 in the order of the star.
    pub fragment: u8,
    /// Whether it is taken in the direction in which it comes first in the star.
    pub is_plus: bool,
    /// The gateway by which one leaves in this direction, if the fragment has one there.
    pub outward: Option<u8>,
    /// The gateway by which one comes in this direction, if the fragment has one there.
    pub inward: Option<u8>,
    /// How one travels away.
    pub law: TravelLaw,
}

/// All directed fragments of a place, clockwise.
///
/// Invariant: every fragment is there twice, once in each direction.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SmallScaleStar(Vec<DirectedFragment>);

impl SmallScaleStar {
    /// Of gateways in clockwise order around `core`. `is_blocked` says of one whose fragment ends
    /// whether a wall is in its way.
    pub(crate) fn new(
        gateways: &[LocalGateway],
        core: Point2<f64>,
        is_blocked: impl Fn(u8) -> bool,
    ) -> Self {
        let bearing_rad = |point: Point2<f64>| (point.y - core.y).atan2(point.x - core.x);
        let bearings_rad: Vec<f64> =
            gateways.iter().map(|gateway| bearing_rad(gateway.center())).collect();
        let mut tuples = vec![];
        for (index, gateway) in (0..).zip(gateways) {
            let law = TravelLaw::By(gateway.control_law);
            tuples.push((Some(index), gateway.continues_to, law));
        }
        let ending = (0..).zip(gateways).filter(|(_, gateway)| gateway.continues_to.is_none());
        // Where a fragment would go on, between the gateways that lie there; of several in one
        // gap, in clockwise order.
        let mut inserted: Vec<(usize, f64, u8)> = ending
            .map(|(index, gateway)| {
                let after = clockwise_rad(bearings_rad[0], bearing_rad(beyond(gateway, core)));
                let n_before = bearings_rad
                    .iter()
                    .filter(|&&bearing| clockwise_rad(bearings_rad[0], bearing) <= after)
                    .count();
                (n_before, after, index)
            })
            .collect();
        inserted.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
        for (n_inserted, (n_before, _, index)) in inserted.into_iter().enumerate() {
            let law = if is_blocked(index) { TravelLaw::DeadEnd } else { TravelLaw::None };
            tuples.insert(n_before + n_inserted, (None, Some(index), law));
        }
        Self(numbered(&tuples))
    }

    /// The tuples, clockwise.
    pub fn fragments(&self) -> &[DirectedFragment] {
        &self.0
    }

    /// Those that one meets who turns right from the fragment at `from` until meeting the same
    /// fragment in the other direction, by their places in [`Self::fragments`].
    pub fn right_of(&self, from: usize) -> Vec<usize> {
        let n = self.0.len();
        let onward = (1..n).map(|turn| (from + turn) % n);
        onward.take_while(|&at| self.0[at].fragment != self.0[from].fragment).collect()
    }

    /// The same to the left, in the order in which one meets them.
    pub fn left_of(&self, from: usize) -> Vec<usize> {
        let n = self.0.len();
        let onward = (1..n).map(|turn| (from + n - turn) % n);
        onward.take_while(|&at| self.0[at].fragment != self.0[from].fragment).collect()
    }
}

/// Where one is who came in at a gateway and went straight on, as far beyond the core as the gateway
/// is before it.
fn beyond(gateway: &LocalGateway, core: Point2<f64>) -> Point2<f64> {
    let (sin, cos) = gateway.heading_rad.sin_cos();
    let outward = Vector2::new(cos, sin);
    gateway.center() - 2.0 * (gateway.center() - core).dot(&outward) * outward
}

/// By how much one turns clockwise from one bearing to another, in [0, 2π).
pub(crate) fn clockwise_rad(from_rad: f64, to_rad: f64) -> f64 {
    (from_rad - to_rad).rem_euclid(TAU)
}

/// The clockwise order of bearings, from north on.
pub(crate) fn from_north_rad(bearing_rad: f64) -> f64 {
    clockwise_rad(FRAC_PI_2, bearing_rad)
}

/// Tuples of outward and inward gateway and law, with the numbers of their fragments.
fn numbered(tuples: &[(Option<u8>, Option<u8>, TravelLaw)]) -> Vec<DirectedFragment> {
    let mut numbered: Vec<DirectedFragment> = vec![];
    let mut n_fragments = 0;
    for &(outward, inward, law) in tuples {
        // The other direction has the same gateways, faced the other way.
        let earlier =
            numbered.iter().find(|other| (other.inward, other.outward) == (outward, inward));
        let (fragment, is_plus) = match earlier {
            Some(other) => (other.fragment, false),
            None => {
                n_fragments += 1;
                (n_fragments, true)
            }
        };
        numbered.push(DirectedFragment { fragment, is_plus, outward, inward, law });
    }
    numbered
}

impl fmt::Display for TravelLaw {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::By(ControlLaw::Midline) => "MIDLINE",
            Self::By(ControlLaw::LeftWall) => "LEFTWALL",
            Self::By(ControlLaw::RightWall) => "RIGHTWALL",
            Self::By(ControlLaw::BlindStep) => "BLINDSTEP",
            Self::DeadEnd => "DEADEND",
            Self::None => "NONE",
        })
    }
}

/// As in Fig. 3 (e) of the paper, gateways counted from 1: `(PF1+, gw1 out & gw4 in, MIDLINE)`.
impl fmt::Display for DirectedFragment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sign = if self.is_plus { '+' } else { '-' };
        let outward = self.outward.map(|gateway| format!("gw{} out", gateway + 1));
        let inward = self.inward.map(|gateway| format!("gw{} in", gateway + 1));
        let gateways: Vec<String> = outward.into_iter().chain(inward).collect();
        write!(f, "(PF{}{sign}, {}, {})", self.fragment, gateways.join(" & "), self.law)
    }
}

impl fmt::Display for SmallScaleStar {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (at, tuple) in self.0.iter().enumerate() {
            let before = if at == 0 { "" } else { "\n" };
            write!(f, "{before}{tuple}")?;
        }
        Ok(())
    }
}
