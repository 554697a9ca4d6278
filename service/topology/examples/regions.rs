//! Cuts a map into regions, draws them, and compares them with a person's.
//!
//! ```text
//! cargo run --release -p meetpoint-topology --example regions -- MAP [PNG [ROOMS]]
//! ```
//!
//! MAP is the YAML of a `map_server` map, or an image alone, which is then taken to have cells of
//! 0.05 m that are free where it is nearly white. PNG is drawn: regions in colours, the diagram
//! dark, critical points blue, critical lines red, meet points white. ROOMS is an image of the same
//! size with rooms drawn between lines: recall is the share of a room that its best region covers,
//! precision the share of a region that its best room covers, averaged over the rooms and regions
//! of more than 100 cells (R. Bormann et al., "Room segmentation: survey, implementation, and
//! analysis", ICRA 2016).

use std::collections::BTreeMap;
use std::error::Error;
use std::path::Path;
use std::time::Instant;

use meetpoint_geometry::{Cell, GridFrame, GridInfo};
use meetpoint_occupancy::{cells_from_picture, read_pgm, read_png, read_yaml};
use meetpoint_topology::{
    FreeSpace, MeetPoint, MeetPointParams, Partition, Pruning, RegionIndex, Segmentation,
    TopologyParams, clearance, constrictions, critical_lines, critical_points, meet_points,
    partition, pruned, segmentation, topological_graph, voronoi,
};

/// What has up to so many cells is no room.
const N_SPECK_CELLS: usize = 100;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let map = arguments.first().ok_or("usage: regions MAP [PNG [ROOMS]]")?;
    let space = free_space(Path::new(map))?;
    let (found, meet_points) = cut(&space, &TopologyParams::INDOOR);
    if let Some(path) = arguments.get(1) {
        draw(&found, &meet_points, path)?;
    }
    if let Some(path) = arguments.get(2) {
        compare(&found.partition, &partition(&free_space(Path::new(path))?, []));
    }
    Ok(())
}

/// The free cells of a map's image.
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
    let bytes = std::fs::read(&image_path)?;
    let picture = if has(&image_path, "png") { read_png(&bytes)? } else { read_pgm(&bytes)? };
    let grid = cells_from_picture(&picture, &yaml);
    for warning in &grid.warnings {
        println!("warning: {warning}");
    }
    let frame = GridFrame::new(yaml.resolution_m).map_err(|_| "no such resolution")?;
    let first = Cell { x: 0, y: 0 };
    let info = GridInfo { frame, first, width: grid.width, height: grid.height };
    let is_free: Vec<bool> = grid.cells.iter().map(|&cell| cell == 0).collect();
    Ok(FreeSpace::from_cells(info, &is_free))
}

/// The steps of `segmentation`, and the time that each takes.
fn cut(space: &FreeSpace, params: &TopologyParams) -> (Segmentation, Vec<MeetPoint>) {
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
    let graph = topological_graph(&partition, &lines, &clearance);
    tick("graph");
    let meet_points = meet_points(&voronoi, &clearance, &MeetPointParams::INDOOR);
    tick("meet points");
    println!("ms: {}", times.join(", "));
    println!(
        "{} free cells, {} on the diagram, {} critical points, {} meet points",
        space.is_free().iter().filter(|&&is_free| is_free).count(),
        voronoi.cells().len(),
        points.len(),
        meet_points.len()
    );
    let n_groups = |pruning| {
        let groups = pruned(&graph, pruning);
        groups.iter().enumerate().filter(|(at, group)| group.0 as usize == *at).count()
    };
    println!(
        "{} regions, {} arcs; {} regions with pairs pruned, {} with end nodes pruned",
        graph.regions.len(),
        graph.arcs.len(),
        n_groups(Pruning::Pairs),
        n_groups(Pruning::EndNodes)
    );
    assert_eq!(lines.len(), segmentation(space, params).lines.len());
    (segmentation(space, params), meet_points)
}

/// Recall and precision against rooms.
fn compare(regions: &Partition, rooms: &Partition) {
    let mut common: BTreeMap<[RegionIndex; 2], usize> = BTreeMap::new();
    let mut sizes = [BTreeMap::new(), BTreeMap::new()];
    let n_cells = regions.info().n_cells().min(rooms.info().n_cells());
    for index in 0..n_cells {
        let pair = [rooms.region_at(index), regions.region_at(index)];
        for (sizes, member) in sizes.iter_mut().zip(pair) {
            if let Some(member) = member {
                *sizes.entry(member).or_insert(0_usize) += 1;
            }
        }
        if let [Some(room), Some(region)] = pair {
            *common.entry([room, region]).or_default() += 1;
        }
    }
    let mean_share = |side: usize| {
        let large = sizes[side].iter().filter(|&(_, &n_cells)| N_SPECK_CELLS < n_cells);
        let shares: Vec<f64> = large
            .map(|(member, &n_cells)| {
                let of_member = common.iter().filter(|(pair, _)| pair[side] == *member);
                of_member.map(|(_, &n)| n).max().unwrap_or(0) as f64 / n_cells as f64
            })
            .collect();
        (shares.len(), 100.0 * shares.iter().sum::<f64>() / shares.len() as f64)
    };
    let ((n_rooms, recall), (n_regions, precision)) = (mean_share(0), mean_share(1));
    println!("recall {recall:.1} precision {precision:.1} regions {n_regions} rooms {n_rooms}");
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
