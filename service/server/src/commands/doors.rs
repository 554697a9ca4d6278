//! `meetpoint doors`: places whose occupancy keeps changing.

use meetpoint_proto::v1;

use super::asked::ServerArgs;
use crate::rest::DoorList;

/// Options of `meetpoint doors`.
#[derive(Debug, clap::Args)]
pub struct DoorsArgs {
    /// The map
    map: String,
    /// The version that is asked about; the published one where nothing is said
    #[arg(long, default_value_t = 0, hide_default_value = true)]
    version: u64,
    /// Doors shown: those that changed most often, at most 1000
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=1000))]
    limit: u32,
    #[command(flatten)]
    server: ServerArgs,
}

/// Prints the doors.
///
/// # Errors
/// If there is no such map or version.
pub async fn run(args: DoorsArgs) -> anyhow::Result<()> {
    let DoorsArgs { map, version, limit, server } = args;
    let page_token = String::new();
    let request = v1::ListDoorsRequest { map: map.clone(), version, page_size: limit, page_token };
    let found = server.client()?.doors(request).await?;
    if server.json {
        println!("{}", serde_json::to_string(&DoorList::from(found))?);
        return Ok(());
    }
    for door in &found.doors {
        println!("{}", line(door));
    }
    println!(
        "map {map}, version {}: {} doors{}",
        found.map_version,
        found.doors.len(),
        if found.next_page_token.is_empty() { "" } else { "; more than are shown" },
    );
    Ok(())
}

/// A door in a line.
fn line(door: &v1::Door) -> String {
    let state = match door.state() {
        v1::DoorState::Open => "open",
        v1::DoorState::Closed => "closed",
        v1::DoorState::Unspecified => "of unknown state",
    };
    let v1::Point { x_m, y_m } = door.position.unwrap_or_default();
    format!(
        "door {} at ({x_m:.2}, {y_m:.2}) m is {state}, changed {} times, closed in {:.0} % of looks",
        door.id,
        door.changes,
        100.0 * door.closed_share
    )
}
