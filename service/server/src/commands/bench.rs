//! `meetpoint bench`: the figures that README quotes, measured on the real binary from outside.

mod accuracy;
mod child;
mod ground_truth;
mod ingest;
mod matching;
mod measurement;
mod merge;
mod nx;
mod occupancy;
mod percentile;
mod places;
mod poses;
mod queries;
mod relation_frame;
mod relations;
mod relaxation;
mod replaying;
mod rigid_motion;
mod robots;

/// Options of `meetpoint bench`.
#[derive(Debug, clap::Args)]
pub struct BenchArgs {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, clap::Subcommand)]
enum What {
    /// How accurate trajectories are: logs replayed through the whole service, against relations
    Accuracy(accuracy::AccuracyArgs),
    /// How much is acknowledged and mapped, and how fast: simulated robots on loopback
    Ingest(ingest::IngestArgs),
    /// How long answers about ways take, and how many there are a second: over gRPC and over REST
    Queries(queries::QueriesArgs),
    /// Whether robots of unknown start are found, how exactly, and that nothing is merged wrongly
    Merge(merge::MergeArgs),
    /// How well and how fast sonar and laser become occupancy, and what exploration computes on it
    Occupancy(occupancy::OccupancyArgs),
    /// Places found by sonar, all maps that fit a travel, gateways of plans: after KB88 and HSSH04
    Places(places::PlacesArgs),
    /// Whether NX, driven by the service step by step over gRPC, finds the true graph, and how fast that is
    Nx(nx::NxArgs),
    /// What relaxation makes of data whose truth is known, and what it costs
    Relaxation(relaxation::RelaxationArgs),
}

/// Measures and prints a table.
///
/// # Errors
/// If something could not be measured.
pub async fn run(args: BenchArgs) -> anyhow::Result<()> {
    match args.what {
        What::Accuracy(args) => accuracy::run(args).await,
        What::Ingest(args) => ingest::run(args).await,
        What::Queries(args) => queries::run(args).await,
        What::Merge(args) => merge::run(args).await,
        What::Occupancy(args) => occupancy::run(args).await,
        What::Places(args) => places::run(args).await,
        What::Nx(args) => nx::run(args).await,
        What::Relaxation(args) => relaxation::run(args).await,
    }
}
