//! `meetpoint explore`: where robots are to go to see what nobody has seen.

use std::path::PathBuf;

use meetpoint_proto::v1;

use super::asked::{ServerArgs, save};
use super::plan::point;
use crate::rest::{Exploration, exploration_code_name};

/// Options of `meetpoint explore`.
#[derive(Debug, clap::Args)]
pub struct ExploreArgs {
    /// The map
    map: String,
    /// A robot with an open session on the map; more than one may be named. All of them where nobody
    /// is named
    #[arg(long = "robot", value_name = "ROBOT")]
    robots: Vec<String>,
    /// Somebody there, in metres in the frame that is explored; more than one may be given
    #[arg(long = "at", value_name = "X,Y", value_parser = point, allow_hyphen_values = true)]
    positions: Vec<v1::Point>,
    /// Radius of the robots, metres; that of the profile `default` where nothing is said
    #[arg(long, value_name = "R", conflicts_with = "profile")]
    radius: Option<f64>,
    /// A profile of the map
    #[arg(long)]
    profile: Option<String>,
    /// The version; the map as it is now where nothing is said
    #[arg(long, default_value_t = 0, hide_default_value = true)]
    version: u64,
    /// A session of unknown start: the frame that it maps in instead of the map's
    #[arg(long)]
    session: Option<String>,
    /// Write the values as a picture: white is unexplored, the darker the farther from it
    #[arg(long, value_name = "FILE")]
    png: Option<PathBuf>,
    #[command(flatten)]
    server: ServerArgs,
}

/// Asks for goals, tells them and writes the picture.
///
/// # Errors
/// If the service cannot say, or the picture cannot be written.
pub async fn run(args: ExploreArgs) -> anyhow::Result<()> {
    let reply = args.server.client()?.exploration(request(&args)).await?;
    if let Some(path) = &args.png {
        save(path, &reply.png)?;
    }
    let exploration = reply.exploration.unwrap_or_default();
    if args.server.json {
        println!("{}", serde_json::to_string(&Exploration::from(exploration))?);
    } else if args.png.as_ref().is_none_or(|path| path.as_os_str() != "-") {
        report(&exploration);
    }
    Ok(())
}

fn request(args: &ExploreArgs) -> v1::GetExplorationRequest {
    use v1::explorer::Kind;
    use v1::robot_choice::Kind as Choice;
    let robots = args.robots.iter().cloned().map(Kind::Robot);
    let explorers = robots.chain(args.positions.iter().copied().map(Kind::Position));
    let profile = args.profile.clone().map(Choice::Profile);
    let kind = profile.or_else(|| args.radius.map(Choice::RobotRadiusM));
    v1::GetExplorationRequest {
        map: args.map.clone(),
        explorers: explorers.map(|kind| v1::Explorer { kind: Some(kind) }).collect(),
        robot: kind.map(|kind| v1::RobotChoice { kind: Some(kind) }),
        map_version: args.version,
        picture: args.png.is_some(),
        session: args.session.clone().unwrap_or_default(),
    }
}

fn report(exploration: &v1::Exploration) {
    for robot in &exploration.robots {
        let at = robot.pose.unwrap_or_default();
        let at = format!("({:.2}, {:.2})", at.x_m, at.y_m);
        let name = if robot.robot.is_empty() { &at } else { &robot.robot };
        match robot.goal {
            Some(v1::Point { x_m, y_m }) => {
                let heading_deg = robot.heading_rad.unwrap_or_default().to_degrees();
                let distance_m = robot.distance_m;
                println!(
                    "{name} at {at} m: to ({x_m:.2}, {y_m:.2}) m, {distance_m:.2} m, heading \
                     {heading_deg:.0}°"
                );
            }
            None => {
                let elsewhere = match robot.frame_session.as_deref() {
                    Some("") => ", it lies in the map's frame".to_owned(),
                    Some(session) => format!(", it maps in the frame of session {session}"),
                    None => String::new(),
                };
                println!("{name}: {}{elsewhere}", exploration_code_name(robot.code()));
            }
        }
    }
    if exploration.explored {
        println!("explored: nothing that they can reach is left");
    }
    let v1::Exploration { frontier_m, observed_m2, reached_m2, .. } = exploration;
    println!(
        "{frontier_m:.1} m of frontiers; {observed_m2:.1} m² observed, {reached_m2:.1} m² reached"
    );
    for arc in &exploration.missing_arcs {
        println!("arc {arc} is closed, and this version has no such arc");
    }
    let live = if exploration.live { " and what was mapped since" } else { "" };
    println!(
        "map {}, version {}{live}, robots of {} m radius, in {} us",
        exploration.map,
        exploration.map_version,
        exploration.robot_radius_m,
        exploration.planning_time_us
    );
}
