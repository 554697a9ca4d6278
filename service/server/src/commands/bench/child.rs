//! A service in a process of its own, with an empty database, for measuring.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use anyhow::Context;

/// A running service. It is killed and its folder removed when this is dropped.
pub(super) struct ChildService {
    /// Where it listens.
    pub(super) url: String,
    process: Child,
    data: PathBuf,
}

impl ChildService {
    /// Starts this very binary on a free port, with its data in a new folder below `parent`.
    pub(super) fn start(parent: &Path, name: &str) -> anyhow::Result<Self> {
        Self::start_with(parent, name, &[])
    }

    /// The same with settings by their environment variables.
    pub(super) fn start_with(
        parent: &Path,
        name: &str,
        settings: &[(&str, &str)],
    ) -> anyhow::Result<Self> {
        let data = parent.join(format!("meetpoint-bench-{}-{name}", std::process::id()));
        let binary = std::env::current_exe().context("cannot find this binary")?;
        let mut process = Command::new(binary)
            .args(["serve", "--port", "0", "--data"])
            .arg(&data)
            .env("RUST_LOG", "warn")
            .envs(settings.iter().copied())
            .stdout(Stdio::piped())
            .spawn()
            .context("cannot start the service")?;
        let stdout = process.stdout.take().context("the service has no output")?;
        let mut line = String::new();
        BufReader::new(stdout).read_line(&mut line)?;
        let url = line
            .split_whitespace()
            .find(|word| word.starts_with("http://"))
            .with_context(|| format!("the service did not start: `{}`", line.trim()))?;
        Ok(Self { url: url.to_owned(), process, data })
    }

    /// Seconds of processor time that it took so far, where the system tells.
    pub(super) fn cpu_s(&self) -> Option<f64> {
        let [own, _] = cpu_s(&self.process.id().to_string())?;
        Some(own)
    }

    /// Most memory that it held so far, in megabytes, where the system tells.
    pub(super) fn peak_memory_mb(&self) -> Option<f64> {
        peak_memory_mb(self.process.id())
    }
}

/// Ticks of the kernel's clock of processor time in a second: 100 on every Linux there is today.
const TICKS_PER_S: f64 = 100.0;

/// Seconds of processor time that children of this process took which have ended, where the system
/// tells.
pub(super) fn cpu_s_of_children() -> Option<f64> {
    let [_, of_children] = cpu_s("self")?;
    Some(of_children)
}

/// Seconds of processor time of a process, and of its children that have ended.
fn cpu_s(process: &str) -> Option<[f64; 2]> {
    let status = std::fs::read_to_string(format!("/proc/{process}/stat")).ok()?;
    // The name, which may hold anything, stands in brackets; proc(5) counts fields from 1.
    let fields: Vec<&str> = status.rsplit_once(')')?.1.split_whitespace().collect();
    let ticks = |number: usize| fields.get(number - 3)?.parse::<f64>().ok();
    let (own, of_children) = (ticks(14)? + ticks(15)?, ticks(16)? + ticks(17)?);
    Some([own / TICKS_PER_S, of_children / TICKS_PER_S])
}

/// Most memory that a process held so far, in megabytes, where the system tells.
pub(super) fn peak_memory_mb(process: u32) -> Option<f64> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    let kilobytes: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kilobytes / 1000.0)
}

impl Drop for ChildService {
    fn drop(&mut self) {
        // It may have ended by itself; a folder that stays behind is in the way of nobody.
        let _ = self.process.kill();
        let _ = self.process.wait();
        let _ = std::fs::remove_dir_all(&self.data);
    }
}
