//! Recorded buildings: a grid, and where a robot drove in it.

use std::path::Path;

use anyhow::Context;
use meetpoint_client::Client;
use meetpoint_geometry::Pose;
use meetpoint_occupancy::{ImportParams, imported, read_picture, read_yaml};
use meetpoint_proto::v1;

use crate::commands::{import, map::raster};
use crate::convert::tum;
use crate::training::Ground;

/// Pixels of an image, at most: 400 by 400 m at 0.05 m.
const N_PIXELS_MAX: u64 = 1 << 26;

/// A `map_server` map, and the trajectory of a file.
pub(super) fn files(path: &Path, trajectory: Option<&Path>) -> anyhow::Result<(Ground, String)> {
    let place = || format!("the grid {}", path.display());
    let (yaml, image) = import::files(path)?;
    let yaml = read_yaml(&yaml).with_context(place)?;
    let picture = read_picture(&image, N_PIXELS_MAX).with_context(place)?;
    let raster = imported(&picture, &yaml, &ImportParams::MAP_SERVER).with_context(place)?.raster;
    let mut told = place();
    let mut poses = Vec::new();
    if let Some(path) = trajectory {
        let place = || format!("the trajectory {}", path.display());
        let text = std::fs::read_to_string(path).with_context(place)?;
        poses = tum::poses(&text).with_context(place)?;
        anyhow::ensure!(!poses.is_empty(), "{} has no poses", place());
        told = format!("{told} along {}", place());
    }
    Ok((Ground::recorded(&raster, &poses).with_context(place)?, told))
}

/// A version of a map, and the trajectory of a session on it.
pub(super) async fn map(
    client: &Client,
    map: &str,
    version: u64,
    session: Option<&str>,
) -> anyhow::Result<(Ground, String)> {
    let version = match version {
        0 => client.map(map).await?.latest_version,
        asked => asked,
    };
    anyhow::ensure!(version != 0, "map {map} has no version yet");
    let session = match session {
        Some(session) => session.to_owned(),
        None => {
            client
                .latest_session(map)
                .await?
                .with_context(|| {
                    format!("nobody has driven on map {map}; give --grid without a trajectory")
                })?
                .id
        }
    };
    let grid = client.grid(map, version).await?;
    let trajectory = client.trajectory(&session, version, "robot").await?;
    anyhow::ensure!(
        trajectory.reference_frame == "map",
        "session {session} is not placed in the map in version {version}"
    );
    let is_trusted = |pose: &&v1::TrajectoryPose| !pose.lost;
    let poses = trajectory.poses.iter().filter(is_trusted).filter_map(|stamped| {
        let v1::Pose { x_m, y_m, theta_rad } = stamped.pose?;
        Some(Pose::new(x_m, y_m, theta_rad))
    });
    let poses: Vec<Pose> = poses.collect();
    anyhow::ensure!(!poses.is_empty(), "session {session} has no poses in version {version}");
    let told = format!("version {version} of map {map} along session {session}");
    Ok((Ground::recorded(&raster(grid)?, &poses).with_context(|| told.clone())?, told))
}
