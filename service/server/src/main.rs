//! The binary `meetpoint`.

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use meetpoint_server::{commands, demo, replay};

/// A mapping service for indoor robot fleets.
#[derive(Debug, Parser)]
#[command(name = "meetpoint", version, arg_required_else_help = true)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// The whole service with simulated robots: a site to look at, in a new folder
    Demo(demo::DemoArgs),
    /// The service: gRPC and REST on one port
    Serve(commands::serve::ServeArgs),
    /// Send recorded data as a robot would
    Replay(replay::ReplayArgs),
    /// Save a map's grid, or draw it here
    Map(commands::map::MapArgs),
    /// Show a map's regions and how they hang together, or draw them
    Graph(commands::graph::GraphArgs),
    /// Find a path on a map, or draw it
    Plan(commands::plan::PlanArgs),
    /// Show where robots are to go to see what nobody has seen
    Explore(commands::explore::ExploreArgs),
    /// Save a session's trajectory
    Trajectory(commands::trajectory::TrajectoryArgs),
    /// Show what became of a map's cells since a version
    Changes(commands::changes::ChangesArgs),
    /// Show the doors of a map: places whose occupancy keeps changing
    Doors(commands::doors::DoorsArgs),
    /// Show what readings of a map's sensors are taken to mean, or decide on it
    Parameters(commands::parameters::ParametersArgs),
    /// Show the places of a map, their gateways and how paths join them, or draw them
    Places(commands::places::PlacesArgs),
    /// Show every topological map that fits a travel from place to place, and what would decide
    Hypotheses(commands::hypotheses::HypothesesArgs),
    /// Make new weights for the network that reads sonar
    Train(commands::train::TrainArgs),
    /// Measure this service on this machine
    Bench(commands::bench::BenchArgs),
    /// Compute all that is derived again from the journal, into a new version
    Rebuild(commands::rebuild::RebuildArgs),
    /// Find out where robots had been and where landmarks are, whatever the odometry did
    Relax(commands::relax::RelaxArgs),
    /// Find out where sessions of unknown start lie in the map, or in one another
    Merge(commands::merge::MergeArgs),
    /// Show where sessions of unknown start lie, accept or reject that, or undo it
    Merges(commands::merges::MergesArgs),
    /// Show what relax jobs took for the same place, or switch one off or on
    Closures(commands::closures::ClosuresArgs),
}

/// What `println!` says when whoever read our output has gone away.
const NO_READER: &str = "failed printing to stdout";
/// Exit status of a program that a broken pipe ended, as shells show it.
const BROKEN_PIPE_STATUS: i32 = 141;

/// `meetpoint demo | head` ends quietly, as other programs do.
fn end_quietly_without_reader() {
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        let said = panic.payload_as_str();
        if said.is_some_and(|text| text.starts_with(NO_READER)) {
            std::process::exit(BROKEN_PIPE_STATUS);
        }
        usual(panic);
    }));
}

#[tokio::main]
async fn main() -> ExitCode {
    end_quietly_without_reader();
    let done = match Arguments::parse().command {
        Command::Demo(args) => demo::run(args).await,
        Command::Serve(args) => commands::serve::run(args).await,
        Command::Replay(args) => replay::run(args).await,
        Command::Map(args) => commands::map::run(args).await,
        Command::Graph(args) => commands::graph::run(args).await,
        Command::Plan(args) => commands::plan::run(args).await,
        Command::Explore(args) => commands::explore::run(args).await,
        Command::Trajectory(args) => commands::trajectory::run(args).await,
        Command::Changes(args) => commands::changes::run(args).await,
        Command::Doors(args) => commands::doors::run(args).await,
        Command::Parameters(args) => commands::parameters::run(args).await,
        Command::Places(args) => commands::places::run(args).await,
        Command::Hypotheses(args) => commands::hypotheses::run(&args).await,
        Command::Train(args) => commands::train::run(args).await,
        Command::Bench(args) => commands::bench::run(args).await,
        Command::Rebuild(args) => commands::rebuild::run(args).await,
        Command::Relax(args) => commands::relax::run(args).await,
        Command::Merge(args) => commands::merge::run(args).await,
        Command::Merges(args) => commands::merges::run(args).await,
        Command::Closures(args) => commands::closures::run(args).await,
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("meetpoint: {error:#}");
            ExitCode::FAILURE
        }
    }
}
