//! `meetpoint train`: new weights for the network that reads sonar.

mod recorded;

use std::path::PathBuf;

use anyhow::Context;
use meetpoint_occupancy::{
    Accuracy, Examination, Example, HeardPlace, HeldOut, Network, SonarModel, TrainingParams,
    WayExamination, WayTrainingParams, trained, trained_on_ways,
};
use meetpoint_sim::{Building, ChaCha8Rng};
use rand::SeedableRng;

use super::asked::{ServerArgs, save};
use crate::sonar_weights::{Purpose, SonarWeights, SonarWeightsFile};
use crate::training::{Ground, Share, heard_places, places, simulated, simulated_ways};

/// Held-out places come from a seed that no training data comes from.
pub(super) const HELD_OUT_SEED: u64 = 1_000_000;
/// Places to judge by where nothing else is asked for.
pub(super) const N_HELD_OUT: usize = 100_000;
/// Places to judge the sum of readings by.
pub(super) const N_WAYS_HELD_OUT: usize = 20_000;
/// The first weights and the order of examples are the same whatever the data: those by which the weights
/// that ship were made.
const WEIGHTS_SEED: u64 = 7;

/// Options of `meetpoint train`. Without a building, floors with rooms are drawn by lot.
#[derive(Debug, clap::Args)]
pub struct TrainArgs {
    /// A building as text: `#` is wall, blank and `.` are free
    #[arg(long, value_name = "FILE", group = "building")]
    drawing: Option<PathBuf>,
    /// Edge of one of its characters, in metres
    #[arg(long, value_name = "METRES", default_value_t = 0.25)]
    character_m: f64,
    /// A recorded building: the YAML of a `map_server` map, its image beside it
    #[arg(long, value_name = "FILE.yaml", group = "building")]
    grid: Option<PathBuf>,
    /// Where a robot drove in it: lines of `t x y z qx qy qz qw`, as `meetpoint trajectory` writes
    #[arg(long, value_name = "FILE", requires = "grid")]
    trajectory: Option<PathBuf>,
    /// A recorded building: a map of the service, along the trajectory of a session
    #[arg(long, value_name = "MAP", group = "building")]
    map: Option<String>,
    /// The map's version; the newest where nothing is said
    #[arg(long, requires = "map", default_value_t = 0, hide_default_value = true)]
    version: u64,
    /// The session; the map's latest where nothing is said
    #[arg(long, value_name = "ID", requires = "map")]
    session: Option<String>,
    /// What floors, firings and places are drawn from
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Places to learn from
    #[arg(long, default_value_t = 400_000, value_parser = clap::value_parser!(u64).range(1_000..=20_000_000))]
    places: u64,
    /// Places to judge by, where nothing was learnt
    #[arg(long, default_value_t = N_HELD_OUT as u64, value_parser = clap::value_parser!(u64).range(1_000..=20_000_000))]
    held_out: u64,
    /// Times that every place is shown
    #[arg(long, default_value_t = TrainingParams::STANDARD.n_epochs, value_parser = clap::value_parser!(u32).range(1..=1_000))]
    epochs: u32,
    /// Places to learn from besides by all that is heard of them on a way: such weights draw maps, and others follow
    /// robots
    #[arg(long, default_value_t = 0, value_parser = clap::value_parser!(u64).range(0..=2_000_000))]
    way_places: u64,
    /// Where to write the weights, for the setting `mapping.sonar_weights` of `meetpoint serve`, or
    /// `mapping.sonar_following_weights` without places on a way
    #[arg(long, short, value_name = "FILE", default_value = "sonar-weights.json")]
    output: PathBuf,
    #[command(flatten)]
    server: ServerArgs,
}

/// Places to learn from and to judge by, and what they are of.
struct Lessons {
    shown: Vec<Example>,
    held_out: Vec<HeldOut>,
    /// All that is heard of places on a way, to learn from and to judge by.
    ways: [Vec<HeardPlace>; 2],
    told: String,
}

/// Trains, judges, and writes the weights.
///
/// # Errors
/// If a building cannot be read, asked for or used, or the weights cannot be written.
pub async fn run(args: TrainArgs) -> anyhow::Result<()> {
    let building = building(&args).await?;
    let (seed, n_epochs) = (args.seed, args.epochs);
    let n_places = (usize::try_from(args.places)?, usize::try_from(args.held_out)?);
    let n_ways = usize::try_from(args.way_places)?;
    let n_ways = (n_ways, if n_ways == 0 { 0 } else { N_WAYS_HELD_OUT });
    let taught = tokio::task::spawn_blocking(move || {
        let lessons = lessons(building, n_places, n_ways, seed)?;
        eprintln!("training on {} places of {}", lessons.shown.len(), lessons.told);
        let params = TrainingParams { n_epochs, ..TrainingParams::STANDARD };
        let mut rng = ChaCha8Rng::seed_from_u64(WEIGHTS_SEED);
        let network = trained(&lessons.shown, &params, &mut rng);
        let [shown, _] = &lessons.ways;
        let network = trained_on_ways(&network, shown, &WayTrainingParams::STANDARD, &mut rng);
        let shipped = Examination::new(&Network::shipped(), &lessons.held_out);
        let examination = Examination::new(&network, &lessons.held_out);
        Ok::<_, anyhow::Error>((network, examination, shipped, lessons))
    });
    let (network, examination, shipped, lessons) = taught.await??;
    let weights = SonarWeights::new(network);
    let n_trained = lessons.shown.len();
    let purpose = if args.way_places == 0 { Purpose::Following } else { Purpose::Drawing };
    let file = SonarWeightsFile::new((&weights, purpose), lessons.told, n_trained, &examination);
    let text = serde_json::to_string_pretty(&file)? + "\n";
    save(&args.output, text.as_bytes())?;
    if args.server.json {
        println!("{}", serde_json::to_string(&file)?);
    } else {
        let networks = [("network that ships", &shipped), ("network trained now", &examination)];
        report(&examination, &networks);
        let [_, held_out] = &lessons.ways;
        if !held_out.is_empty() {
            let trained = ("network trained now", &*weights.network, SonarModel::BY_WAYS);
            let shipped = Network::shipped();
            report_ways(held_out, &[("network that ships", &shipped, SonarModel::INDOOR), trained]);
        }
        println!("weights {} are written to {}", weights.name, args.output.display());
    }
    Ok(())
}

/// The one building to train in, and what it is called; `None` for floors by lot.
async fn building(args: &TrainArgs) -> anyhow::Result<Option<(Ground, String)>> {
    if let Some(path) = &args.drawing {
        let place = || format!("the drawing {}", path.display());
        let drawing = std::fs::read_to_string(path).with_context(place)?;
        let building = Building::from_drawing(&drawing, args.character_m).with_context(place)?;
        return Ok(Some((Ground::of_building(building), place())));
    }
    if let Some(path) = &args.grid {
        return recorded::files(path, args.trajectory.as_deref()).map(Some);
    }
    let Some(map) = &args.map else { return Ok(None) };
    let client = args.server.client()?;
    recorded::map(&client, map, args.version, args.session.as_deref()).await.map(Some)
}

fn lessons(
    building: Option<(Ground, String)>,
    (n_shown, n_held_out): (usize, usize),
    (n_ways, n_ways_held_out): (usize, usize),
    seed: u64,
) -> anyhow::Result<Lessons> {
    let held_out_seed = seed.wrapping_add(HELD_OUT_SEED);
    let (shown, held_out, ways, told) = match building {
        None => {
            let told = format!("simulated floors of rooms, seed {seed}; held out are other floors");
            let ways =
                [simulated_ways(n_ways, seed)?, simulated_ways(n_ways_held_out, held_out_seed)?];
            (simulated(n_shown, seed)?, simulated(n_held_out, held_out_seed)?, ways, told)
        }
        Some((ground, told)) => {
            let told = format!("{told}, seed {seed}; held out is one of five squares of 4 m");
            let held_out = places(&ground, n_held_out, Share::HeldOut, held_out_seed)?;
            let ways = [
                heard_places(&ground, n_ways, Share::Shown, seed)?,
                heard_places(&ground, n_ways_held_out, Share::HeldOut, held_out_seed)?,
            ];
            (places(&ground, n_shown, Share::Shown, seed)?, held_out, ways, told)
        }
    };
    let shown = shown.iter().map(|place| place.example).collect();
    Ok(Lessons { shown, held_out, ways, told })
}

/// Prints what held-out places say of networks, and how well the answers of one are calibrated.
pub(super) fn report(examination: &Examination, networks: &[(&str, &Examination)]) {
    let occupied = 100.0 * examination.occupied_share;
    println!("{} places held out, {occupied:.1} % of them occupied", examination.n_places);
    println!("\n| model | cross-entropy, nats | wrong | calibration error |\n|---|---|---|---|");
    let row = |name: &str, accuracy: &Accuracy, calibration: &str| {
        let Accuracy { cross_entropy_nats: nats, wrong_share } = accuracy;
        println!("| {name} | {nats:.4} | {:.1} % | {calibration} |", 100.0 * wrong_share);
    };
    row("constant", &examination.constant, "");
    row("inverse cone", &examination.inverse_cone, "");
    for (name, found) in networks {
        row(name, &found.network, &format!("{:.3}", found.calibration_error()));
    }
    println!("\n| network says | places | occupied |\n|---|---|---|");
    for (index, tenth) in (0_u8..).zip(&examination.calibration) {
        let (low, high) = (f64::from(index) / 10.0, f64::from(index + 1) / 10.0);
        let share = tenth.n_occupied as f64 / tenth.n_places.max(1) as f64;
        println!("| {low:.1} to {high:.1} | {} | {share:.3} |", tenth.n_places);
    }
    println!();
}

/// Prints what became of held-out places by the sum of what networks say of them on a way.
pub(super) fn report_ways(places: &[HeardPlace], networks: &[(&str, &Network, SonarModel)]) {
    println!(
        "| sum over a way | places in sight | decided | right | of walls | out of sight | decided |"
    );
    println!("|{}", "---|".repeat(7));
    for (name, network, model) in networks {
        let params = WayTrainingParams { model: *model, ..WayTrainingParams::STANDARD };
        let found = WayExamination::new(network, places, &params);
        let percent = |n: usize, of: usize| 100.0 * n as f64 / of.max(1) as f64;
        println!(
            "| {name} | {} | {:.1} % | {:.2} % | {:.1} % | {} | {:.1} % |",
            found.n_seen,
            percent(found.n_decided, found.n_seen),
            percent(found.n_right, found.n_decided),
            percent(found.n_walls_right, found.n_walls),
            found.n_hidden,
            percent(found.n_hidden_decided, found.n_hidden),
        );
    }
    println!();
}
