//! One file of a spool: records one behind the other, each with its length and checksum.
//!
//! ```text
//! record  = length (u32, little-endian), checksum (8 bytes), payload
//! checksum = first 8 bytes of BLAKE3(number (u64, little-endian), payload)
//! ```
//!
//! The number of a record follows from the file's name and the record's place. A crash can only
//! leave a torn tail, which is cut off when the file is opened.

use std::{
    fs::{self, File, OpenOptions},
    io::{self, Read, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

/// Ending of a segment's file name.
const ENDING: &str = "spool";
/// Bytes of a checksum: a damaged record passes once in 2^64.
const CHECKSUM_BYTES: usize = 8;
/// Bytes before a payload.
pub(super) const HEADER_BYTES: u64 = 4 + CHECKSUM_BYTES as u64;
/// Longer records are damage: the service takes batches up to 1 MiB.
const PAYLOAD_BYTES_MAX: u64 = 16 << 20;

/// A segment and where its records begin.
#[derive(Debug)]
pub(super) struct Segment {
    path: PathBuf,
    file: File,
    /// Number of the first record.
    first: u64,
    /// Where each record begins, and where the next one will.
    offsets: Vec<u64>,
}

impl Segment {
    /// A new, empty segment whose records begin with number `first`.
    pub(super) fn create(folder: &Path, first: u64) -> io::Result<Self> {
        let path = folder.join(format!("{first:020}.{ENDING}"));
        let file = OpenOptions::new().read(true).write(true).create_new(true).open(&path)?;
        // The name is durable, too, or the file could be lost as a whole.
        File::open(folder)?.sync_all()?;
        Ok(Self { path, file, first, offsets: vec![0] })
    }

    /// Opens a segment and cuts off what is torn.
    pub(super) fn open(path: &Path, first: u64) -> io::Result<Self> {
        let mut file = OpenOptions::new().read(true).write(true).open(path)?;
        let length = file.metadata()?.len();
        let mut segment =
            Self { path: path.to_owned(), file: file.try_clone()?, first, offsets: vec![0] };
        let mut payload = Vec::new();
        let mut end = 0;
        while let Some(n_payload) =
            next_record(&mut file, segment.end(), length - end, &mut payload)?
        {
            end += HEADER_BYTES + n_payload;
            segment.offsets.push(end);
        }
        if end < length {
            file.set_len(end)?;
            file.sync_all()?;
        }
        Ok(segment)
    }

    /// The number of the first record in a file of this name, if it is a segment's.
    pub(super) fn first_of(path: &Path) -> Option<u64> {
        let ours = path.extension().is_some_and(|ending| ending == ENDING);
        path.file_stem().filter(|_| ours)?.to_str()?.parse().ok()
    }

    /// Number of the first record, or of the one that will be.
    pub(super) fn first(&self) -> u64 {
        self.first
    }

    /// One more than the number of the last record.
    pub(super) fn end(&self) -> u64 {
        self.first + self.offsets.len() as u64 - 1
    }

    /// Size of the file.
    pub(super) fn n_bytes(&self) -> u64 {
        self.offsets.last().copied().unwrap_or(0)
    }

    /// Where the record of that index begins.
    #[cfg(test)]
    pub(super) fn offset(&self, index: usize) -> u64 {
        self.offsets[index]
    }

    /// Adds a record. On an error the file is as before, or will be when it is opened again.
    pub(super) fn append(&mut self, payload: &[u8]) -> io::Result<()> {
        let length = u32::try_from(payload.len())
            .ok()
            .filter(|&length| u64::from(length) <= PAYLOAD_BYTES_MAX)
            .ok_or_else(|| too_long(payload.len()))?;
        let start = self.n_bytes();
        let mut record = Vec::new();
        record.extend_from_slice(&length.to_le_bytes());
        record.extend_from_slice(&checksum(self.end(), payload));
        record.extend_from_slice(payload);
        self.file.seek(SeekFrom::Start(start))?;
        if let Err(error) = self.file.write_all(&record) {
            // What was written of it would be in the way of the next one.
            self.file.set_len(start)?;
            return Err(error);
        }
        self.offsets.push(start + record.len() as u64);
        Ok(())
    }

    /// The payload of a record, checked again: disks forget.
    pub(super) fn read(&mut self, number: u64) -> io::Result<Vec<u8>> {
        let index = number.checked_sub(self.first).and_then(|index| usize::try_from(index).ok());
        let bounds = index.and_then(|index| self.offsets.get(index..index.checked_add(2)?));
        let Some(&[start, end]) = bounds else {
            return Err(io::Error::other(format!("{}: no record {number}", self.path.display())));
        };
        self.file.seek(SeekFrom::Start(start))?;
        let mut payload = Vec::new();
        match next_record(&mut self.file, number, end - start, &mut payload)? {
            Some(_) => Ok(payload),
            None => Err(io::Error::new(
                io::ErrorKind::InvalidData,
                format!("{}: record {number} is damaged", self.path.display()),
            )),
        }
    }

    /// Waits until all is on the disk.
    pub(super) fn sync(&self) -> io::Result<()> {
        self.file.sync_data()
    }

    /// Deletes the file.
    pub(super) fn remove(self) -> io::Result<()> {
        fs::remove_file(&self.path)
    }
}

/// Reads the record at the file's position into `payload`; its length, or `None` if there is no
/// whole and undamaged record within `n_left` bytes.
fn next_record(
    file: &mut File,
    number: u64,
    n_left: u64,
    payload: &mut Vec<u8>,
) -> io::Result<Option<u64>> {
    if n_left < HEADER_BYTES {
        return Ok(None);
    }
    let mut length = [0; 4];
    let mut expected = [0; CHECKSUM_BYTES];
    file.read_exact(&mut length)?;
    file.read_exact(&mut expected)?;
    let length = u64::from(u32::from_le_bytes(length));
    if PAYLOAD_BYTES_MAX.min(n_left - HEADER_BYTES) < length {
        return Ok(None);
    }
    payload.clear();
    file.take(length).read_to_end(payload)?;
    Ok((checksum(number, payload) == expected).then_some(length))
}

fn checksum(number: u64, payload: &[u8]) -> [u8; CHECKSUM_BYTES] {
    let hash = blake3::Hasher::new().update(&number.to_le_bytes()).update(payload).finalize();
    std::array::from_fn(|index| hash.as_bytes()[index])
}

fn too_long(n_bytes: usize) -> io::Error {
    io::Error::new(
        io::ErrorKind::InvalidInput,
        format!("a batch of {n_bytes} bytes; at most {PAYLOAD_BYTES_MAX} are kept"),
    )
}
