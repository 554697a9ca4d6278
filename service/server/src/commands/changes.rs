//! `meetpoint changes`: what became of cells since a version.

use meetpoint_proto::v1;

use super::asked::ServerArgs;
use crate::rest::ChangeList;

/// Options of `meetpoint changes`.
#[derive(Debug, clap::Args)]
pub struct ChangesArgs {
    /// The map
    map: String,
    /// The version that is compared with, from 1 on
    #[arg(long, value_name = "VERSION", value_parser = clap::value_parser!(u64).range(1..))]
    since: u64,
    /// The version that is asked about; the published one where nothing is said
    #[arg(long, default_value_t = 0, hide_default_value = true)]
    version: u64,
    /// Only changes of at least so many cells
    #[arg(long, value_name = "CELLS", default_value_t = 0, hide_default_value = true)]
    cells_min: u32,
    /// Changes shown: those of most cells, at most 1000
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=1000))]
    limit: u32,
    #[command(flatten)]
    server: ServerArgs,
}

/// Prints the changes.
///
/// # Errors
/// If there is no such map or version, or too much differs.
pub async fn run(args: ChangesArgs) -> anyhow::Result<()> {
    let ChangesArgs { map, since, version, cells_min, limit, server } = args;
    let request = v1::ListChangesRequest {
        map: map.clone(),
        since,
        version,
        cells_min,
        page_size: limit,
        ..v1::ListChangesRequest::default()
    };
    let found = server.client()?.changes(request).await?;
    if server.json {
        println!("{}", serde_json::to_string(&ChangeList::from(found))?);
        return Ok(());
    }
    for change in &found.changes {
        println!("{}", line(change));
    }
    println!(
        "map {map}, from version {} to {}: {} cells are occupied that were free, {} are free that were occupied{}",
        found.since,
        found.map_version,
        found.cells_appeared,
        found.cells_vanished,
        if found.next_page_token.is_empty() { "" } else { "; more changes than are shown" },
    );
    Ok(())
}

/// A change in a line.
fn line(change: &v1::Change) -> String {
    let kind = match v1::ChangeKind::try_from(change.kind).unwrap_or_default() {
        v1::ChangeKind::Appeared => "occupied now",
        v1::ChangeKind::Vanished => "free now",
        v1::ChangeKind::Unspecified => "changed",
    };
    let v1::BoundingBox { min_x_m, min_y_m, max_x_m, max_y_m } =
        change.bounding_box.unwrap_or_default();
    format!(
        "{kind}: {} cells within ({min_x_m:.2}, {min_y_m:.2}) to ({max_x_m:.2}, {max_y_m:.2}) m",
        change.cells
    )
}
