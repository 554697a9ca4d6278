//! `meetpoint bench queries`: how long answers about ways take, and how many there are a second.
//!
//! The client runs on the cores of the service. Over gRPC answers are decoded, as every client of
//! gRPC does; over REST the body is read and not parsed.

mod agreement;
mod door;
mod draw;
mod question;
mod rest;

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use anyhow::Context;
use meetpoint_client::{Client, v1};
use tokio::task::JoinSet;
use tokio::time::{Instant, sleep};

use super::child::ChildService;
use super::percentile::{milliseconds, percentile};
use door::{Door, DoorKind};
use draw::FreePoints;
use question::{Question, Shape};

/// The map that is asked about.
const MAP: &str = "bench";
/// Questions of each shape whose answers are compared between the doors.
const N_COMPARED: usize = 200;
/// Matrices that are compared: each has 10 000 entries.
const N_MATRICES_COMPARED: usize = 3;
/// Pairs for every matrix that is asked for.
const PAIRS_PER_MATRIX: usize = 100;
/// Seed of the pairs.
const SEED: u64 = 1;
/// Between two looks at whether tables are made.
const LOOK_INTERVAL: Duration = Duration::from_millis(100);
/// Tables that take longer are given up.
const PATIENCE: Duration = Duration::from_mins(2);

/// Options of `meetpoint bench queries`.
#[derive(Debug, clap::Args)]
pub(super) struct QueriesArgs {
    /// The map's YAML, as `map_server` reads it
    #[arg(value_name = "MAP.yaml")]
    map: PathBuf,
    /// Random pairs of free cells that a way leads between; a hundredth as many matrices
    #[arg(long, default_value_t = 20_000, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pairs: u32,
    /// Connections that ask at once
    #[arg(long, default_value_t = 16, value_parser = clap::value_parser!(u32).range(1..=256))]
    connections: u32,
    /// Folder for the database
    #[arg(long, value_name = "FOLDER", default_value = ".")]
    data: PathBuf,
}

/// What came of asking a list of questions.
struct Measured {
    /// Of each answer, ascending.
    latencies: Vec<Duration>,
    took: Duration,
}

/// Compares the doors, then measures each with every shape of question.
pub(super) async fn run(args: QueriesArgs) -> anyhow::Result<()> {
    let service = ChildService::start(&args.data, "queries")?;
    import(&args.map, &service.url)?;
    let client = Client::connect(&service.url)?;
    let mut points = FreePoints::new(&client.grid(MAP, 0).await?, SEED)?;
    wait_for_tables(&client, points.pair()).await?;
    let n_pairs = args.pairs as usize;
    let pairs = points.connected_pairs(&client, MAP, n_pairs).await?;
    let n_cells = points.len();
    println!("{}: {n_cells} free cells, {n_pairs} pairs drawn at random", args.map.display());
    let mut asked: Vec<(Shape, Arc<[Question]>)> = Vec::new();
    for shape in Shape::OF_PAIRS {
        asked.push((shape, pairs.iter().map(|&pair| shape.of_pair(MAP, pair)).collect()));
    }
    let n_matrices = n_pairs.div_ceil(PAIRS_PER_MATRIX);
    let matrices = (0..n_matrices).map(|_| points.matrix(MAP)).collect();
    asked.push((Shape::Matrix, matrices));
    let n_compared = compare(&service.url, &asked).await?;
    println!("{n_compared} answers over gRPC and over REST compared: the same\n");
    print_head(args.connections);
    for (shape, questions) in &asked {
        for kind in DoorKind::ALL {
            let one = measure(&service.url, kind, 1, questions).await?;
            let many = measure(&service.url, kind, args.connections, questions).await?;
            print_row(*shape, kind, &one, &many);
        }
    }
    if let Some(mb) = service.peak_memory_mb() {
        println!("\nPeak memory of the service: {mb:.0} MB.");
    }
    Ok(())
}

/// Imports with this very binary, in a process of its own, as a user would.
fn import(yaml: &Path, url: &str) -> anyhow::Result<()> {
    let binary = std::env::current_exe().context("cannot find this binary")?;
    let status = Command::new(binary)
        .args(["map", "import"])
        .arg(yaml)
        .args(["--map", MAP, "--server", url])
        .stdout(Stdio::null())
        .status()
        .context("cannot start the import")?;
    anyhow::ensure!(status.success(), "{} is not imported", yaml.display());
    Ok(())
}

/// Waits until answers come from plan tables.
async fn wait_for_tables(client: &Client, pair: [v1::Point; 2]) -> anyhow::Result<()> {
    let begin = Instant::now();
    let Question::Path(request) = Shape::Route.of_pair(MAP, pair) else {
        anyhow::bail!("a route is a question for a path");
    };
    loop {
        let reply = client.plan_path(request.clone()).await?;
        let basis = reply.basis.context("the answer does not say what it is computed from")?;
        if basis.answered_by() == v1::AnsweredBy::Tables {
            return Ok(());
        }
        let limit_s = PATIENCE.as_secs();
        anyhow::ensure!(begin.elapsed() < PATIENCE, "no plan tables after {limit_s} s");
        sleep(LOOK_INTERVAL).await;
    }
}

/// Asks the first questions of each list over both doors. How many were compared.
async fn compare(url: &str, asked: &[(Shape, Arc<[Question]>)]) -> anyhow::Result<usize> {
    let mut grpc = Door::open(DoorKind::Grpc, url).await?;
    let mut rest = Door::open(DoorKind::Rest, url).await?;
    let mut n_compared = 0;
    for (shape, questions) in asked {
        let n = if *shape == Shape::Matrix { N_MATRICES_COMPARED } else { N_COMPARED };
        for question in questions.iter().take(n) {
            let one = agreement::answer(&grpc.ask(question).await?)?;
            let other = agreement::answer(&rest.ask(question).await?)?;
            anyhow::ensure!(
                one == other,
                "gRPC answers {one:?} and REST {other:?} to {question:?}"
            );
            n_compared += 1;
        }
    }
    Ok(n_compared)
}

/// Asks every question once, over so many connections at once, each in sequence.
async fn measure(
    url: &str,
    kind: DoorKind,
    n_connections: u32,
    questions: &Arc<[Question]>,
) -> anyhow::Result<Measured> {
    let mut doors = Vec::new();
    for _ in 0..n_connections {
        let mut door = Door::open(kind, url).await?;
        // The first answer connects.
        if let Some(question) = questions.first() {
            door.ask(question).await?;
        }
        doors.push(door);
    }
    let next = Arc::new(AtomicUsize::new(0));
    let begin = Instant::now();
    let mut asking = JoinSet::new();
    for door in doors {
        asking.spawn(ask_on(door, Arc::clone(questions), Arc::clone(&next)));
    }
    let mut latencies = Vec::with_capacity(questions.len());
    while let Some(asked) = asking.join_next().await {
        latencies.append(&mut asked??);
    }
    let took = begin.elapsed();
    latencies.sort_unstable();
    Ok(Measured { latencies, took })
}

/// Asks one question after the other that no other connection has asked; how long each took.
async fn ask_on(
    mut door: Door,
    questions: Arc<[Question]>,
    next: Arc<AtomicUsize>,
) -> anyhow::Result<Vec<Duration>> {
    let mut latencies = Vec::new();
    while let Some(question) = questions.get(next.fetch_add(1, Ordering::Relaxed)) {
        let begin = Instant::now();
        door.ask(question).await?;
        latencies.push(begin.elapsed());
    }
    Ok(latencies)
}

fn print_head(n_connections: u32) {
    println!(
        "| question | door | p50, ms | p99, ms | {n_connections} at once: a second | p50, ms | p99, ms |"
    );
    println!("|---|---|---|---|---|---|---|");
}

fn print_row(shape: Shape, kind: DoorKind, one: &Measured, many: &Measured) {
    let of = |measured: &Measured, p| milliseconds(percentile(&measured.latencies, p));
    println!(
        "| {} | {} | {:.3} | {:.3} | {:.0} | {:.2} | {:.2} |",
        shape.name(),
        kind.name(),
        of(one, 0.50),
        of(one, 0.99),
        many.latencies.len() as f64 / many.took.as_secs_f64(),
        of(many, 0.50),
        of(many, 0.99),
    );
}
