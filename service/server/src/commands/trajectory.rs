//! `meetpoint trajectory`: where a robot was.

use std::fmt::Write;
use std::path::PathBuf;

use anyhow::Context;
use meetpoint_proto::v1;

use super::asked::{ServerArgs, save};

/// Nanoseconds in a second.
const NS_PER_S: i64 = 1_000_000_000;

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
    /// One JSON document
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
    let text = match args.format {
        Format::Tum => tum(&trajectory),
        Format::Json => json(&trajectory),
    };
    save(&args.output, text.as_bytes())?;
    eprintln!(
        "{} poses of {} in the frame of the {}, map {} version {}",
        trajectory.poses.len(),
        trajectory.frame,
        trajectory.reference_frame,
        trajectory.map,
        trajectory.map_version,
    );
    Ok(())
}

/// TUM's format: `t x y z qx qy qz qw`, the time in seconds with all nine decimals.
pub(crate) fn tum(trajectory: &v1::Trajectory) -> String {
    let mut text = String::new();
    for v1::TrajectoryPose { stamp_ns, sensor_id: _, pose, lost: _ } in &trajectory.poses {
        let v1::Pose { x_m, y_m, theta_rad } = pose.unwrap_or_default();
        let (sin, cos) = (0.5 * theta_rad).sin_cos();
        let (seconds, rest_ns) = (stamp_ns.div_euclid(NS_PER_S), stamp_ns.rem_euclid(NS_PER_S));
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{seconds}.{rest_ns:09} {x_m} {y_m} 0 0 0 {sin} {cos}");
    }
    text
}

fn json(trajectory: &v1::Trajectory) -> String {
    let pose = |v1::TrajectoryPose { stamp_ns, sensor_id, pose, lost }: &v1::TrajectoryPose| {
        let v1::Pose { x_m, y_m, theta_rad } = pose.unwrap_or_default();
        let stamp_ns = stamp_ns.to_string();
        serde_json::json!({
            "stamp_ns": stamp_ns, "sensor_id": sensor_id,
            "x_m": x_m, "y_m": y_m, "theta_rad": theta_rad, "lost": lost,
        })
    };
    let poses: Vec<_> = trajectory.poses.iter().map(pose).collect();
    let document = serde_json::json!({
        "session": trajectory.session,
        "map": trajectory.map,
        "map_version": trajectory.map_version,
        "reference_frame": trajectory.reference_frame,
        "frame": trajectory.frame,
        "poses": poses,
    });
    format!("{document}\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tum_keeps_every_nanosecond() {
        let pose = v1::TrajectoryPose {
            stamp_ns: 976_052_857_337_530_001,
            sensor_id: "laser".into(),
            pose: Some(v1::Pose { x_m: 1.5, y_m: -2.0, theta_rad: 0.0 }),
            lost: false,
        };
        let trajectory = v1::Trajectory { poses: vec![pose], ..v1::Trajectory::default() };
        assert_eq!(tum(&trajectory), "976052857.337530001 1.5 -2 0 0 0 0 1\n", "exact");
    }
}
