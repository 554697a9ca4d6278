use std::error::Error;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use meetpoint_geometry::{Cell, GridFrame, GridInfo};
use meetpoint_occupancy::{cells_from_picture, read_pgm, read_png, read_yaml};
use meetpoint_planning::{ArcCost, Plans, Scratch, Space, UNREACHABLE, enterable};
use meetpoint_topology::{FreeSpace, TopologyParams, segmentation, topological_graph};

fn main() -> Result<(), Box<dyn Error>> {
    for map in std::env::args().skip(1).filter(|a| !a.starts_with("--")) {
        let radius: f64 = std::env::var("RADIUS").ok().and_then(|r| r.parse().ok()).unwrap_or(0.0);
        let free = free_space(Path::new(&map))?;
        let start = Instant::now();
        let found = segmentation(&free, &TopologyParams::INDOOR);
        let graph = topological_graph(&found.partition, &found.lines, &found.clearance);
        let segmented = start.elapsed();
        let start = Instant::now();
        let space = Arc::new(Space::uniform(free.info(), &enterable(&free, radius))?);
        let spaced = start.elapsed();
        let start = Instant::now();
        let arcs = vec![ArcCost::Open(0); graph.arcs.len()];
        let partition = Arc::new(found.partition);
        let plans = Plans::new(space.clone(), partition, &graph, &arcs, 64 << 20);
        let built = start.elapsed();
        let size = plans.size();
        println!(
            "{map}: regions {} arcs {} {size:?} segment {segmented:.1?} space {spaced:.1?} build {built:.1?} bytes/cell {:.1}",
            graph.regions.len(),
            graph.arcs.len(),
            (size.region_bytes + size.gate_bytes) as f64 / size.n_cells as f64
        );
        let start = Instant::now();
        let again = plans.with_costs(space.clone(), &arcs);
        println!("  nothing changed {:.1?}", start.elapsed());
        let mut arcs = arcs;
        let mut times = vec![];
        for arc in 0..arcs.len() {
            arcs[arc] = ArcCost::Closed;
            let start = Instant::now();
            std::hint::black_box(again.with_costs(space.clone(), &arcs));
            times.push(start.elapsed());
            arcs[arc] = ArcCost::Open(0);
            if arc > 10 {
                break;
            }
        }
        times.sort();
        if !times.is_empty() {
            println!("  close one {:.1?}", times[times.len() / 2]);
        }
        let cells: Vec<usize> =
            (0..space.info().n_cells()).filter(|&c| space.is_enterable(c)).collect();
        let mut seed = 1_u64;
        let mut next = || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            cells[(seed >> 33) as usize % cells.len()]
        };
        let mut scratch = Scratch::default();
        let (mut near, mut far, mut routes, mut walks) = (vec![], vec![], vec![], vec![]);
        let mut n_cells = 0;
        for _ in 0..20_000 {
            let (a, b) = (next(), next());
            let same = plans.partition().region_at(a) == plans.partition().region_at(b);
            if same && near.len() > 1000 {
                continue;
            }
            let start = Instant::now();
            let cost = plans.cost(a, b, &mut scratch);
            let t = start.elapsed().as_nanos() as f64 / 1e3;
            if cost < UNREACHABLE {
                if same {
                    near.push(t)
                } else {
                    far.push(t);
                    let start = Instant::now();
                    std::hint::black_box(plans.route(a, b, &mut scratch));
                    routes.push(start.elapsed().as_nanos() as f64 / 1e3);
                    let start = Instant::now();
                    let path = plans.path(a, b, &mut scratch);
                    walks.push(start.elapsed().as_nanos() as f64 / 1e3);
                    n_cells += path.map_or(0, |p| p.cells.len());
                }
            }
        }
        let pairs: Vec<(usize, usize)> = (0..20_000)
            .map(|_| (next(), next()))
            .filter(|&(a, b)| plans.partition().region_at(a) != plans.partition().region_at(b))
            .collect();
        for _ in 0..(std::env::var("N").ok().and_then(|n| n.parse().ok()).unwrap_or(3)) {
            let start = Instant::now();
            let mut sum = 0_u64;
            for &(a, b) in &pairs {
                sum += u64::from(plans.cost(a, b, &mut scratch));
            }
            println!(
                "  batch {:.3} us each ({sum})",
                start.elapsed().as_secs_f64() * 1e6 / pairs.len() as f64
            );
        }
        println!("  walk of {:.0} cells", n_cells as f64 / walks.len().max(1) as f64);
        for (name, mut v) in [("same", near), ("other", far), ("route", routes), ("path", walks)] {
            v.sort_by(f64::total_cmp);
            if v.is_empty() {
                continue;
            }
            println!(
                "  {name}: n {} mean {:.2} p50 {:.2} p90 {:.2} p99 {:.2} max {:.1} us",
                v.len(),
                v.iter().sum::<f64>() / v.len() as f64,
                v[v.len() / 2],
                v[v.len() * 9 / 10],
                v[v.len() * 99 / 100],
                v[v.len() - 1]
            );
        }
    }
    Ok(())
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
    let bytes = std::fs::read(&image_path)?;
    let picture = if has(&image_path, "png") { read_png(&bytes)? } else { read_pgm(&bytes)? };
    let grid = cells_from_picture(&picture, &yaml);
    let frame = GridFrame::new(yaml.resolution_m).map_err(|_| "no such resolution")?;
    let first = Cell { x: 0, y: 0 };
    let info = GridInfo { frame, first, width: grid.width, height: grid.height };
    let is_free: Vec<bool> = grid.cells.iter().map(|&cell| cell == 0).collect();
    Ok(FreeSpace::from_cells(info, &is_free))
}
