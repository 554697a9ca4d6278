//! `meetpoint bench merge`: robots that started nobody knows where, through the whole service.

mod fleet;
mod fleet_drives;
mod halves;
mod landmarks;
mod settled;
mod strangers;

use std::path::PathBuf;

/// Options of `meetpoint bench merge`.
#[derive(Debug, clap::Args)]
pub(super) struct MergeArgs {
    /// A log that is cut in two: the second part is another robot's, of unknown start
    #[arg(long, num_args = 2, value_names = ["LOG", "RELATIONS"])]
    halves: Vec<PathBuf>,
    /// Cuts of each log, between a quarter and three quarters of its time
    #[arg(long, value_name = "N", default_value_t = 10)]
    cuts: u32,
    /// Two logs of different buildings: the second must not be merged into the first
    #[arg(long, num_args = 2, value_names = ["LOG", "LOG"])]
    strangers: Vec<PathBuf>,
    /// An MRCLAM folder with its ground truth: five robots of unknown start, with the names of landmarks
    /// and without
    #[arg(long, value_name = "FOLDER")]
    mrclam: Option<PathBuf>,
    /// So many robots of unknown start in a simulated building of 100 by 60 m, live
    #[arg(long, value_name = "ROBOTS")]
    fleet: Option<u32>,
    /// Seed of that building
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Folder for the databases, on the disk that is to be measured
    #[arg(long, value_name = "FOLDER", default_value = ".")]
    data: PathBuf,
}

/// Measures what was asked for.
pub(super) async fn run(args: MergeArgs) -> anyhow::Result<()> {
    let MergeArgs { halves, cuts, strangers, mrclam, fleet, seed, data } = args;
    anyhow::ensure!(
        !(halves.is_empty() && strangers.is_empty() && mrclam.is_none() && fleet.is_none()),
        "nothing to measure: name --halves, --strangers, --mrclam or --fleet"
    );
    if !halves.is_empty() {
        halves::print(&halves, cuts, &data).await?;
    }
    if !strangers.is_empty() {
        strangers::print(&strangers, &data).await?;
    }
    if let Some(folder) = mrclam {
        landmarks::print(&folder, &data).await?;
    }
    if let Some(n_robots) = fleet {
        fleet::print(n_robots, seed, &data).await?;
    }
    Ok(())
}
