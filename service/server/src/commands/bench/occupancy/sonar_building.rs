//! A building of about 105 by 63 m with many small rooms, mapped by 24 sonars without odometric error (T98,
//! Fig. 4): by the network, and by the inverse cone model from the same firings.

use std::path::Path;

use anyhow::Context;
use meetpoint_geometry::Pose;
use meetpoint_occupancy::{
    BeamModel, Grid, Interpretation, InverseCone, Network, SonarModel, SonarRing, png,
};
use meetpoint_sim::{Building, ChaCha8Rng, RoomParams, random_rooms};
use rand::SeedableRng;

use super::cells::{Decided, faces_found};
use crate::training::{declared, firings, tour};

/// Size of the building, in metres.
const FLOOR_M: (f64, f64) = (105.0, 63.0);
/// Edge of a cell of building and map, in metres.
const CELL_M: f64 = 0.1;
/// The paper's robots moved constantly, and frequently at 0.8 to 0.9 metres a second.
const SPEED_M_PER_S: f64 = 0.8;
/// Weaker evidence is left out, in log-odds: a place with this is nearly as likely wall as not.
const SURE: f32 = 2.0;
/// A cone blurs a wall's face by so much, in metres.
const BLUR_M: f64 = 0.2;

/// What firings are read by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Reader {
    Network,
    SureNetwork,
    NetworkByWays,
    InverseCone,
}

/// The weights of the crate.
struct Networks {
    shipped: Network,
    by_ways: Network,
}

impl Reader {
    const ALL: [Self; 4] =
        [Self::Network, Self::SureNetwork, Self::NetworkByWays, Self::InverseCone];

    fn name(self) -> &'static str {
        match self {
            Self::Network => "network",
            Self::SureNetwork => "network, where it is sure",
            Self::NetworkByWays => "network trained on ways",
            Self::InverseCone => "inverse cone",
        }
    }

    /// What a firing says: as the service maps; by what is nearly decided alone; by weights that were trained on
    /// ways; and by the baseline, as strong as it gets: its weak answers are kept, of which it has many.
    fn read(self, ring: &SonarRing, ranges_m: &[f32], networks: &Networks) -> Interpretation {
        let Networks { shipped: network, by_ways } = networks;
        let scan = ring.scan(ranges_m);
        match self {
            Self::Network => Interpretation::new(&scan, network, &SonarModel::INDOOR),
            Self::SureNetwork => {
                let model = SonarModel { evidence_min: SURE, ..SonarModel::INDOOR };
                Interpretation::new(&scan, network, &model)
            }
            Self::NetworkByWays => Interpretation::new(&scan, by_ways, &SonarModel::BY_WAYS),
            Self::InverseCone => {
                let model = SonarModel { evidence_min: 0.0, ..SonarModel::INDOOR };
                Interpretation::by_cones((ring, &scan), &InverseCone::CLASSIC, &model)
            }
        }
    }
}

/// Prints a table with a row for every building and reader.
pub(super) fn print(n_buildings: u64, pictures: Option<&Path>) -> anyhow::Result<()> {
    println!(
        "| seed | way, m | minutes | read by | cells decided | right | of walls | farther than \
         {BLUR_M} m off faces: right | free cells found free | faces found |"
    );
    println!("|{}", "---|".repeat(10));
    let sonars = meetpoint_sim::SonarRing::RING_24;
    let ring = declared(&sonars);
    let networks = Networks { shipped: Network::shipped(), by_ways: Network::by_ways() };
    for seed in 1..=n_buildings {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let params = RoomParams { cell_m: CELL_M, ..RoomParams::OFFICES };
        let building = random_rooms(FLOOR_M, &params, &mut rng)?;
        let (poses, way_m) = firings(&tour(&building)?);
        let heard: Vec<(Pose, Vec<f32>)> =
            poses.iter().map(|&pose| (pose, sonars.scan(&building, pose, &mut rng))).collect();
        for reader in Reader::ALL {
            let mut grid = Grid::new(building.info().frame);
            for (pose, ranges_m) in &heard {
                let interpretation = reader.read(&ring, ranges_m, &networks);
                grid.insert_sonar(*pose, &interpretation, &BeamModel::INDOOR);
            }
            row(&(seed, way_m), reader.name(), &grid, &building);
            if let Some(folder) = pictures {
                let path =
                    folder.join(format!("{seed}-{}.png", reader.name().replace([' ', ','], "-")));
                std::fs::write(&path, png(&grid.raster(None)))
                    .with_context(|| format!("cannot write {}", path.display()))?;
            }
        }
    }
    Ok(())
}

fn row((seed, way_m): &(u64, f64), name: &str, grid: &Grid, building: &Building) {
    let minutes = way_m / SPEED_M_PER_S / 60.0;
    let (all, off_faces) =
        (Decided::new(grid, building, 0.0), Decided::new(grid, building, BLUR_M));
    let percent = |n: usize, of: usize| 100.0 * n as f64 / of.max(1) as f64;
    println!(
        "| {seed} | {way_m:.0} | {minutes:.0} | {name} | {} | {:.2} % | {:.2} % | {:.2} % | {:.2} % | {:.1} % |",
        all.n,
        percent(all.n_right, all.n),
        percent(all.n_right_walls, all.n_walls),
        percent(off_faces.n_right, off_faces.n),
        percent(all.n_found_free, all.n_free),
        100.0 * faces_found(grid, building, BLUR_M),
    );
}
