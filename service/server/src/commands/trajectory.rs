//! `meetpoint trajectory`: where a robot was.

use std::path::PathBuf;

use anyhow::Context;
use meetpoint_proto::v1;

use super::asked::{ServerArgs, save};
use crate::{convert::tum, rest};

/// Options of `meetpoint trajectory`.
#[derive(Debug, clap::Args)]
pub struct TrajectoryArgs {
    /// The session's id, or `latest` of a map given by --map
    session: String,
    /// The map whose latest session is meant
    #[arg(long, value_name = "MAP")]
    map: Option<String>,
    /// What to write
    #[arg(long, value_enum, default_value_t = Format::Tum)]
    format: Format,
    /// Whose poses: `robot`, or the id of a sensor
    #[arg(long, default_value = "robot")]
    frame: String,
    /// The map version; the published one where nothing is said
    #[arg(long, default_value_t = 0, hide_default_value = true)]
    version: u64,
    /// Where to write it; `-` for standard output
    #[arg(long, short, value_name = "FILE", default_value = "-")]
    output: PathBuf,
    #[command(flatten)]
    server: ServerArgs,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Format {
    /// Lines of `t x y z qx qy qz qw`: seconds, metres
    Tum,
    /// One JSON document, as REST gives it
    Json,
}

/// Asks for the trajectory and writes it.
///
/// # Errors
/// If there is none, or it cannot be written.
pub async fn run(args: TrajectoryArgs) -> anyhow::Result<()> {
    let client = args.server.client()?;
    let session = match (&args.map, args.session.as_str()) {
        (Some(map), "latest") => {
            client
                .latest_session(map)
                .await?
                .with_context(|| format!("map `{map}` has no session"))?
                .id
        }
        (_, session) => session.to_owned(),
    };
    let trajectory = client.trajectory(&session, args.version, &args.frame).await?;
    let v1::Trajectory { map, map_version, reference_frame, frame, poses, .. } = &trajectory;
    eprintln!(
        "{} poses of {frame} in the frame of the {reference_frame}, map {map} version {map_version}",
        poses.len(),
    );
    let text = match args.format {
        Format::Tum => tum::lines(poses),
        Format::Json => serde_json::to_string(&rest::Trajectory::new(trajectory, 0))? + "\n",
    };
    save(&args.output, text.as_bytes())
}
