//! Regions of a grid and how they hang together, read off the Voronoi diagram of its walls.

mod clearance;
mod constriction;
mod critical;
mod critical_line;
mod cut;
mod free;
mod graph;
mod ids;
mod lattice;
mod meet_points;
mod neighborhood;
mod opening;
mod pruning;
mod regions;
mod segmentation;
mod spurs;
mod union;
mod voronoi;
mod walk;

pub use clearance::{Clearance, clearance};
pub use constriction::{ConstrictionParams, constrictions};
pub use critical::{CriticalParams, CriticalPoint, critical_points};
pub use critical_line::{CriticalLine, critical_lines};
pub use cut::Crossing;
pub use free::FreeSpace;
pub use graph::{Arc, Region, TopologicalGraph, topological_graph};
pub use ids::{ArcId, Becoming, Counters, Ids, RegionId, Snapshot, carried_ids, first_ids};
pub use meet_points::{MeetPoint, MeetPointKind, MeetPointParams, meet_points};
pub use pruning::{Pruning, pruned};
pub use regions::{Partition, RegionIndex, partition};
pub use segmentation::{Segmentation, TopologyParams, segmentation};
pub use voronoi::{Voronoi, VoronoiParams, voronoi};
