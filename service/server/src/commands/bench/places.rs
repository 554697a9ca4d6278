//! `meetpoint bench places`: places found by sonar without a map, all maps that fit a travel, gateways of plans.
//! Nothing is served: what is measured are the crates that the service answers with.

mod driven;
mod gateways;
mod growth;
mod nx;
mod plan;
mod section_four;
mod star_picture;
mod stars;
mod trail;
mod visits;
mod watch;
mod worlds;

use std::path::PathBuf;

use meetpoint_places::qualitative::ExplorerParams;
use meetpoint_sim::NxDrive;

/// Options of `meetpoint bench places`.
#[derive(Debug, clap::Args)]
pub(super) struct PlacesArgs {
    /// Only these; all where nothing is said, gateways if there are plans
    #[arg(long, value_enum, value_delimiter = ',')]
    only: Vec<Figure>,
    /// Explorations of each environment, from seed 0 on
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u64).range(1..=1000))]
    seeds: u64,
    /// Tell of a single exploration instead, and draw it: in the environment of that name
    #[arg(long, value_name = "ENVIRONMENT")]
    watch: Option<String>,
    /// Standard deviation of readings in the exploration that is watched, as a share of the distance
    #[arg(long, value_name = "SHARE", default_value_t = 0.1, requires = "watch")]
    error: f64,
    /// The seed of the exploration that is watched
    #[arg(long, value_name = "N", default_value_t = 1, requires = "watch")]
    seed: u64,
    /// The exploration that is watched has no compass
    #[arg(long, requires = "watch")]
    no_compass: bool,
    /// Folder for pictures of stars
    #[arg(long, value_name = "FOLDER")]
    pictures: Option<PathBuf>,
    /// Plans are parsed as a whole only: no robot drives through
    #[arg(long)]
    no_drive: bool,
    /// Plans of buildings, `NAME.png` beside `NAME_gt_segmentation.png`, where rooms lie between drawn
    /// lines; 0.05 m a pixel
    #[arg(value_name = "PLAN")]
    plans: Vec<PathBuf>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Figure {
    /// Environments explored by sonar at 0, 5 and 10 % error, with a compass and without (KB88)
    Kb88,
    /// The same with and without what tells places apart
    Kb88Matching,
    /// The same in corridors of other widths
    Kb88Widths,
    /// The same at larger errors and with fewer firings
    Kb88Noise,
    /// 6 paths, 9 places, 4 local topologies, 14 travels (HSSH04, section IV)
    Section4,
    /// A hundred random floors with nested loops: whether the true map is ever lost
    Worlds,
    /// A hundred places, a thousand travels: hypotheses, memory, time
    Growth,
    /// The same floors driven by what the maps ask for
    Driven,
    /// The stars of a drawn office
    Stars,
    /// Gateways against doors, of plans and as a laser finds them
    Gateways,
}

impl Figure {
    const ALL: [Self; 10] = [
        Self::Kb88,
        Self::Kb88Matching,
        Self::Kb88Widths,
        Self::Kb88Noise,
        Self::Section4,
        Self::Worlds,
        Self::Growth,
        Self::Driven,
        Self::Stars,
        Self::Gateways,
    ];
}

/// Measures what was asked for.
pub(super) async fn run(args: PlacesArgs) -> anyhow::Result<()> {
    tokio::task::spawn_blocking(move || {
        if let Some(name) = &args.watch {
            return watch::tell(name, args.drive());
        }
        let has_plans = !args.plans.is_empty();
        let chosen = |figure: &Figure| *figure != Figure::Gateways || has_plans;
        let figures: Vec<Figure> = if args.only.is_empty() {
            Figure::ALL.into_iter().filter(chosen).collect()
        } else {
            args.only.clone()
        };
        for figure in figures {
            args.print(figure)?;
            println!();
        }
        Ok(())
    })
    .await?
}

impl PlacesArgs {
    /// The exploration to be watched.
    fn drive(&self) -> NxDrive {
        let params =
            if self.no_compass { ExplorerParams::NX_WITHOUT_COMPASS } else { ExplorerParams::NX };
        NxDrive { params, range_error: self.error, has_home: false, seed: self.seed }
    }

    fn print(&self, figure: Figure) -> anyhow::Result<()> {
        match figure {
            Figure::Kb88 => nx::of_errors(self.seeds),
            Figure::Kb88Matching => nx::of_matching(self.seeds),
            Figure::Kb88Widths => return nx::of_widths(self.seeds),
            Figure::Kb88Noise => nx::of_noise(self.seeds),
            Figure::Section4 => return section_four::print(),
            Figure::Worlds => return worlds::print(),
            Figure::Growth => return growth::print(),
            Figure::Driven => return driven::print(),
            Figure::Stars => return stars::print(self.pictures.as_deref()),
            Figure::Gateways => {
                return gateways::print(&self.plans, self.pictures.as_deref(), !self.no_drive);
            }
        }
        Ok(())
    }
}
