//! `meetpoint bench relaxation`: what relaxation makes of data whose truth is known, and what it costs.

mod beside;
mod iterations;
mod judgement;
mod mrclam;
mod paper;
mod plain_em;
mod relaxed;
mod simulated;
mod time;
mod worlds;

use std::num::NonZero;
use std::path::PathBuf;

/// Cores that are measured on.
const TWO: NonZero<usize> = NonZero::<usize>::MIN.saturating_add(1);

/// Options of `meetpoint bench relaxation`.
#[derive(Debug, clap::Args)]
pub(super) struct RelaxationArgs {
    /// Random buildings of each kind
    #[arg(long, default_value_t = 100)]
    seeds: u64,
    /// Seed of the first building, and of the paper's data sets
    #[arg(long, default_value_t = 0)]
    first: u64,
    /// An MRCLAM folder with its ground truth
    #[arg(long, value_name = "FOLDER")]
    mrclam: Option<PathBuf>,
    /// Only this part
    #[arg(long, value_enum)]
    only: Option<Part>,
    /// Folder for databases, on the disk that is to be measured
    #[arg(long, value_name = "FOLDER", default_value = ".")]
    data: PathBuf,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Part {
    /// What the paper's largest run costs
    Time,
    /// The paper's data sets
    Paper,
    /// Random buildings
    Worlds,
    /// Real robots, through the whole service
    Mrclam,
    /// Ingest beside a job
    Service,
}

/// Prints a table for every part. Memory is measured first, while nothing else has taken any.
pub(super) async fn run(args: RelaxationArgs) -> anyhow::Result<()> {
    let RelaxationArgs { seeds, first, mrclam, only, data } = args;
    let is_asked = |part| only.is_none_or(|only| only == part);
    if is_asked(Part::Time) {
        println!("## Time\n");
        tokio::task::spawn_blocking(move || time::print(first)).await?;
    }
    if is_asked(Part::Paper) {
        println!("\n## The paper's data sets\n");
        tokio::task::spawn_blocking(move || paper::print(first)).await?;
    }
    if is_asked(Part::Worlds) {
        println!("\n## Random buildings\n");
        tokio::task::spawn_blocking(move || worlds::print(first, seeds)).await?;
    }
    if is_asked(Part::Mrclam) {
        match mrclam {
            Some(folder) => {
                println!("\n## MRCLAM\n");
                mrclam::print(&folder, &data).await?;
            }
            None => anyhow::ensure!(only.is_none(), "--only mrclam needs --mrclam FOLDER"),
        }
    }
    if is_asked(Part::Service) {
        println!("\n## Ingest beside a job\n");
        beside::print(&data, first).await?;
    }
    Ok(())
}

fn megabytes(n_bytes: usize) -> f64 {
    n_bytes as f64 / 1e6
}
