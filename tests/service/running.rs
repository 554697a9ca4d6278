//! The binary `meetpoint`, started for real.

use std::fmt::Display;
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};

use meetpoint_client::Client;
use tempfile::{NamedTempFile, TempDir};
use tonic::transport::{Channel, Endpoint};

use crate::grpc_door::GrpcDoor;
use crate::http::Http;
use crate::rest_door::RestDoor;

/// The binary under test.
const MEETPOINT: &str = env!("CARGO_BIN_EXE_meetpoint");

/// An empty folder for a service's data.
pub(crate) fn empty_folder() -> TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

/// A command of the binary, without settings inherited from whoever runs the tests.
pub(crate) fn meetpoint(arguments: &[&str]) -> Command {
    let mut command = Command::new(MEETPOINT);
    for (name, _) in std::env::vars().filter(|(name, _)| name.starts_with("MEETPOINT_")) {
        command.env_remove(name);
    }
    command.args(arguments).stdin(Stdio::null());
    command
}

/// How a service is to be started.
#[derive(Clone, Debug)]
pub(crate) struct Launch {
    data: PathBuf,
    port: u16,
    settings: Vec<(String, String)>,
}

impl Launch {
    /// On a free port with its data in `data`.
    pub(crate) fn at(data: &Path) -> Self {
        Self { data: data.to_owned(), port: 0, settings: Vec::new() }
    }

    /// On this port.
    pub(crate) fn port(mut self, port: u16) -> Self {
        self.port = port;
        self
    }

    /// With a setting of its own, as in `("journal.busy_timeout_ms", 100)`.
    pub(crate) fn setting(mut self, key: &str, value: impl Display) -> Self {
        let name = format!("MEETPOINT_{}", key.replace('.', "__").to_uppercase());
        self.settings.push((name, value.to_string()));
        self
    }

    fn spawn(&self) -> (Child, NamedTempFile) {
        let log = NamedTempFile::new().expect("a temporary file");
        let mut command = meetpoint(&["serve", "--port", &self.port.to_string(), "--data"]);
        let child = command
            .arg(&self.data)
            .envs(self.settings.iter().cloned())
            .stdout(Stdio::piped())
            .stderr(log.reopen().expect("the file was made just now"))
            .spawn()
            .expect("the binary under test starts");
        (child, log)
    }

    /// Starts the service and waits until it listens, or has ended: how, and what it wrote to
    /// standard error.
    fn attempt(&self) -> Result<Running, (ExitStatus, String)> {
        let (mut child, log) = self.spawn();
        let mut lines = BufReader::new(child.stdout.take().expect("it was piped"));
        let mut line = String::new();
        lines.read_line(&mut line).expect("the service writes text");
        match line.split_whitespace().find_map(|word| word.strip_prefix("http://")) {
            Some(address) => {
                let address = address.to_owned();
                Ok(Running { child, address, log, _stdout: lines })
            }
            None => Err((child.wait().expect("it was started"), read(log.path()))),
        }
    }

    /// Starts the service and waits until it listens.
    pub(crate) fn start(&self) -> Running {
        self.attempt().unwrap_or_else(|(status, told)| panic!("ended by {status}: {told}"))
    }

    /// Starts a service that is to refuse: how it ended, and what it wrote to standard error.
    pub(crate) fn refused(&self) -> (ExitStatus, String) {
        match self.attempt() {
            Ok(running) => panic!("it listens at {}", running.url()),
            Err(refusal) => refusal,
        }
    }

    /// Starts a service that may refuse, of which `refusal` is told.
    pub(crate) fn started_or_refused(
        &self,
        refusal: impl FnOnce(ExitStatus, &str),
    ) -> Option<Running> {
        self.attempt().map_err(|(status, told)| refusal(status, &told)).ok()
    }
}

fn read(path: &Path) -> String {
    let mut text = String::new();
    let read = File::open(path).and_then(|mut file| file.read_to_string(&mut text));
    read.map_or_else(|error| format!("its log cannot be read: {error}"), |_| text)
}

/// A service that listens. Killed when dropped.
pub(crate) struct Running {
    child: Child,
    address: String,
    log: NamedTempFile,
    /// Open, so that the service never writes into a closed pipe.
    _stdout: BufReader<std::process::ChildStdout>,
}

impl Running {
    /// As in `http://127.0.0.1:41234`.
    pub(crate) fn url(&self) -> String {
        format!("http://{}", self.address)
    }

    pub(crate) fn port(&self) -> u16 {
        let port = self.address.rsplit(':').next().and_then(|port| port.parse().ok());
        port.expect("an address ends with its port")
    }

    /// What a robot would use.
    pub(crate) fn client(&self) -> Client {
        Client::connect(&self.url()).expect("the address of a service")
    }

    /// A connection for stubs, made at the first call.
    pub(crate) fn channel(&self) -> Channel {
        Endpoint::from_shared(self.url()).expect("the address of a service").connect_lazy()
    }

    pub(crate) fn grpc(&self) -> GrpcDoor {
        GrpcDoor::new(self.channel())
    }

    pub(crate) fn rest(&self) -> RestDoor {
        RestDoor::new(self.http())
    }

    pub(crate) fn http(&self) -> Http {
        Http::new(self.url())
    }

    /// What it logged so far.
    pub(crate) fn log(&self) -> String {
        read(self.log.path())
    }

    /// Memory that the process holds, in bytes; `None` where the system does not tell by `/proc`.
    pub(crate) fn resident_bytes(&self) -> Option<u64> {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.child.id())).ok()?;
        let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
        let kilobytes: u64 = line.split_whitespace().next()?.parse().ok()?;
        Some(kilobytes * 1024)
    }

    /// SIGKILL: no chance to tidy up.
    pub(crate) fn kill(mut self) {
        self.child.kill().expect("it can be killed");
        self.child.wait().expect("it was started");
    }

    /// SIGTERM, and waits for the orderly end.
    pub(crate) fn stop(mut self) {
        signal(&self.child, "TERM");
        let status = self.child.wait().expect("it was started");
        assert!(status.success(), "an orderly end is {status}: {}", self.log());
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // It may have ended before.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Sends a signal by the shell's own `kill`, which every Unix has.
pub(crate) fn signal(child: &Child, name: &str) {
    let kill = format!("kill -{name} {}", child.id());
    let done = Command::new("sh").args(["-c", &kill]).status().expect("a shell");
    assert!(done.success(), "{kill} is {done}");
}
