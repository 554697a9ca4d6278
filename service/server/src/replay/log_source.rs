//! A recording as a source of batches: read on a thread of its own, paced if asked for.

use std::{
    collections::VecDeque,
    io,
    sync::{Arc, Mutex, PoisonError},
    thread::{self, JoinHandle},
    time::Duration,
};

use meetpoint_client::{BatchSource, Outgoing};
use tokio::{
    sync::mpsc,
    time::{Instant, sleep_until},
};

use super::{content::Content, cutter::CutBatch, section::Section};

/// Batches read ahead: enough that neither the file nor the network waits for the other.
const READ_AHEAD: usize = 32;

/// What to read, and how fast to give it away.
pub(crate) struct LogReading {
    /// The recording.
    pub(crate) content: Content,
    /// The part to give.
    pub(crate) section: Section,
    /// Times real time; `None` for as fast as it goes.
    pub(crate) rate: Option<f64>,
}

/// Readings (scans, or sightings) in the batches that were read so far. Clones share the count.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tally(Arc<Mutex<Vec<u64>>>);

impl Tally {
    /// Readings in the batches up to `number`; in those read so far, if that is less.
    pub(crate) fn readings_through(&self, number: u64) -> u64 {
        let sums = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let n = usize::try_from(number).unwrap_or(usize::MAX).min(sums.len());
        n.checked_sub(1).map_or(0, |last| sums[last])
    }

    fn add(&self, n_readings: u64) {
        let mut sums = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let sum = sums.last().copied().unwrap_or(0) + n_readings;
        sums.push(sum);
    }
}

/// Gives the batches of a recording, and keeps those that are not acknowledged.
pub(crate) struct LogSource {
    incoming: mpsc::Receiver<io::Result<CutBatch>>,
    /// The thread that reads; `None` once it was seen to end well.
    reader: Option<JoinHandle<()>>,
    /// Consecutive numbers, the first above `forgotten_through` or below what comes next.
    kept: VecDeque<CutBatch>,
    forgotten_through: u64,
    rate: Option<f64>,
    /// When and with which stamp the pacing began.
    began: Option<(Instant, i64)>,
    tally: Tally,
}

impl LogSource {
    /// Starts reading; `tally` learns of every batch that was read.
    pub(crate) fn start(reading: LogReading, tally: Tally) -> Self {
        let (sender, incoming) = mpsc::channel(READ_AHEAD);
        let rate = reading.rate;
        // The thread ends with the file, or at its next batch when the source was dropped.
        let reader = Some(thread::spawn(move || read(&reading, &sender)));
        Self {
            incoming,
            reader,
            kept: VecDeque::new(),
            forgotten_through: 0,
            rate,
            began: None,
            tally,
        }
    }

    fn kept(&self, number: u64) -> Option<&CutBatch> {
        let first = self.kept.front()?.batch.number;
        self.kept.get(usize::try_from(number.checked_sub(first)?).ok()?)
    }

    /// The end of the recording, if the thread did not fail on the way there.
    fn end(&mut self) -> io::Result<Outgoing> {
        match self.reader.take().map(JoinHandle::join) {
            Some(Err(_)) => Err(io::Error::other("the thread that reads the recording failed")),
            Some(Ok(())) | None => Ok(Outgoing::End),
        }
    }

    fn drop_forgotten(&mut self) {
        while self.kept.front().is_some_and(|kept| kept.batch.number <= self.forgotten_through) {
            self.kept.pop_front();
        }
    }

    /// When a batch is due: as long after the first one as its stamp is, sped up.
    fn due(&mut self, stamp_ns: i64) -> Option<Instant> {
        let rate = self.rate?;
        let (start, first_ns) = *self.began.get_or_insert_with(|| (Instant::now(), stamp_ns));
        let ahead_s = stamp_ns.saturating_sub(first_ns) as f64 * 1e-9 / rate;
        // Stamps may run backwards, and one may be absurd: it must not stop the replay for ever.
        let ahead = Duration::try_from_secs_f64(ahead_s).unwrap_or_default();
        start.checked_add(ahead)
    }
}

impl BatchSource for LogSource {
    async fn get(&mut self, number: u64) -> io::Result<Outgoing> {
        while self.kept(number).is_none() {
            let Some(read) = self.incoming.recv().await else { return self.end() };
            let cut = read?;
            self.tally.add(cut.n_readings);
            self.kept.push_back(cut);
            self.drop_forgotten();
        }
        let stamp_ns = self.kept(number).map_or(0, |cut| cut.stamp_ns);
        if let Some(due) = self.due(stamp_ns) {
            sleep_until(due).await;
        }
        let batch = self.kept(number).map(|cut| cut.batch.clone());
        Ok(batch.map_or(Outgoing::End, Outgoing::Batch))
    }

    async fn forget_through(&mut self, number: u64) -> io::Result<()> {
        self.forgotten_through = self.forgotten_through.max(number);
        self.drop_forgotten();
        Ok(())
    }
}

fn read(reading: &LogReading, sender: &mpsc::Sender<io::Result<CutBatch>>) {
    match reading.content.batches(reading.section) {
        Ok(batches) => {
            for batch in batches {
                if sender.blocking_send(batch).is_err() {
                    return;
                }
            }
        }
        // If nobody listens any more, nobody wants to know.
        Err(error) => drop(sender.blocking_send(Err(error))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ten scans, one a second.
    fn source(rate: Option<f64>) -> (tempfile::TempDir, LogSource) {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("log");
        let lines = (0..10).map(|i| format!("FLASER 1 2 0 0 0 {i} 0 0 {i}.5 h 0"));
        let text = lines.collect::<Vec<_>>().join("\n");
        std::fs::write(&path, text).expect("a free disk");
        let content = Content::log(&path).expect("it is there");
        let section =
            Section::new(None, None, content.account().stamps_span_ns().expect("ten scans"));
        (folder, LogSource::start(LogReading { content, section, rate }, Tally::default()))
    }

    async fn number(source: &mut LogSource, number: u64) -> Option<u64> {
        match source.get(number).await.expect("readable") {
            Outgoing::Batch(batch) => Some(batch.number),
            _ => None,
        }
    }

    #[tokio::test]
    async fn batches_come_again_until_they_are_forgotten() {
        let (_folder, mut source) = source(None);
        assert_eq!(number(&mut source, 1).await, Some(1), "the first");
        assert_eq!(number(&mut source, 3).await, Some(3), "later ones");
        assert_eq!(number(&mut source, 2).await, Some(2), "again");
        source.forget_through(2).await.expect("nothing to go wrong");
        assert_eq!(number(&mut source, 3).await, Some(3), "not forgotten");
        assert_eq!(source.tally.readings_through(2), 4, "two scans each: a second is full");
        assert_eq!(number(&mut source, 6).await, None, "the end");
    }

    #[tokio::test]
    async fn what_an_earlier_replay_sent_is_passed_over() {
        let (_folder, mut source) = source(None);
        source.forget_through(4).await.expect("nothing to go wrong");
        assert_eq!(number(&mut source, 5).await, Some(5), "the first that is new");
        assert_eq!(source.kept.len(), 1, "the others are not kept");
        assert_eq!(source.tally.readings_through(5), 10, "and yet counted");
    }

    #[tokio::test]
    async fn pacing_follows_the_stamps() {
        let (_folder, mut source) = source(Some(2.0));
        let first = source.due(10_000_000_000).expect("paced");
        let second = source.due(18_000_000_000).expect("paced");
        assert_eq!(second - first, Duration::from_secs(4), "8 s at twice the speed");
        let back = source.due(9_000_000_000).expect("paced");
        assert_eq!(back, first, "a stamp that runs backwards does not wait");
        assert_eq!(source.due(i64::MIN), Some(first), "nor does an absurd one");
    }
}
