//! Costs in force on a map: what all decisions of its journal come to.

use std::collections::{BTreeMap, HashMap};

use meetpoint_geometry::Point2;
use meetpoint_planning::{ArcCost, STRAIGHT, Shape, UNREACHABLE};
use meetpoint_storage::JournalSeq;

use super::profile::Profile;

/// Something in force.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Cost {
    pub(crate) id: String,
    pub(crate) kind: CostKind,
    pub(crate) reason: String,
    pub(crate) author: String,
    pub(crate) origin: CostOrigin,
    /// Since which revision.
    pub(crate) revision: u64,
    /// The service's clock, nanoseconds since 1970.
    pub(crate) time_ns: i64,
    /// Chosen by the caller; empty for none.
    pub(crate) client_key: String,
}

/// What it is.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum CostKind {
    /// An arc that is not crossed, by id.
    Closure(u64),
    /// What crossing an arc costs beyond its length.
    Toll { arc: u64, toll_m: f64 },
    /// Something that no robot gets through.
    Obstacle(Shape),
    /// An area that is dearer.
    Zone { polygon: Vec<Point2<f64>>, factor: f64 },
}

/// Who says so.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum CostOrigin {
    Operator,
    Evidence,
}

/// A change.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Decision {
    Put(Cost),
    Remove(Removal),
    Declare(Profile),
    Undeclare(String),
}

/// Something is no longer in force.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Removal {
    pub(crate) id: String,
    pub(crate) reason: String,
    pub(crate) author: String,
    pub(crate) origin: CostOrigin,
}

/// All that is in force on a map.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Costs {
    /// Counts decisions.
    revision: u64,
    /// The last of them.
    last: JournalSeq,
    /// Oldest first.
    in_force: Vec<Cost>,
    profiles: BTreeMap<String, Profile>,
    /// What was made by which client key, in force or not.
    by_key: HashMap<String, Cost>,
}

impl CostKind {
    /// The arc that it is about, by id.
    pub(crate) fn arc(&self) -> Option<u64> {
        match self {
            Self::Closure(arc) | Self::Toll { arc, .. } => Some(*arc),
            Self::Obstacle(_) | Self::Zone { .. } => None,
        }
    }
}

impl Default for Costs {
    /// Nothing was decided yet.
    fn default() -> Self {
        Self {
            revision: 0,
            last: JournalSeq::START,
            in_force: Vec::new(),
            profiles: BTreeMap::new(),
            by_key: HashMap::new(),
        }
    }
}

impl Costs {
    /// Takes the next decision in.
    pub(crate) fn apply(&mut self, seq: JournalSeq, time_ns: i64, decision: Decision) {
        self.revision += 1;
        self.last = seq;
        match decision {
            Decision::Put(cost) => {
                let cost = Cost { revision: self.revision, time_ns, ..cost };
                if let Some(arc) = cost.kind.arc() {
                    self.in_force.retain(|other| other.kind.arc() != Some(arc));
                }
                if !cost.client_key.is_empty() {
                    self.by_key.insert(cost.client_key.clone(), cost.clone());
                }
                self.in_force.push(cost);
            }
            Decision::Remove(Removal { id, .. }) => self.in_force.retain(|cost| cost.id != id),
            Decision::Declare(profile) => {
                self.profiles.insert(profile.name.clone(), profile);
            }
            Decision::Undeclare(name) => {
                self.profiles.remove(&name);
            }
        }
    }

    /// Counts decisions.
    pub(crate) fn revision(&self) -> u64 {
        self.revision
    }

    /// The journal's entry up to which decisions are in.
    pub(crate) fn last(&self) -> JournalSeq {
        self.last
    }

    /// All that is in force, oldest first.
    pub(crate) fn in_force(&self) -> &[Cost] {
        &self.in_force
    }

    /// What is in force of that id.
    pub(crate) fn get(&self, id: &str) -> Option<&Cost> {
        self.in_force.iter().find(|cost| cost.id == id)
    }

    /// What is in force on an arc.
    pub(crate) fn of_arc(&self, arc: u64) -> Option<&Cost> {
        self.in_force.iter().find(|cost| cost.kind.arc() == Some(arc))
    }

    /// What was made by a client key.
    pub(crate) fn by_key(&self, key: &str) -> Option<&Cost> {
        self.by_key.get(key)
    }

    /// The profiles that were declared, by name.
    pub(crate) fn profiles(&self) -> &BTreeMap<String, Profile> {
        &self.profiles
    }

    /// Costs of a version's arcs, whose ids are given, for cells of that size.
    pub(crate) fn arc_costs(&self, ids: impl Iterator<Item = u64>, side_m: f64) -> Vec<ArcCost> {
        let of_arc: HashMap<u64, ArcCost> =
            self.in_force.iter().filter_map(|cost| arc_cost(&cost.kind, side_m)).collect();
        ids.map(|id| of_arc.get(&id).copied().unwrap_or(ArcCost::Open(0))).collect()
    }

    /// The obstacles that were drawn.
    pub(crate) fn obstacles(&self) -> impl Iterator<Item = &Shape> {
        self.in_force.iter().filter_map(|cost| match &cost.kind {
            CostKind::Obstacle(shape) => Some(shape),
            _ => None,
        })
    }

    /// Polygons and factors of the zones.
    pub(crate) fn zones(&self) -> impl Iterator<Item = (&[Point2<f64>], f64)> {
        self.in_force.iter().filter_map(|cost| match &cost.kind {
            CostKind::Zone { polygon, factor } => Some((polygon.as_slice(), *factor)),
            _ => None,
        })
    }
}

/// An arc's id and what crossing it costs, in parts of a cell.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
fn arc_cost(kind: &CostKind, side_m: f64) -> Option<(u64, ArcCost)> {
    match kind {
        CostKind::Closure(arc) => Some((*arc, ArcCost::Closed)),
        CostKind::Toll { arc, toll_m } => {
            let toll = (toll_m / side_m * f64::from(STRAIGHT)).round();
            let toll = toll.clamp(0.0, f64::from(UNREACHABLE / 4));
            Some((*arc, ArcCost::Open(toll as u32)))
        }
        CostKind::Obstacle(_) | CostKind::Zone { .. } => None,
    }
}
