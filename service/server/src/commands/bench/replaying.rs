//! Recordings replayed with this very binary, in a process of its own, as a user would.

use std::path::Path;
use std::process::{Command, Stdio};

use anyhow::Context;

/// Replays a recording onto a map; what the replay tells of itself.
pub(super) fn replayed(
    recording: &Path,
    map: &str,
    options: &[&str],
    url: &str,
) -> anyhow::Result<serde_json::Value> {
    let binary = std::env::current_exe().context("cannot find this binary")?;
    let output = Command::new(binary)
        .arg("replay")
        .arg(recording)
        .args(["--map", map, "--json", "--server", url])
        .args(options)
        .stderr(Stdio::inherit())
        .output()
        .context("cannot start the replay")?;
    anyhow::ensure!(output.status.success(), "the replay of {} failed", recording.display());
    serde_json::from_slice(&output.stdout).context("the replay printed no JSON")
}

/// A field of what a replay tells.
pub(super) fn told<'a>(
    replayed: &'a serde_json::Value,
    name: &str,
) -> anyhow::Result<&'a serde_json::Value> {
    replayed.get(name).with_context(|| format!("replay told no {name}"))
}

/// The session of a replay.
pub(super) fn session_of(replayed: &serde_json::Value) -> anyhow::Result<&str> {
    told(replayed, "session")?.as_str().context("a session id is text")
}
