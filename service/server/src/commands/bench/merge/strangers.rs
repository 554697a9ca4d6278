//! Two buildings: whatever a robot saw in the one, it must not be merged into the map of the other.

use std::path::{Path, PathBuf};

use meetpoint_client::Client;

use super::super::child::ChildService;
use super::super::replaying::{replayed, session_of};
use super::settled::{is_accepted, merge_of, settle, verdict};

/// The map of each pair.
const MAP: &str = "bench";

/// Prints a row for every pair.
pub(super) async fn print(files: &[PathBuf], data: &Path) -> anyhow::Result<()> {
    println!("| site | stranger | verdict | accepted | why |");
    println!("|---|---|---|---|---|");
    let mut n_wrong = 0;
    for pair in files.chunks_exact(2) {
        let service = ChildService::start(data, "strangers")?;
        let client = Client::connect(&service.url)?;
        replayed(&pair[0], MAP, &["--robot", "first"], &service.url)?;
        let options = ["--robot", "second", "--start", "unknown"];
        let stranger = replayed(&pair[1], MAP, &options, &service.url)?;
        settle(&client, MAP).await?;
        let merge = merge_of(&client, MAP, session_of(&stranger)?).await?;
        let names = pair.iter().map(|path| path.file_name().unwrap_or_default().to_string_lossy());
        let names: Vec<_> = names.collect();
        let accepted = if is_accepted(&merge) { "yes" } else { "no" };
        let why = merge.reasons.join("; ");
        println!("| {} | {} | {} | {accepted} | {why} |", names[0], names[1], verdict(&merge));
        n_wrong += u32::from(is_accepted(&merge));
    }
    anyhow::ensure!(n_wrong == 0, "{n_wrong} merged wrongly");
    Ok(())
}
