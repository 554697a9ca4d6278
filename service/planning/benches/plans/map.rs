//! A map from a file, and its regions.

use std::error::Error;
use std::path::Path;
use std::sync::Arc;

use meetpoint_occupancy::{ImportParams, imported, read_pgm, read_png, read_yaml};
use meetpoint_planning::{Space, enterable};
use meetpoint_topology::{
    FreeSpace, Partition, Pruning, Segmentation, TopologicalGraph, TopologyParams, pruned,
    segmentation, topological_graph,
};

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

fn free_space(path: &Path) -> Result<FreeSpace, Box<dyn Error>> {
    let has = |path: &Path, extension: &str| path.extension().is_some_and(|e| e == extension);
    let text = if has(path, "yaml") {
        std::fs::read_to_string(path)?
    } else {
        let name = path.file_name().and_then(|name| name.to_str()).ok_or("no such image")?;
        format!(
            "image: {name}\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\n\
             occupied_thresh: 0.65\nfree_thresh: 0.04\n"
        )
    };
    let yaml = read_yaml(&text)?;
    let image_path = path.with_file_name(&yaml.image);
    let bytes =
        std::fs::read(&image_path).map_err(|error| format!("{}: {error}", image_path.display()))?;
    let picture = if has(&image_path, "png") { read_png(&bytes)? } else { read_pgm(&bytes)? };
    let map = imported(&picture, &yaml, &ImportParams::MAP_SERVER)?;
    for warning in &map.warnings {
        println!("{}: {warning}", path.display());
    }
    Ok(FreeSpace::from_raster(&map.raster, FreeSpace::PROBABILITY_MAX))
}

fn name(path: &Path) -> String {
    let text = |name: &std::ffi::OsStr| name.to_string_lossy().into_owned();
    let stem = path.file_stem().map(text).unwrap_or_default();
    let folder = path.parent().and_then(Path::file_name).map(text);
    if stem == "map" { folder.unwrap_or(stem) } else { stem }
}
