//! `meetpoint map import`: a map that was made elsewhere becomes a map version.

use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::Context;
use meetpoint_client::Client;
use meetpoint_occupancy::read_yaml;
use meetpoint_proto::v1;

use super::asked::ServerArgs;
use crate::rest::MapImport;

/// How often a version that is not made yet is asked for.
const POLL: Duration = Duration::from_millis(300);
/// Characters of a map's id.
const ID_LEN_MAX: usize = 63;

/// Options of `meetpoint map import`.
#[derive(Debug, clap::Args)]
pub struct ImportArgs {
    /// The map's YAML, as `map_server` reads it; its image is found beside it
    #[arg(value_name = "FILE.yaml")]
    file: PathBuf,
    /// The map to import into, made if there is none of that name; by default the file's name
    #[arg(long, value_name = "NAME")]
    map: Option<String>,
    #[command(flatten)]
    server: ServerArgs,
}

/// Sends the files and waits for the version.
///
/// # Errors
/// If a file cannot be read, or the service refuses them.
pub(super) async fn run(args: &ImportArgs) -> anyhow::Result<()> {
    let (yaml, image) = files(&args.file)?;
    let map = args.map.clone().unwrap_or_else(|| id_of(&args.file));
    let client = args.server.client()?;
    let mut reply = client.import_map(&map, &yaml, &image).await?;
    while reply.map_version == 0 {
        tokio::time::sleep(POLL).await;
        reply.map_version = version_with(&client, &map, reply.journal_position).await?;
    }
    if args.server.json {
        println!("{}", serde_json::to_string(&MapImport::new(reply)?)?);
    } else {
        report(&map, &reply);
    }
    Ok(())
}

/// The text of a YAML and the bytes of the image that it names.
pub(super) fn files(path: &Path) -> anyhow::Result<(String, Vec<u8>)> {
    let yaml =
        std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    let named = read_yaml(&yaml).with_context(|| format!("in {}", path.display()))?.image;
    let image_path = path.parent().unwrap_or(Path::new("")).join(named);
    let image = std::fs::read(&image_path)
        .with_context(|| format!("cannot read the image {}", image_path.display()))?;
    Ok((yaml, image))
}

/// An id of the file's name: small letters, digits, `-` and `_`.
fn id_of(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().to_lowercase();
    let allowed = |c: char| if c.is_ascii_alphanumeric() || c == '_' { c } else { '-' };
    let id: String = stem.chars().map(allowed).collect();
    let id: String = id.trim_start_matches(['-', '_']).chars().take(ID_LEN_MAX).collect();
    if id.is_empty() { "map".to_owned() } else { id }
}

/// The newest version, once it tells what stands at a place of the journal; 0 before.
async fn version_with(client: &Client, map: &str, position: u64) -> anyhow::Result<u64> {
    let latest = client.map(map).await?.latest_version;
    if latest == 0 {
        return Ok(0);
    }
    let version = client.map_version(map, latest).await?;
    Ok(if position <= version.journal_position { latest } else { 0 })
}

fn report(map: &str, reply: &v1::ImportMapResponse) {
    for warning in &reply.warnings {
        eprintln!("warning: {warning}");
    }
    let version = reply.map_version;
    if reply.already_imported {
        println!("map {map} has these files already, as version {version}");
        return;
    }
    let resolution_m = reply.map.as_ref().map_or(0.0, |map| map.resolution_m);
    let cells = reply.cells.unwrap_or_default();
    let v1::Point { x_m, y_m } = cells.origin.unwrap_or_default();
    println!(
        "map {map}, version {version}: {} x {} cells of {resolution_m} m from ({x_m:.3}, {y_m:.3}) m \
         on, {} free, {} occupied, {} unknown",
        cells.width, cells.height, cells.free, cells.occupied, cells.unknown
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_of_files() {
        for (file, id) in [
            ("maps/willow-2010-02-18-0.10.yaml", "willow-2010-02-18-0-10"),
            ("Depot.yaml", "depot"),
            ("_x y.yaml", "x-y"),
            ("---.yaml", "map"),
        ] {
            assert_eq!(id_of(Path::new(file)), id, "{file}");
        }
    }
}
