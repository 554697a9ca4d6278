//! `meetpoint demo`: the whole service with simulated robots, told in plain words.

mod accuracy;
mod delivery;
mod drives;
mod exploring;
mod newcomer;

use std::convert::Infallible;
use std::net::{IpAddr, TcpListener};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::Context;
use meetpoint_client::{Client, v1};
use meetpoint_occupancy::{Raster, png, terminal};

use crate::commands::{map, serve::asked_to_stop};
use crate::serve::{self, Running};
use crate::settings;
use accuracy::Accuracy;
pub(crate) use drives::{SimulatedDrive, simulate as simulate_office, simulated};

/// The map that the robots draw.
const MAP: &str = "office";
/// Where the data goes if nothing is said; `-2`, `-3`... are tried behind it.
const FOLDER: &str = "meetpoint-demo";
/// Folders tried before the demo asks for a name.
const N_FOLDERS_MAX: u32 = 1000;
/// Columns of the drawing: fits most terminals, and an office is seen at about 0.25 m a dot.
const N_COLUMNS: usize = 100;
/// How often the map is asked for new versions while robots send.
const LOOK_INTERVAL: Duration = Duration::from_millis(200);

/// Options of `meetpoint demo`.
#[derive(Debug, clap::Args)]
pub struct DemoArgs {
    /// End when the map is drawn, instead of serving it until Ctrl-C
    #[arg(long)]
    exit: bool,
    /// Another number, other errors of wheels and lasers; the same number, the same map
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// A new folder for the database and the picture [default: ./meetpoint-demo]
    #[arg(long, value_name = "FOLDER")]
    data: Option<PathBuf>,
    /// Port for REST and gRPC; 0 takes a free one [default: 7373, or a free one]
    #[arg(long)]
    port: Option<u16>,
}

/// Starts the service, drives two robots through an office and a third one that has to be found there, has
/// another explore a building by itself, and shows what came of it.
///
/// # Errors
/// If the service cannot start or something on the way failed; the message says what.
pub async fn run(args: DemoArgs) -> anyhow::Result<()> {
    let data = new_folder(args.data.as_deref())?;
    let mut chosen = settings::read(None, std::env::vars())?;
    chosen.server.data.clone_from(&data);
    let (host, port) = (chosen.server.host, chosen.server.port);
    chosen.server.port = args.port.unwrap_or_else(|| port_or_free(host, port));
    // The demo asks by itself, and once, so that the same number gives the same map.
    chosen.merging.looks_again = false;
    chosen.merging.relaxes_after = false;
    let running = serve::start(chosen).await?;
    let url = format!("http://{}", running.address);
    println!("Meetpoint listens on {url}, REST and gRPC, with its data in {}.\n", data.display());

    let shown = show(&url, &data, args.seed).await;
    if shown.is_ok() && !args.exit {
        println!("\nServing until Ctrl-C.");
        asked_to_stop().await;
    }
    stop(running, &data, shown).await
}

async fn stop(running: Running, data: &Path, shown: anyhow::Result<()>) -> anyhow::Result<()> {
    running.stop().await?;
    shown?;
    println!("\nThe site is kept: meetpoint serve --data {}", data.display());
    Ok(())
}

/// All that happens between the start and the end of the service.
async fn show(url: &str, data: &Path, seed: u64) -> anyhow::Result<()> {
    let simulate = move || (drives::simulate(seed), drives::simulate_newcomer(seed));
    let simulated = tokio::task::spawn_blocking(simulate);
    let (mut drives, newcomer) = simulated.await.context("the simulation failed")?;
    let newcomer = newcomer.context("the office lacks the newcomer's places")?;
    tell_drives(&drives);

    let client = Client::connect(url)?;
    client.create_map(MAP, 0.0).await.context("cannot make the map")?;
    let began = Instant::now();
    let mut sessions = tokio::select! {
        sessions = delivery::deliver_all(&client, MAP, &drives) => sessions?,
        never = tell_versions(&client) => match never {},
    };
    tell_speed(&drives, began.elapsed());
    sessions.push(newcomer::merged(&client, &newcomer).await?);
    drives.push(newcomer);

    let grid = client.grid(MAP, 0).await.context("cannot get the grid")?;
    let version = grid.map_version;
    let raster = map::raster(grid)?;
    let picture = save_picture(&raster, data)?;
    println!("\n{}", terminal(&raster, N_COLUMNS));
    println!(
        "Version {version} of the map: walls in dots, · where it is free, blank where no beam"
    );
    println!("ever came. As a picture: {}", picture.display());

    tell_accuracy(&client, &drives, &sessions).await?;
    exploring::explored(&client, data, seed).await?;
    tell_addresses(url, &sessions);
    Ok(())
}

fn tell_drives(drives: &[SimulatedDrive]) {
    println!("Two simulated robots drive through an office of 40 by 25 m. They know where they");
    println!(
        "start. Their wheels measure 2 % too much and drift to one side; their lasers see half"
    );
    println!("a turn, 20 m far, give or take 1 cm.\n");
    for drive in drives {
        let SimulatedDrive { robot, length_m, duration_s, map_from_start, .. } = drive;
        let (x_m, y_m) = (map_from_start.x_m, map_from_start.y_m);
        println!("  {robot} goes {length_m:.0} m in {duration_s:.0} s, from ({x_m:.1}, {y_m:.1})");
    }
    println!("\nThey send everything over gRPC, as fast as the service takes it:\n");
}

/// Says when a new version of the map is there, again and again, until dropped.
async fn tell_versions(client: &Client) -> Infallible {
    let mut told = 0;
    loop {
        tokio::time::sleep(LOOK_INTERVAL).await;
        // If the service is in trouble, the deliveries say so.
        let Ok(version) = client.map_version(MAP, 0).await else { continue };
        if told < version.number {
            told = version.number;
            println!("  {}", version_line(&version));
        }
    }
}

fn version_line(version: &v1::MapVersion) -> String {
    let v1::BoundingBox { min_x_m, min_y_m, max_x_m, max_y_m } =
        version.bounding_box.unwrap_or_default();
    format!(
        "version {:>2} of the map: {:>4} scans drawn, {:.0} by {:.0} m seen",
        version.number,
        version.scans,
        max_x_m - min_x_m,
        max_y_m - min_y_m,
    )
}

fn tell_speed(drives: &[SimulatedDrive], elapsed: Duration) {
    let n_scans: usize = drives.iter().map(|drive| drive.moments.len()).sum();
    let driving_s: f64 = drives.iter().map(|drive| drive.duration_s).sum();
    let elapsed_s = elapsed.as_secs_f64();
    println!("\nAll {n_scans} scans were kept on disk, mapped and published in {elapsed_s:.1} s:");
    println!("{driving_s:.0} s of driving, {:.0} times as fast.", driving_s / elapsed_s);
}

fn save_picture(raster: &Raster, data: &Path) -> anyhow::Result<PathBuf> {
    let path = data.join("office.png");
    std::fs::write(&path, png(raster))
        .with_context(|| format!("cannot write {}", path.display()))?;
    Ok(path.canonicalize().unwrap_or(path))
}

async fn tell_accuracy(
    client: &Client,
    drives: &[SimulatedDrive],
    sessions: &[v1::Session],
) -> anyhow::Result<()> {
    println!("\nHow far from the simulated truth, over all scans (mean, worst):\n");
    println!("             {:32}  on the map", "wheels alone");
    for (drive, session) in drives.iter().zip(sessions) {
        let trajectory = client.trajectory(&session.id, 0, "robot").await?;
        let (wheels, mapped) = accuracy::compare(drive, &trajectory)?;
        println!("  {:<9}  {}  {}", drive.robot, accuracy_text(&wheels), accuracy_text(&mapped));
    }
    Ok(())
}

fn accuracy_text(accuracy: &Accuracy) -> String {
    let Accuracy { mean_m, max_m, mean_rad, max_rad } = *accuracy;
    let (mean_deg, max_deg) = (mean_rad.to_degrees(), max_rad.to_degrees());
    format!("{mean_m:6.3} m {mean_deg:4.1}°, {max_m:6.3} m {max_deg:4.1}°")
}

fn tell_addresses(url: &str, sessions: &[v1::Session]) {
    let mut addresses = vec![
        ("/docs".to_owned(), "what can be asked"),
        (format!("/v1/maps/{MAP}"), "the map"),
        (format!("/v1/maps/{MAP}/grid?format=png"), "its picture; pgm, yaml and npy too"),
        (format!("/v1/maps/{MAP}/versions"), "how it grew"),
        (format!("/v1/sessions?map={MAP}"), "who drew it"),
        ("/v1/maps/rooms/grid?format=png".to_owned(), "what the explorer drew"),
        ("/metrics".to_owned(), "how the service fares"),
    ];
    let n_longest = addresses.iter().map(|(path, _)| path.len()).max().unwrap_or(0);
    let trajectory = |id: &str| format!("/v1/sessions/{id}/trajectory?format=tum");
    addresses.extend(sessions.iter().map(|session| (trajectory(&session.id), "where it was")));
    println!("\nTo look at:\n");
    for (path, meaning) in addresses {
        println!("  {url}{path:n_longest$}  {meaning}");
    }
}

/// A folder that was not there before.
fn new_folder(wanted: Option<&Path>) -> anyhow::Result<PathBuf> {
    if let Some(folder) = wanted {
        std::fs::create_dir_all(folder)
            .with_context(|| format!("cannot make the folder {}", folder.display()))?;
        let mut entries = std::fs::read_dir(folder)
            .with_context(|| format!("cannot read the folder {}", folder.display()))?;
        anyhow::ensure!(
            entries.next().is_none(),
            "the folder {} is not empty; the demo needs a new one",
            folder.display()
        );
        return Ok(folder.to_owned());
    }
    for number in 1..=N_FOLDERS_MAX {
        let name = if number == 1 { FOLDER.to_owned() } else { format!("{FOLDER}-{number}") };
        match std::fs::create_dir(&name) {
            Ok(()) => return Ok(PathBuf::from(name)),
            Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => {}
            Err(error) => {
                return Err(error).with_context(|| {
                    format!("cannot make the folder {name} here; give another by --data")
                });
            }
        }
    }
    anyhow::bail!(
        "{N_FOLDERS_MAX} folders {FOLDER}... are here; remove some, or give one by --data"
    )
}

/// The port if nobody has it, else 0 for a free one.
fn port_or_free(host: IpAddr, port: u16) -> u16 {
    if TcpListener::bind((host, port)).is_ok() { port } else { 0 }
}
