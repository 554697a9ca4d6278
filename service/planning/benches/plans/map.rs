//! A map from a file, and its regions.

use std::error::Error;
use std::path::Path;
use std::sync::Arc;

use meetpoint_planning::{Space, enterable};
use meetpoint_topology::{
    Partition, Pruning, Segmentation, TopologicalGraph, TopologyParams, pruned, segmentation,
    topological_graph,
};

use crate::plan::free_space;

/// What is planned in.
pub(crate) struct Map {
    /// The file's, or its folder's if that says nothing.
    pub(crate) name: String,
    /// Edge of a cell, in metres.
    pub(crate) resolution_m: f64,
    pub(crate) space: Arc<Space>,
    found: Segmentation,
}

/// A partition and its graph.
pub(crate) struct Regions {
    pub(crate) partition: Arc<Partition>,
    pub(crate) graph: TopologicalGraph,
}

impl Map {
    pub(crate) fn read(path: &Path, radius_m: f64) -> Result<Self, Box<dyn Error>> {
        let free = free_space(path)?;
        let space = Space::uniform(free.info(), &enterable(&free, radius_m))?;
        Ok(Self {
            name: name(path),
            resolution_m: free.info().frame.resolution_m(),
            space: Arc::new(space),
            found: segmentation(&free, &TopologyParams::INDOOR),
        })
    }

    pub(crate) fn regular(&self) -> Regions {
        self.regions(self.found.partition.clone())
    }

    /// Pairs of neighbours with at most two neighbours each joined, as in section 4.2.
    pub(crate) fn pruned(&self) -> Regions {
        let groups = pruned(&self.regular().graph, Pruning::Pairs);
        self.regions(self.found.partition.joined(|region| groups[region.0 as usize]))
    }

    fn regions(&self, partition: Partition) -> Regions {
        let graph = topological_graph(&partition, &self.found.lines, &self.found.clearance);
        Regions { partition: Arc::new(partition), graph }
    }
}

impl Regions {
    /// Independent cycles of the graph: arcs less those of a forest.
    pub(crate) fn n_cycles(&self) -> usize {
        let mut group: Vec<usize> = (0..self.graph.regions.len()).collect();
        let mut n_cycles = 0;
        for arc in &self.graph.arcs {
            let [a, b] = arc.regions.map(|region| group[region.0 as usize]);
            n_cycles += usize::from(a == b);
            for group in &mut group {
                *group = if *group == b { a } else { *group };
            }
        }
        n_cycles
    }
}

fn name(path: &Path) -> String {
    let text = |name: &std::ffi::OsStr| name.to_string_lossy().into_owned();
    let stem = path.file_stem().map(text).unwrap_or_default();
    let folder = path.parent().and_then(Path::file_name).map(text);
    if stem == "map" { folder.unwrap_or(stem) } else { stem }
}
