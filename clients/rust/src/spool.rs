//! Keeps the batches of one session on disk until the service has them.
//!
//! Batches are appended to segment files and whole segments are deleted once they are
//! acknowledged. What is on the disk is never changed, so that a crash can only leave a torn tail,
//! which is cut off at the next opening.
//!
//! **When batches reach the disk.** A crash of the process loses nothing that was appended. A loss
//! of power loses what was appended since the last sync: at most [`SpoolParams::sync_every`]
//! batches. No batch is given out before it is synced, so that no number that the service may
//! know is ever used again for something else.
//!
//! **When the spool is full.** The oldest segment is dropped, acknowledged or not: what is new is
//! worth more for a map than what is old, and odometry in one piece more than in two. The numbers
//! that were dropped are told to the service as a hole, and counted.

mod segment;
mod source;

use std::{
    collections::VecDeque,
    fs, io,
    path::{Path, PathBuf},
};

use meetpoint_proto::v1::{Batch, Observation};
use prost::Message;

use segment::{HEADER_BYTES, Segment};
pub use source::{SpoolSource, SpoolWriter, spool_channel};

/// Tunables of [`Spool`].
#[derive(Clone, Copy, Debug)]
pub struct SpoolParams {
    /// A segment takes no more batches beyond this size, in bytes.
    pub segment_bytes_max: u64,
    /// All segments together stay below this size, in bytes; at least two segments' worth.
    pub spool_bytes_max: u64,
    /// Batches between two syncs while nothing is sent.
    pub sync_every: u32,
}

impl SpoolParams {
    /// For robots: an hour of a 10 Hz laser of 360 beams is 52 MB, so 1 GiB holds 20 hours;
    /// 4 MiB are freed at a time; with a batch a second a loss of power costs 8 s of driving.
    pub const ROBOT: Self =
        Self { segment_bytes_max: 4 << 20, spool_bytes_max: 1 << 30, sync_every: 8 };
}

/// What a spool holds at a number.
#[derive(Clone, Debug, PartialEq)]
pub enum Spooled {
    /// This batch.
    Batch(Batch),
    /// The numbers from the one asked for to `through` were dropped or damaged.
    Lost {
        /// Last number of the hole.
        through: u64,
    },
    /// Nothing yet.
    NotYet,
}

/// Batches of one session on disk, numbered from 1 without gaps.
#[derive(Debug)]
pub struct Spool {
    folder: PathBuf,
    params: SpoolParams,
    /// In order; never empty. The last one takes what is new.
    segments: VecDeque<Segment>,
    acked_through: u64,
    n_dropped: u64,
    n_unsynced: u32,
}

impl Spool {
    /// Opens the spool in `folder`, which is made if it is missing; cuts off a torn tail.
    ///
    /// # Errors
    ///
    /// If the folder or its files cannot be read and written.
    pub fn open(folder: &Path, params: SpoolParams) -> io::Result<Self> {
        fs::create_dir_all(folder)?;
        let mut paths = Vec::new();
        for entry in fs::read_dir(folder)? {
            let path = entry?.path();
            paths.extend(Segment::first_of(&path).map(|first| (first, path)));
        }
        paths.sort();
        let mut segments = VecDeque::new();
        for (first, path) in paths {
            segments.push_back(Segment::open(&path, first)?);
        }
        if segments.is_empty() {
            segments.push_back(Segment::create(folder, 1)?);
        }
        let folder = folder.to_owned();
        Ok(Self { folder, params, segments, acked_through: 0, n_dropped: 0, n_unsynced: 0 })
    }

    /// Appends a batch and gives its number.
    ///
    /// # Errors
    ///
    /// If the disk does not take it; the spool is as before.
    pub fn append(&mut self, observations: Vec<Observation>) -> io::Result<u64> {
        let number = self.next_number();
        let payload = Batch { number, observations }.encode_to_vec();
        self.make_room(HEADER_BYTES + payload.len() as u64)?;
        if let Some(last) = self.segments.back_mut() {
            last.append(&payload)?;
        }
        self.n_unsynced += 1;
        if self.params.sync_every <= self.n_unsynced {
            self.sync()?;
        }
        Ok(number)
    }

    /// What stands at `number`; on the disk for sure before it is given.
    ///
    /// # Errors
    ///
    /// If the disk cannot be read or synced.
    pub fn get(&mut self, number: u64) -> io::Result<Spooled> {
        if self.next_number() <= number {
            return Ok(Spooled::NotYet);
        }
        let index = self.segments.partition_point(|segment| segment.end() <= number);
        let Some(segment) = self.segments.get_mut(index) else { return Ok(Spooled::NotYet) };
        if number < segment.first() {
            return Ok(Spooled::Lost { through: segment.first() - 1 });
        }
        let read = segment.read(number);
        let payload = match read {
            Ok(payload) => payload,
            Err(error) if error.kind() == io::ErrorKind::InvalidData => {
                self.n_dropped += 1;
                return Ok(Spooled::Lost { through: number });
            }
            Err(error) => return Err(error),
        };
        if 0 < self.n_unsynced {
            self.sync()?;
        }
        let batch = Batch::decode(&payload[..]).map_err(io::Error::other)?;
        Ok(Spooled::Batch(batch))
    }

    /// Deletes the segments that hold nothing above `number`.
    ///
    /// # Errors
    ///
    /// If they cannot be deleted.
    pub fn forget_through(&mut self, number: u64) -> io::Result<()> {
        self.acked_through = self.acked_through.max(number);
        while 1 < self.segments.len()
            && self.segments.front().is_some_and(|segment| segment.end() <= number + 1)
        {
            self.remove_oldest()?;
        }
        Ok(())
    }

    /// Waits until all batches are on the disk.
    ///
    /// # Errors
    ///
    /// If the disk does not say so.
    pub fn sync(&mut self) -> io::Result<()> {
        if let Some(last) = self.segments.back() {
            last.sync()?;
        }
        self.n_unsynced = 0;
        Ok(())
    }

    /// The number that the next batch will have.
    pub fn next_number(&self) -> u64 {
        self.segments.back().map_or(1, Segment::end)
    }

    /// Batches that were dropped or found damaged since the opening, and not acknowledged.
    pub fn n_dropped(&self) -> u64 {
        self.n_dropped
    }

    /// Bytes on the disk.
    pub fn n_bytes(&self) -> u64 {
        self.segments.iter().map(Segment::n_bytes).sum()
    }

    /// Makes room for a record: begins a new segment, drops the oldest ones.
    fn make_room(&mut self, n_bytes: u64) -> io::Result<()> {
        let last = self.segments.back().map_or(0, Segment::n_bytes);
        if 0 < last && self.params.segment_bytes_max < last + n_bytes {
            self.sync()?;
            self.segments.push_back(Segment::create(&self.folder, self.next_number())?);
        }
        while 1 < self.segments.len() && self.params.spool_bytes_max < self.n_bytes() + n_bytes {
            let (first, end) =
                self.segments.front().map_or((0, 0), |oldest| (oldest.first(), oldest.end()));
            self.n_dropped += end.saturating_sub(first.max(self.acked_through + 1));
            self.remove_oldest()?;
        }
        Ok(())
    }

    fn remove_oldest(&mut self) -> io::Result<()> {
        self.segments.pop_front().map_or(Ok(()), Segment::remove)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use meetpoint_proto::v1::{Mark, observation::Kind};
    use proptest::prelude::*;

    const SMALL: SpoolParams =
        SpoolParams { segment_bytes_max: 200, spool_bytes_max: 100_000, sync_every: 3 };

    fn observations(text: &str) -> Vec<Observation> {
        let mark = Kind::Mark(Mark { label: text.to_owned() });
        vec![Observation { kind: Some(mark), ..Observation::default() }]
    }

    fn label(spooled: Spooled) -> Option<String> {
        let Spooled::Batch(mut batch) = spooled else { return None };
        match batch.observations.pop()?.kind? {
            Kind::Mark(Mark { label }) => Some(label),
            _ => None,
        }
    }

    #[derive(Clone, Debug)]
    enum Step {
        Append(String),
        Forget(u8),
        /// The process dies, and the disk forgets so many of the bytes that were not synced.
        Crash(u16),
    }

    fn step() -> impl Strategy<Value = Step> {
        prop_oneof![
            6 => "[a-z]{0,60}".prop_map(Step::Append),
            1 => any::<u8>().prop_map(Step::Forget),
            1 => any::<u16>().prop_map(Step::Crash),
        ]
    }

    /// Cuts bytes off the newest segment, but none that were synced.
    fn tear(folder: &Path, synced_bytes: u64, n_bytes: u16) {
        let newest = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("it").path());
        let newest = newest.max().expect("a segment");
        let file = fs::OpenOptions::new().write(true).open(newest).expect("it is there");
        let length = file.metadata().expect("it is there").len();
        let kept = length.saturating_sub(n_bytes.into()).max(synced_bytes);
        file.set_len(kept).expect("shorter");
    }

    proptest! {
        // Every case waits for the disk some twenty times.
        #![proptest_config(ProptestConfig::with_cases(32))]

        /// The definition: a list, of which a crash takes some of what was not synced.
        #[test]
        fn a_spool_is_a_list(steps in prop::collection::vec(step(), 1..80)) {
            let folder = tempfile::tempdir().expect("a folder");
            let mut spool = Spool::open(folder.path(), SMALL).expect("an empty folder");
            let mut model: Vec<String> = Vec::new();
            let mut forgotten = 0;
            for step in steps {
                match step {
                    Step::Append(text) => {
                        let number = spool.append(observations(&text)).expect("a free disk");
                        model.push(text);
                        prop_assert_eq!(number, model.len() as u64);
                    }
                    Step::Forget(share) => {
                        let number = model.len() as u64 * u64::from(share) / 255;
                        forgotten = forgotten.max(number);
                        spool.forget_through(number).expect("a free disk");
                    }
                    Step::Crash(n_bytes) => {
                        let synced = spool.next_number() - u64::from(spool.n_unsynced);
                        let last = spool.segments.back().expect("never empty");
                        let index = usize::try_from(synced - last.first()).expect("small");
                        let synced_bytes = last.offset(index);
                        drop(spool);
                        tear(folder.path(), synced_bytes, n_bytes);
                        spool = Spool::open(folder.path(), SMALL).expect("a torn tail is cut");
                        let kept = spool.next_number() - 1;
                        prop_assert!(synced <= kept + 1, "synced to {}, kept {}", synced, kept);
                        model.truncate(usize::try_from(kept).expect("small"));
                        forgotten = forgotten.min(kept);
                    }
                }
                prop_assert_eq!(spool.next_number(), model.len() as u64 + 1);
            }
            for (text, number) in model.iter().zip(1..).filter(|(_, n)| forgotten < *n) {
                let spooled = spool.get(number).expect("readable");
                prop_assert_eq!(label(spooled), Some(text.clone()), "batch {}", number);
            }
            let beyond = spool.get(model.len() as u64 + 1).expect("readable");
            prop_assert_eq!(beyond, Spooled::NotYet);
        }
    }

    #[test]
    fn a_full_spool_drops_the_oldest_and_says_so() {
        let folder = tempfile::tempdir().expect("a folder");
        let params = SpoolParams { spool_bytes_max: 1000, ..SMALL };
        let mut spool = Spool::open(folder.path(), params).expect("an empty folder");
        for i in 0..50 {
            spool.append(observations(&format!("{i:050}"))).expect("a free disk");
            assert!(spool.n_bytes() <= 1000, "{} bytes", spool.n_bytes());
        }
        let Spooled::Lost { through } = spool.get(1).expect("readable") else {
            panic!("50 batches of 70 bytes do not fit in 1000")
        };
        assert_eq!(spool.n_dropped(), through, "all of the hole is counted");
        let kept = spool.get(through + 1).expect("readable");
        assert_eq!(label(kept), Some(format!("{through:050}")), "the first that is left");
        drop(spool);
        let mut spool = Spool::open(folder.path(), params).expect("as it was");
        assert_eq!(spool.get(1).expect("readable"), Spooled::Lost { through }, "still a hole");
        assert_eq!(spool.next_number(), 51, "and the numbers go on");
    }

    #[test]
    fn what_was_acknowledged_is_not_counted_as_dropped() {
        let folder = tempfile::tempdir().expect("a folder");
        let params = SpoolParams { spool_bytes_max: 400, ..SMALL };
        let mut spool = Spool::open(folder.path(), params).expect("an empty folder");
        for i in 0..50 {
            let number = spool.append(observations(&format!("{i:050}"))).expect("a free disk");
            spool.forget_through(number).expect("a free disk");
        }
        assert_eq!(spool.n_dropped(), 0, "the service has them");
    }

    #[test]
    fn damage_in_the_middle_is_a_hole() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut spool = Spool::open(folder.path(), SMALL).expect("an empty folder");
        for i in 0..20 {
            spool.append(observations(&format!("{i:050}"))).expect("a free disk");
        }
        drop(spool);
        let first = folder.path().join(format!("{:020}.spool", 1));
        let mut bytes = fs::read(&first).expect("it is there");
        bytes[20] ^= 1;
        fs::write(&first, bytes).expect("a free disk");
        let mut spool = Spool::open(folder.path(), SMALL).expect("the rest is good");
        let Spooled::Lost { through } = spool.get(1).expect("readable") else {
            panic!("the first record is damaged")
        };
        let next = spool.get(through + 1).expect("readable");
        assert_eq!(label(next), Some(format!("{through:050}")), "the next segment is whole");
        assert_eq!(spool.next_number(), 21, "and the numbers go on");
    }
}
