//! What a robot keeps on disk between its runs.
//!
//! ```text
//! lock                          held while a process uses the folder
//! epoch                         the newest epoch, as decimal text
//! runs/{epoch}/open.request     how the run's session is opened: an encoded OpenSessionRequest
//! runs/{epoch}/*.spool          its batches
//! refused/{epoch}/              runs that the service does not take, set aside for people
//! ```

use std::{
    fs::{self, File, TryLockError},
    io::{self, Write},
    path::{Path, PathBuf},
    time::{SystemTime, UNIX_EPOCH},
};

use meetpoint_proto::v1::OpenSessionRequest;
use prost::Message;

/// How a run's session is opened.
const REQUEST_FILE: &str = "open.request";

/// The folder of a robot, locked.
#[derive(Debug)]
pub(super) struct RobotFolder {
    path: PathBuf,
    /// Unlocked when it is closed.
    _lock: File,
}

/// One run: its folder and how its session is opened.
#[derive(Clone, Debug)]
pub(super) struct KeptRun {
    /// The run's folder, which is its spool's too.
    pub(super) path: PathBuf,
    /// How to open its session, always with the same words.
    pub(super) request: OpenSessionRequest,
}

impl RobotFolder {
    /// Opens the folder and makes it if it is missing.
    pub(super) fn open(path: &Path) -> io::Result<Self> {
        fs::create_dir_all(path.join("runs"))?;
        let lock = File::create(path.join("lock"))?;
        match lock.try_lock() {
            Ok(()) => Ok(Self { path: path.to_owned(), _lock: lock }),
            Err(TryLockError::WouldBlock) => Err(io::Error::new(
                io::ErrorKind::ResourceBusy,
                format!("another process uses {}", path.display()),
            )),
            Err(TryLockError::Error(error)) => Err(error),
        }
    }

    /// The epoch of a new run: one more than the last. In a new folder the seconds since 1970,
    /// so that a robot whose disk was replaced is not taken for its own past.
    pub(super) fn raise_epoch(&self) -> io::Result<u64> {
        let path = self.path.join("epoch");
        let epoch = match fs::read_to_string(&path) {
            Ok(text) => text.trim().parse::<u64>().map_err(io::Error::other)? + 1,
            Err(error) if error.kind() == io::ErrorKind::NotFound => seconds_since_1970().max(1),
            Err(error) => return Err(error),
        };
        write_durably(&path, epoch.to_string().as_bytes())?;
        Ok(epoch)
    }

    /// Keeps how a new run is opened.
    pub(super) fn begin_run(&self, request: OpenSessionRequest) -> io::Result<KeptRun> {
        let path = self.path.join("runs").join(format!("{:020}", request.epoch));
        fs::create_dir_all(&path)?;
        write_durably(&path.join(REQUEST_FILE), &request.encode_to_vec())?;
        Ok(KeptRun { path, request })
    }

    /// The runs that were not delivered to their end, oldest first. One that crashed before it
    /// was begun properly holds no batches and is removed.
    pub(super) fn unfinished_runs(&self) -> io::Result<Vec<KeptRun>> {
        let mut runs = Vec::new();
        for entry in fs::read_dir(self.path.join("runs"))? {
            let path = entry?.path();
            let request = fs::read(path.join(REQUEST_FILE)).ok();
            match request.and_then(|bytes| OpenSessionRequest::decode(&bytes[..]).ok()) {
                Some(request) => runs.push(KeptRun { path, request }),
                None => fs::remove_dir_all(path)?,
            }
        }
        runs.sort_by_key(|run| run.request.epoch);
        Ok(runs)
    }

    /// Sets a run aside that the service does not take.
    pub(super) fn set_aside(&self, run: &KeptRun) -> io::Result<PathBuf> {
        let refused = self.path.join("refused");
        fs::create_dir_all(&refused)?;
        let target = refused.join(format!("{:020}", run.request.epoch));
        fs::rename(&run.path, &target)?;
        Ok(target)
    }
}

impl KeptRun {
    /// Removes all of a run that was delivered.
    pub(super) fn remove(&self) -> io::Result<()> {
        fs::remove_dir_all(&self.path)
    }
}

fn seconds_since_1970() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs())
}

/// Writes a file so that after a crash it has its old content or its new one.
fn write_durably(path: &Path, content: &[u8]) -> io::Result<()> {
    let new = path.with_extension("new");
    let mut file = File::create(&new)?;
    file.write_all(content)?;
    file.sync_all()?;
    fs::rename(&new, path)?;
    path.parent().map_or(Ok(()), |folder| File::open(folder)?.sync_all())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn epochs_rise_and_runs_are_found_again() {
        let folder = tempfile::tempdir().expect("a folder");
        let robot = RobotFolder::open(folder.path()).expect("an empty folder");
        assert!(RobotFolder::open(folder.path()).is_err(), "one process at a time");
        let first = robot.raise_epoch().expect("a free disk");
        let request = OpenSessionRequest { epoch: first, ..OpenSessionRequest::default() };
        robot.begin_run(request.clone()).expect("a free disk");
        fs::create_dir(folder.path().join("runs/half-begun")).expect("a free disk");
        drop(robot);
        let robot = RobotFolder::open(folder.path()).expect("unlocked");
        assert_eq!(robot.raise_epoch().expect("a free disk"), first + 1, "one more");
        let runs = robot.unfinished_runs().expect("readable");
        assert_eq!(runs.len(), 1, "the half-begun one held nothing");
        assert_eq!(runs[0].request, request, "as it was");
        let aside = robot.set_aside(&runs[0]).expect("a free disk");
        assert!(aside.join(REQUEST_FILE).exists(), "kept for people");
        assert!(robot.unfinished_runs().expect("readable").is_empty(), "and out of the way");
    }
}
