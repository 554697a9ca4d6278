//! `meetpoint bench nx`: the robot of Kuipers and Byun 1988 in its environments, driven by the service.
//!
//! Closed loop over gRPC: a batch with one firing, made durable; the next step; the simulated robot does it. All that
//! the service knows of its motions is its odometry. The client runs on the cores of the service.

use std::f64::consts::TAU;
use std::path::PathBuf;
use std::time::Duration;

use anyhow::Context;
use meetpoint_client::{Client, v1};
use meetpoint_geometry::Pose;
use meetpoint_places::qualitative::ExplorerParams;
use meetpoint_places::{Gateway, Observation, PlaceId, PlaceMap, Star, World, is_isomorphic};
use meetpoint_sim::{Nx, NxDrive, NxWorld, nx_worlds};
use tokio::time::Instant;
use v1::observation::Kind;

use super::child::ChildService;
use super::percentile::{milliseconds, percentile};

/// Firings after which an exploration counts as not complete.
const N_FIRINGS_MAX: u64 = 60_000;
/// Sonars of the ring.
const N_SONARS: u32 = 16;
/// They hear no farther, in metres.
const RANGE_MAX_M: f64 = 6.0;
/// The robot's clock at the start, nanoseconds, and from one firing to the next.
const START_NS: i64 = 1_767_225_600_000_000_000;
const FIRING_NS: i64 = 200_000_000;
/// Edge of a cell of the maps that are drawn meanwhile, in metres.
const RESOLUTION_M: f64 = 0.1;

/// Options of `meetpoint bench nx`.
#[derive(Debug, clap::Args)]
pub(super) struct NxArgs {
    /// Only this environment, for example `two loops`; all if none is given
    #[arg(value_name = "NAME")]
    world: Option<String>,
    /// Standard deviation of sonar readings, as a share of the distance
    #[arg(long, default_value_t = 0.05)]
    error: f64,
    /// Without a compass
    #[arg(long)]
    no_compass: bool,
    /// Another number, other errors
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Folder for the database
    #[arg(long, value_name = "FOLDER", default_value = ".")]
    data: PathBuf,
    /// Save drawings of the graphs found in this folder
    #[arg(long, value_name = "FOLDER")]
    png: Option<PathBuf>,
}

/// What came of one exploration.
struct Driven {
    is_true: bool,
    told: v1::GetQualitativeExplorationResponse,
    took: Duration,
    /// Of each answer, ascending.
    asks: Vec<Duration>,
    /// Of each batch until it was durable, ascending.
    sends: Vec<Duration>,
}

/// Drives through the environments and prints a table.
pub(super) async fn run(args: NxArgs) -> anyhow::Result<()> {
    let worlds: Vec<NxWorld> = nx_worlds()
        .into_iter()
        .filter(|world| args.world.as_ref().is_none_or(|name| world.name == name))
        .collect();
    anyhow::ensure!(!worlds.is_empty(), "there is no such environment");
    let service = ChildService::start(&args.data, "nx")?;
    let client = Client::connect(&service.url)?;
    println!(
        "| environment | true graph | places | edges | rehearsals | steps | firings a second | answer, median | 99 % | \
         firing durable, median |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    let (mut n_true, mut asks) = (0, Vec::new());
    for world in &worlds {
        let driven = drive(&client, world, &args).await.with_context(|| world.name)?;
        print_row(world, &driven);
        if let Some(folder) = &args.png {
            let name = format!("{}.png", world.name.replace(' ', "-"));
            std::fs::write(folder.join(name), &driven.told.png).context("cannot save a drawing")?;
        }
        n_true += u32::from(driven.is_true);
        asks.extend(driven.asks);
    }
    asks.sort();
    println!(
        "\n{n_true} of {} with the true graph; {} answers, {:.2} ms in the middle, 99 % within {:.2} ms, at most \
         {:.1} ms.",
        worlds.len(),
        asks.len(),
        milliseconds(percentile(&asks, 0.5)),
        milliseconds(percentile(&asks, 0.99)),
        milliseconds(percentile(&asks, 1.0)),
    );
    Ok(())
}

fn print_row(world: &NxWorld, driven: &Driven) {
    let Driven { is_true, told, took, asks, sends } = driven;
    let step = told.step.unwrap_or_default();
    println!(
        "| {} | {} | {} | {} | {} | {} | {:.0} | {:.2} ms | {:.2} ms | {:.2} ms |",
        world.name,
        if *is_true { "yes" } else { "no" },
        told.places.len(),
        told.edges.len(),
        told.rehearsals,
        step.steps,
        step.firings as f64 / took.as_secs_f64(),
        milliseconds(percentile(asks, 0.5)),
        milliseconds(percentile(asks, 0.99)),
        milliseconds(percentile(sends, 0.5)),
    );
}

async fn drive(client: &Client, world: &NxWorld, args: &NxArgs) -> anyhow::Result<Driven> {
    let params =
        if args.no_compass { ExplorerParams::NX_WITHOUT_COMPASS } else { ExplorerParams::NX };
    let drive = NxDrive { params, range_error: args.error, has_home: false, seed: args.seed };
    let mut nx = drive.robot(world);
    let session = open(client, &world.name.replace(' ', "-")).await?;
    let begin = v1::BeginQualitativeExplorationRequest {
        session: session.id.clone(),
        compass: !args.no_compass,
        ..Default::default()
    };
    client.begin_qualitative_exploration(begin).await?;
    let began = Instant::now();
    let (mut asks, mut sends) = (Vec::new(), Vec::new());
    let mut odometry = Pose::new(0.0, 0.0, nx.heading_rad());
    for number in 1..=N_FIRINGS_MAX {
        let sent = Instant::now();
        client.ingest_batch(&session, firing(&nx, odometry, number)).await?;
        let durable = Instant::now();
        let step = client.next_step(&session.id).await?;
        asks.push(durable.elapsed());
        sends.push(durable - sent);
        if !carried_out(&mut nx, &mut odometry, &step) {
            break;
        }
    }
    let took = began.elapsed();
    asks.sort();
    sends.sort();
    let session = session.id.clone();
    let request = v1::GetQualitativeExplorationRequest { session, picture: args.png.is_some() };
    let told = client.qualitative_exploration(request).await?;
    let is_true = is_true(&told, world)?;
    Ok(Driven { is_true, told, took, asks, sends })
}

async fn open(client: &Client, map: &str) -> anyhow::Result<v1::Session> {
    client.create_map(map, RESOLUTION_M).await?;
    let angle_rad = |at: u32| TAU * f64::from(at) / f64::from(N_SONARS);
    let transducer = |at| v1::Pose { x_m: 0.0, y_m: 0.0, theta_rad: angle_rad(at) };
    let ring = v1::SonarRing {
        sensor_from_transducer: (0..N_SONARS).map(transducer).collect(),
        cone_angle_rad: angle_rad(1),
        range_min_m: 0.0,
        range_max_m: RANGE_MAX_M,
    };
    let ring = v1::Sensor {
        id: "ring".to_owned(),
        robot_from_sensor: None,
        kind: Some(v1::sensor::Kind::SonarRing(ring)),
    };
    let opening = v1::OpenSessionRequest {
        map: map.to_owned(),
        robot: "nx".to_owned(),
        client_key: map.to_owned(),
        epoch: 0,
        start: None,
        sensors: vec![ring],
        delivery: v1::Delivery::BoundedLag.into(),
    };
    Ok(client.open_session(opening).await?.0)
}

fn firing(nx: &Nx, odometry: Pose, number: u64) -> v1::Batch {
    let stamp_ns = START_NS + FIRING_NS * i64::try_from(number).unwrap_or(i64::MAX / FIRING_NS);
    let observation = |sensor_id: &str, kind| v1::Observation {
        stamp_ns,
        monotonic_ns: None,
        sensor_id: sensor_id.to_owned(),
        kind: Some(kind),
    };
    let Pose { x_m, y_m, theta_rad } = odometry;
    let odometry_from_robot = Some(v1::Pose { x_m, y_m, theta_rad });
    #[expect(clippy::cast_possible_truncation, reason = "as the wire has it")]
    let ranges_m = nx.ranges_m().iter().map(|&range_m| range_m as f32).collect();
    let observations = vec![
        observation("", Kind::OdometryPose(v1::OdometryPose { odometry_from_robot })),
        observation("ring", Kind::SonarScan(v1::SonarScan { ranges_m })),
    ];
    v1::Batch { number, observations }
}

/// Does what it is told; false if that is nothing.
fn carried_out(nx: &mut Nx, odometry: &mut Pose, step: &v1::QualitativeStep) -> bool {
    match (step.turn_rad, step.move_m) {
        (Some(by_rad), _) => nx.turn(by_rad),
        (None, Some(by_m)) => {
            nx.advance(by_m);
            let (sin, cos) = nx.heading_rad().sin_cos();
            let moved_m = by_m.signum() * nx.moved_m();
            odometry.x_m += moved_m * cos;
            odometry.y_m += moved_m * sin;
        }
        (None, None) if step.kind() == v1::StepKind::Look => nx.look(),
        (None, None) => return false,
    }
    *odometry = Pose::new(odometry.x_m, odometry.y_m, nx.heading_rad());
    true
}

/// Whether all was explored and the graph that was told is the true one.
fn is_true(told: &v1::GetQualitativeExplorationResponse, world: &NxWorld) -> anyhow::Result<bool> {
    let is_complete = told.step.unwrap_or_default().state() == v1::QualitativeState::Complete;
    let truth = World::from_drawing(world.graph)?;
    let found = told_map(told)?.context("a graph that is none was told")?;
    Ok(is_complete && is_isomorphic(&found, truth.map()))
}

fn told_map(told: &v1::GetQualitativeExplorationResponse) -> anyhow::Result<Option<PlaceMap>> {
    let seen =
        |place: &v1::DistinctivePlace| anyhow::Ok(Observation::from(place.star.parse::<Star>()?));
    let places = told.places.iter().map(seen).collect::<anyhow::Result<Vec<_>>>()?;
    let end = |of: Option<v1::PlaceDirection>| {
        let v1::PlaceDirection { place, direction } = of.unwrap_or_default();
        anyhow::Ok(Gateway { place: PlaceId(place), index: u8::try_from(direction)? })
    };
    let edge = |edge: &v1::TravelEdge| anyhow::Ok([end(edge.from)?, end(edge.to)?]);
    let edges = told.edges.iter().map(edge).collect::<anyhow::Result<Vec<_>>>()?;
    Ok(PlaceMap::joined(&places, &edges))
}
