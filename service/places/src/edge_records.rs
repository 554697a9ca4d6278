//! Metrical records of edges: what was measured on the way, averaged over all travels either way.
//!
//! Nothing is refuted by them. In another map of the same travel they are those of other edges.

use std::collections::BTreeMap;

use meetpoint_geometry::Pose;

use crate::map_tree::Hypothesis;
use crate::place_map::{Gateway, PlaceId};
use crate::travel::Travel;

/// What was measured on a travel; `None` where it was not.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct TravelRecord {
    /// Length of the way, in metres.
    pub length_m: Option<f64>,
    /// By how much the heading changed on the way, radians counter-clockwise.
    pub turned_rad: Option<f64>,
    /// Where odometry has the robot at this visit, seen from its pose at the one before.
    pub moved: Option<Pose>,
}

/// What is known of an edge by one who leaves through one of its gateways.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct EdgeRecord {
    /// Travels along it, either way.
    pub n_travels: u32,
    /// Mean length of those that were measured, in metres.
    pub length_m: Option<f64>,
    /// Mean change of heading of those that were measured, radians counter-clockwise.
    pub turned_rad: Option<f64>,
}

/// What is known of all edges of a map, by the gateways at both of their ends.
#[derive(Clone, Debug, Default)]
pub struct EdgeRecords(BTreeMap<Gateway, Sums>);

#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    n_travels: u32,
    length_m: Sum,
    turned_rad: Sum,
}

#[derive(Clone, Copy, Debug, Default)]
struct Sum {
    total: f64,
    n: u32,
}

impl Sum {
    fn add(&mut self, value: Option<f64>) {
        self.total += value.unwrap_or(0.0);
        self.n += u32::from(value.is_some());
    }

    fn mean(self) -> Option<f64> {
        (0 < self.n).then(|| self.total / f64::from(self.n))
    }
}

impl EdgeRecords {
    /// What the steps of a travel tell of the edges of a map that fits it: a record a step, in
    /// order; steps without one count as not measured. `None` if the map is of another travel.
    pub fn new(hypothesis: &Hypothesis, travel: &Travel, records: &[TravelRecord]) -> Option<Self> {
        let map = &hypothesis.map;
        let mut edges: BTreeMap<Gateway, Sums> = BTreeMap::new();
        let mut at = Gateway { place: PlaceId(0), index: 0 };
        for (step, turn) in travel.turns().enumerate() {
            let left = map.turned(at, turn);
            at = map.leads_to(left)?;
            let TravelRecord { length_m, turned_rad, moved: _ } =
                records.get(step).copied().unwrap_or_default();
            let back = turned_rad.map(|turned_rad| -turned_rad);
            for (gateway, turned_rad) in [(left, turned_rad), (at, back)] {
                let sums = edges.entry(gateway).or_default();
                sums.n_travels += 1;
                sums.length_m.add(length_m);
                sums.turned_rad.add(turned_rad);
            }
        }
        Some(Self(edges))
    }

    /// What is known of the edge that `gateway` leads into; `None` if nobody has gone there.
    pub fn leaving(&self, gateway: Gateway) -> Option<EdgeRecord> {
        let Sums { n_travels, length_m, turned_rad } = *self.0.get(&gateway)?;
        let (length_m, turned_rad) = (length_m.mean(), turned_rad.mean());
        Some(EdgeRecord { n_travels, length_m, turned_rad })
    }

    /// Whether every edge has a length.
    pub fn have_lengths(&self) -> bool {
        self.0.values().all(|sums| 0 < sums.length_m.n)
    }
}
