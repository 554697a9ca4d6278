//! Which service a command asks.

use std::path::Path;

use anyhow::Context;
use meetpoint_client::Client;

/// Options of every command that asks a service.
#[derive(Clone, Debug, clap::Args)]
pub struct ServerArgs {
    /// The service to ask
    #[arg(
        long,
        value_name = "URL",
        env = "MEETPOINT_URL",
        default_value = "http://127.0.0.1:7373"
    )]
    pub server: String,
    /// Print JSON, for machines
    #[arg(long)]
    pub json: bool,
}

impl ServerArgs {
    /// A client of that service. It connects when it is first used.
    ///
    /// # Errors
    /// If the address is none.
    pub fn client(&self) -> anyhow::Result<Client> {
        Client::connect(&self.server)
            .with_context(|| format!("`{}` is not the address of a service", self.server))
    }
}

/// Writes a result to a file, or to standard output for `-`.
pub(super) fn save(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    if path == Path::new("-") {
        use std::io::Write;
        std::io::stdout().write_all(bytes).context("cannot write to standard output")
    } else {
        std::fs::write(path, bytes).with_context(|| format!("cannot write {}", path.display()))
    }
}
