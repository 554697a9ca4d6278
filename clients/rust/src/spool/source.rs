//! A spool as seen from its two ends: a robot that appends, a delivery that reads.

use std::{
    io,
    sync::{Arc, Mutex, PoisonError},
};

use meetpoint_proto::v1::Observation;
use tokio::{sync::watch, task::spawn_blocking};

use super::{Spool, Spooled};
use crate::source::{BatchSource, Outgoing};

/// Why numbers are missing, as the service is told.
const LOST_REASON: &str = "dropped by a full or damaged spool on the robot";

/// The end of a spool that a robot writes to. When it is dropped, the session ends with what is
/// in the spool.
#[derive(Debug)]
pub struct SpoolWriter {
    spool: Arc<Mutex<Spool>>,
    next_number: watch::Sender<u64>,
}

/// The end of a spool that a delivery reads from.
#[derive(Debug)]
pub struct SpoolSource {
    spool: Arc<Mutex<Spool>>,
    next_number: watch::Receiver<u64>,
}

/// Parts a spool into its ends.
pub fn spool_channel(spool: Spool) -> (SpoolWriter, SpoolSource) {
    let (sender, receiver) = watch::channel(spool.next_number());
    let spool = Arc::new(Mutex::new(spool));
    let writer = SpoolWriter { spool: Arc::clone(&spool), next_number: sender };
    (writer, SpoolSource { spool, next_number: receiver })
}

/// Does something to the spool on a thread that may wait for the disk.
async fn with<T: Send + 'static>(
    spool: &Arc<Mutex<Spool>>,
    work: impl FnOnce(&mut Spool) -> io::Result<T> + Send + 'static,
) -> io::Result<T> {
    let spool = Arc::clone(spool);
    // A panic half way leaves at worst a record that is not in the index, never a wrong one.
    let locked = move || work(&mut spool.lock().unwrap_or_else(PoisonError::into_inner));
    spawn_blocking(locked).await.map_err(io::Error::other)?
}

impl SpoolWriter {
    /// Appends a batch and gives its number.
    ///
    /// # Errors
    ///
    /// If the disk does not take it.
    pub async fn append(&self, observations: Vec<Observation>) -> io::Result<u64> {
        let number = with(&self.spool, move |spool| spool.append(observations)).await?;
        self.next_number.send_modify(|next| *next = (*next).max(number + 1));
        Ok(number)
    }

    /// Waits until all batches are on the disk.
    ///
    /// # Errors
    ///
    /// If the disk does not say so.
    pub async fn sync(&self) -> io::Result<()> {
        with(&self.spool, Spool::sync).await
    }

    /// Batches that were dropped or found damaged since the opening.
    ///
    /// # Errors
    ///
    /// If the spool cannot be asked.
    pub async fn n_dropped(&self) -> io::Result<u64> {
        with(&self.spool, |spool| Ok(spool.n_dropped())).await
    }
}

impl BatchSource for SpoolSource {
    async fn get(&mut self, number: u64) -> io::Result<Outgoing> {
        loop {
            // An error means that the writer is gone; what is there is all there will be.
            let written = self.next_number.wait_for(|&next| number < next).await.is_ok();
            let spooled = with(&self.spool, move |spool| spool.get(number)).await?;
            match spooled {
                Spooled::Batch(batch) => return Ok(Outgoing::Batch(batch)),
                Spooled::Lost { through } => {
                    return Ok(Outgoing::Skip { through, reason: LOST_REASON.to_owned() });
                }
                Spooled::NotYet if written => {}
                Spooled::NotYet => return Ok(Outgoing::End),
            }
        }
    }

    async fn forget_through(&mut self, number: u64) -> io::Result<()> {
        with(&self.spool, move |spool| spool.forget_through(number)).await
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spool::SpoolParams;

    #[tokio::test]
    async fn a_reader_waits_for_the_writer_and_ends_with_it() {
        let folder = tempfile::tempdir().expect("a folder");
        let spool = Spool::open(folder.path(), SpoolParams::ROBOT).expect("an empty folder");
        let (writer, mut source) = spool_channel(spool);
        let reading = tokio::spawn(async move {
            let first = source.get(1).await.expect("readable");
            (first, source.get(2).await.expect("readable"))
        });
        tokio::task::yield_now().await;
        assert_eq!(writer.append(Vec::new()).await.expect("a free disk"), 1, "the first number");
        drop(writer);
        let (first, second) = reading.await.expect("no panic");
        assert!(matches!(first, Outgoing::Batch(batch) if batch.number == 1), "what was written");
        assert_eq!(second, Outgoing::End, "the writer is gone");
    }
}
