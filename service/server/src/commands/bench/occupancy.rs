//! `meetpoint bench occupancy`: how well and how fast readings become occupancy, after T98, Figs. 4, 10 and 11.
//! Nothing is served: what is measured are the crates that the service maps with.

mod cells;
mod closed_door;
mod doors;
mod integration;
mod laser_loop;
mod network;
mod plain_grid;
mod sonar_building;
mod value_iteration;

use std::path::PathBuf;

/// Options of `meetpoint bench occupancy`.
#[derive(Debug, clap::Args)]
pub(super) struct OccupancyArgs {
    /// Only these; all where nothing is said
    #[arg(long, value_enum, value_delimiter = ',')]
    only: Vec<Figure>,
    /// Buildings that are mapped by sonar, from the first seed on
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u64).range(1..=100))]
    buildings: u64,
    /// Loops driven with a laser, from the first seed on
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u64).range(1..=100))]
    loops: u64,
    /// Folder for pictures of the sonar maps
    #[arg(long, value_name = "FOLDER")]
    pictures: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Figure {
    /// Cross-entropy and calibration of the network on places held out
    Network,
    /// A building of 105 by 63 m mapped by sonar without odometric error (Fig. 4)
    Building,
    /// Scans integrated a second
    Integration,
    /// Value iteration by the size of the map, and after a change
    ValueIteration,
    /// A loop of 60 by 20 m closed with a laser (Fig. 10)
    Loop,
    /// A door found closed, and the other way taken (Fig. 11)
    Door,
    /// Doors told from people who walk by
    Doors,
}

impl Figure {
    const ALL: [Self; 7] = [
        Self::Network,
        Self::Building,
        Self::Integration,
        Self::ValueIteration,
        Self::Loop,
        Self::Door,
        Self::Doors,
    ];
}

/// Measures what was asked for.
pub(super) async fn run(args: OccupancyArgs) -> anyhow::Result<()> {
    tokio::task::spawn_blocking(move || {
        let figures = if args.only.is_empty() { &Figure::ALL[..] } else { &args.only };
        for figure in figures {
            match figure {
                Figure::Network => network::print()?,
                Figure::Building => {
                    sonar_building::print(args.buildings, args.pictures.as_deref())?;
                }
                Figure::Integration => integration::print()?,
                Figure::ValueIteration => value_iteration::print()?,
                Figure::Loop => laser_loop::print(args.loops)?,
                Figure::Door => closed_door::print()?,
                Figure::Doors => doors::print()?,
            }
            println!();
        }
        Ok(())
    })
    .await?
}
