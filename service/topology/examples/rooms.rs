//! Compares the regions of plans with the rooms that people drew in them.
//!
//! ```text
//! cargo run --release -p meetpoint-topology --example rooms -- PLANS
//! ```
//!
//! PLANS is a folder with `NAME.png`, `NAME_furnitures.png` (the same with furniture) and
//! `NAME_gt_segmentation.png` (rooms between lines) for every plan, as in R. Bormann et al., "Room
//! segmentation: survey, implementation, and analysis", ICRA 2016. Recall is the share of a room that
//! its best region covers, precision the share of a region that its best room covers, averaged over
//! the rooms and regions of more than 100 cells, then over the plans; both in percent.

mod plan;

use std::collections::BTreeMap;
use std::error::Error;
use std::path::PathBuf;

use meetpoint_topology::{Partition, RegionIndex, TopologyParams, partition, segmentation};
use plan::free_space;

/// What has up to so many cells is no room.
const N_SPECK_CELLS: usize = 100;

/// The end of the name of a plan's rooms.
const ROOMS: &str = "_gt_segmentation.png";

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).ok_or("usage: rooms PLANS")?;
    let mut plans: Vec<PathBuf> = std::fs::read_dir(folder)?
        .map(|entry| Ok(entry?.path()))
        .collect::<Result<_, Box<dyn Error>>>()?;
    plans.retain(|path| path.to_str().is_some_and(|path| path.ends_with(ROOMS)));
    plans.sort();
    println!("{:24} {:>5}   {:^26}   {:^26}", "", "", "plain", "furnished");
    let columns = format!("{:>8} {:>8} {:>8}", "recall", "prec.", "regions");
    println!("{:24} {:>5}   {columns}   {columns}", "plan", "rooms");
    let mut all = [vec![], vec![]];
    for path in &plans {
        let rooms = partition(&free_space(path)?, []);
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        let name = name.trim_end_matches(ROOMS);
        let mut row = vec![];
        for (ending, all) in [".png", "_furnitures.png"].into_iter().zip(&mut all) {
            let space = free_space(&path.with_file_name(format!("{name}{ending}")))?;
            let regions = segmentation(&space, &TopologyParams::INDOOR).partition;
            let agreement = Agreement::new(&rooms, &regions);
            row.push(agreement.to_string());
            all.push(agreement);
        }
        println!("{name:24} {:>5}   {}", all[0][all[0].len() - 1].n_rooms, row.join("   "));
    }
    let [plain, furnished] = all.map(|all| Agreement::mean(&all));
    println!("{:24} {:>5}   {plain}   {furnished}", "mean, and sums", plain.n_rooms);
    Ok(())
}

/// How regions agree with rooms.
struct Agreement {
    n_rooms: usize,
    n_regions: usize,
    recall: f64,
    precision: f64,
}

impl Agreement {
    fn new(rooms: &Partition, regions: &Partition) -> Self {
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
        Self { n_rooms, n_regions, recall, precision }
    }

    /// Mean shares, summed numbers.
    fn mean(all: &[Self]) -> Self {
        let mean = |share: fn(&Self) -> f64| all.iter().map(share).sum::<f64>() / all.len() as f64;
        Self {
            n_rooms: all.iter().map(|one| one.n_rooms).sum(),
            n_regions: all.iter().map(|one| one.n_regions).sum(),
            recall: mean(|one| one.recall),
            precision: mean(|one| one.precision),
        }
    }
}

impl std::fmt::Display for Agreement {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { n_regions, recall, precision, .. } = self;
        write!(formatter, "{recall:8.1} {precision:8.1} {n_regions:8}")
    }
}
