//! Path fragments: which gateways of a place a path passes through.
//!
//! "For each of two gateways, after arrival at one in the inbound direction, the clear unique default
//! travel continuation is the other in the outbound direction" (HSSH 2004, section III-B). How much one
//! turns on the straight way from gateway `i` to gateway `j` is
//!
//! ```text
//! turn(i, j) = |angle from inward at i to the way| + |angle from the way to outward at j|
//! ```
//!
//! Pairs are taken by their turns, the straightest first, each gateway once. A pair is a passage if
//! its turn is small, and clear: no other gateway that is left makes nearly as straight a
//! continuation of one of the two. Time O(gateways² log gateways).
//!
//! Two gateways of a place that is hardly wider than they are, such as the corner of a corridor,
//! have no other continuation, however one turns.

use std::f64::consts::PI;

use meetpoint_geometry::angle_between;

use crate::local::gateway::LocalGateway;
use crate::local::params::FragmentParams;

/// Of each gateway the one that it is on a passage with, if there is one.
pub fn passages(gateways: &[LocalGateway], params: &FragmentParams) -> Vec<Option<usize>> {
    let n = gateways.len();
    let pairs = (0..n).flat_map(|i| (i + 1..n).map(move |j| [i, j]));
    let mut pairs: Vec<(f64, [usize; 2])> = pairs
        .map(|[i, j]| (turn_rad(&gateways[i], &gateways[j]), [i, j]))
        .filter(|&(turn_rad, _)| turn_rad <= params.turn_max_rad + params.margin_rad)
        .collect();
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut passages = vec![None; n];
    for &(turn, [i, j]) in &pairs {
        if params.turn_max_rad < turn {
            break;
        }
        if passages[i].is_some() || passages[j].is_some() {
            continue;
        }
        let is_rival = |&(other, [a, b]): &(f64, [usize; 2])| {
            let shares_one = [a, b] != [i, j] && [a, b].iter().any(|end| [i, j].contains(end));
            let is_free = passages[a].is_none() && passages[b].is_none();
            shares_one && is_free && other < turn + params.margin_rad
        };
        if !pairs.iter().any(is_rival) {
            (passages[i], passages[j]) = (Some(j), Some(i));
        }
    }
    passages
}

/// How much one turns in all who comes in at one gateway and leaves at another by the straight way,
/// in radians, up to 2π.
fn turn_rad(from: &LocalGateway, to: &LocalGateway) -> f64 {
    let way = to.center() - from.center();
    let way_rad = way.y.atan2(way.x);
    angle_between(from.heading_rad + PI, way_rad).abs()
        + angle_between(way_rad, to.heading_rad).abs()
}

#[cfg(test)]
mod tests {
    use meetpoint_geometry::Point2;

    use super::*;
    use crate::local::params::LocalParams;
    use crate::star::ControlLaw;

    /// A gateway 1 m wide at a point, its heading in degrees.
    fn gateway([x, y]: [f64; 2], heading_deg: f64) -> LocalGateway {
        let heading_rad = heading_deg.to_radians();
        let (sin, cos) = heading_rad.sin_cos();
        let ends = [0.5, -0.5].map(|left| Point2::new(x - left * sin, y + left * cos));
        LocalGateway { ends, heading_rad, control_law: ControlLaw::Midline, continues_to: None }
    }

    fn of(gateways: &[([f64; 2], f64)]) -> Vec<Option<usize>> {
        let gateways: Vec<_> =
            gateways.iter().map(|&(at, heading_deg)| gateway(at, heading_deg)).collect();
        passages(&gateways, &LocalParams::INDOOR.fragment)
    }

    #[test]
    fn straight_on_and_nothing_else_as_straight() {
        let [north, east, south, west] =
            [([0.0, 1.0], 90.0), ([1.0, 0.0], 0.0), ([0.0, -1.0], -90.0), ([-1.0, 0.0], 180.0)];
        assert_eq!(of(&[north, east, south, west]), [2, 3, 0, 1].map(Some), "a crossing");
        assert_eq!(of(&[east, south, west]), [Some(2), None, Some(0)], "a junction");
        assert_eq!(of(&[north, east]), [None, None], "a corner");
        let fork = [([1.0, 0.5], 20.0), ([1.0, -0.5], -20.0), west];
        assert_eq!(of(&fork), [None; 3], "a fork has no clear continuation");
        let doors =
            [([2.0, 0.0], 0.0), ([2.0, -2.0], 0.0), ([-2.0, 0.0], 180.0), ([-2.0, -2.0], 180.0)];
        assert_eq!(of(&doors), [2, 3, 0, 1].map(Some), "two doors, and two opposite");
    }
}
