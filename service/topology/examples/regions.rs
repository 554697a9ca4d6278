//! Cuts a map into regions, and draws them.
//!
//! ```text
//! cargo run --release -p meetpoint-topology --example regions -- MAP [PNG]
//! ```
//!
//! MAP is the YAML of a `map_server` map, or an image. PNG is drawn: regions in colours, the diagram
//! dark, critical points blue, critical lines red, meet points white. Printed is how long every step
//! takes, and what was found.

mod plan;

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use meetpoint_topology::{
    Counters, FreeSpace, MeetPoint, Pruning, Segmentation, Topology, TopologyParams, clearance,
    constrictions, critical_lines, critical_points, meet_points, partition, pruned, segmentation,
    topological_graph, voronoi,
};
use plan::free_space;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let map = arguments.first().ok_or("usage: regions MAP [PNG]")?;
    let space = free_space(Path::new(map))?;
    time_steps(&space, &TopologyParams::INDOOR);
    let found = segmentation(&space, &TopologyParams::INDOOR);
    let topology = Topology::first(&found, &mut Counters::default());
    tell(&space, &found, &topology);
    if let Some(path) = arguments.get(1) {
        draw(&found, topology.meet_points(), path)?;
    }
    Ok(())
}

/// The time that each step of `segmentation` takes, and each of what is read off it.
fn time_steps(space: &FreeSpace, params: &TopologyParams) {
    let mut start = Instant::now();
    let mut times = vec![];
    let mut tick = |stage: &str| {
        times.push(format!("{stage} {:.1}", start.elapsed().as_secs_f64() * 1e3));
        start = Instant::now();
    };
    let open = space.without_islands(params.island_extent_max_m);
    tick("walls");
    let clearance = clearance(&open);
    tick("clearance");
    let voronoi = voronoi(&open, &clearance, &params.voronoi);
    tick("diagram");
    let points = critical_points(&voronoi, &clearance, &params.critical);
    tick("critical points");
    let lines = critical_lines(&open, &clearance, &points, params.constriction.depth_m);
    tick("critical lines");
    let fine = partition(space, lines.iter().flat_map(|line| &line.crossings));
    tick("regions");
    let (lines, partition) = constrictions(&fine, lines, &clearance, &params.constriction);
    tick("choice of lines");
    topological_graph(&partition, &lines, &clearance);
    tick("graph");
    meet_points(&voronoi, &clearance, &params.meet_points);
    tick("meet points");
    println!("ms: {}", times.join(", "));
}

/// What was found, in numbers.
fn tell(space: &FreeSpace, found: &Segmentation, topology: &Topology) {
    println!(
        "{} free cells, {} on the diagram, {} critical points, {} meet points",
        space.is_free().iter().filter(|&&is_free| is_free).count(),
        found.voronoi.cells().len(),
        found.points.len(),
        topology.meet_points().len()
    );
    let graph = topology.graph();
    let n_groups = |pruning| {
        let groups = pruned(graph, pruning);
        groups.iter().enumerate().filter(|(at, group)| group.0 as usize == *at).count()
    };
    println!(
        "{} regions ({} of them specks), {} arcs; {} regions with pairs pruned, {} with end nodes \
         pruned; {} bytes",
        graph.regions.len(),
        graph.specks().len(),
        graph.arcs.len(),
        n_groups(Pruning::Pairs),
        n_groups(Pruning::EndNodes),
        topology.to_bytes().len()
    );
}

/// Draws what was found.
fn draw(found: &Segmentation, meet: &[MeetPoint], path: &str) -> Result<(), Box<dyn Error>> {
    let info = found.partition.info();
    let width = info.width as usize;
    let mut pixels = vec![[0_u8; 3]; info.n_cells()];
    for (index, pixel) in pixels.iter_mut().enumerate() {
        if let Some(region) = found.partition.region_at(index) {
            *pixel = colour(region.0);
        }
        if found.voronoi.is_on()[index] {
            *pixel = pixel.map(|value| value / 2);
        }
    }
    for point in &found.points {
        pixels[point.index] = [0, 0, 255];
    }
    for line in &found.lines {
        for crossing in &line.crossings {
            pixels[crossing.left] = [255, 0, 0];
        }
    }
    for point in meet {
        for index in [point.index, point.index + 1, point.index + width] {
            pixels[index] = [255; 3];
        }
    }
    let rows: Vec<u8> = pixels.chunks_exact(width).rev().flat_map(<[_]>::concat).collect();
    let file = std::io::BufWriter::new(std::fs::File::create(path)?);
    let mut encoder = png::Encoder::new(file, info.width, info.height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.write_header()?.write_image_data(&rows)?;
    Ok(())
}

/// A light colour that differs from those of the regions before and after.
fn colour(region: u32) -> [u8; 3] {
    let mixed = (region + 1).wrapping_mul(2_654_435_761).to_le_bytes();
    [mixed[1], mixed[2], mixed[3]].map(|byte| 110 + byte / 2)
}
