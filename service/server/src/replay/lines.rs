//! The lines of a recorded text file, plain or gzipped, without trust in their length.

use std::{
    fs::File,
    io::{self, BufRead, BufReader, Read, Seek, SeekFrom},
    path::Path,
};

use flate2::bufread::MultiGzDecoder;

/// Longest line that is kept, in bytes: 8192 ranges and as many remissions fit twice.
const LINE_BYTES_MAX: usize = 1 << 20;
/// First bytes of a gzip file (RFC 1952, section 2.3.1).
const GZIP_MAGIC: [u8; 2] = [0x1f, 0x8b];
/// Read from the file and from the decoder at once, in bytes.
const BUFFER_BYTES: usize = 1 << 17;

/// Reads lines one by one into a buffer of its own.
pub(crate) struct Lines<R> {
    input: R,
    line: Vec<u8>,
    number: u64,
}

/// One line.
pub(crate) enum Line<'a> {
    /// Without its line break.
    Whole(&'a [u8]),
    /// Longer than any line of such a file; its content was passed over.
    TooLong,
}

/// Opens a file; whether it is gzipped is told by its first bytes, not by its name.
pub(crate) fn open(path: &Path) -> io::Result<Lines<Box<dyn BufRead + Send>>> {
    let mut file = File::open(path)?;
    let mut magic = Vec::new();
    file.by_ref().take(GZIP_MAGIC.len() as u64).read_to_end(&mut magic)?;
    file.seek(SeekFrom::Start(0))?;
    let plain = BufReader::with_capacity(BUFFER_BYTES, file);
    let input: Box<dyn BufRead + Send> = if magic == GZIP_MAGIC {
        Box::new(BufReader::with_capacity(BUFFER_BYTES, MultiGzDecoder::new(plain)))
    } else {
        Box::new(plain)
    };
    Ok(Lines::new(input))
}

impl<R: BufRead> Lines<R> {
    /// The lines of `input`.
    pub(crate) fn new(input: R) -> Self {
        Self { input, line: Vec::new(), number: 0 }
    }

    /// Number of the line that was read last, from 1.
    pub(crate) fn number(&self) -> u64 {
        self.number
    }

    /// The next line, or `None` at the end.
    ///
    /// # Errors
    ///
    /// What the file or its compression has to say; nothing can be read after it.
    pub(crate) fn next(&mut self) -> io::Result<Option<Line<'_>>> {
        self.line.clear();
        let mut too_long = false;
        let mut something = false;
        loop {
            let chunk = self.input.fill_buf()?;
            if chunk.is_empty() {
                break;
            }
            something = true;
            let end = chunk.iter().position(|&byte| byte == b'\n');
            let part = &chunk[..end.unwrap_or(chunk.len())];
            too_long |= LINE_BYTES_MAX < self.line.len() + part.len();
            if !too_long {
                self.line.extend_from_slice(part);
            }
            let n_used = end.map_or(chunk.len(), |end| end + 1);
            self.input.consume(n_used);
            if end.is_some() {
                break;
            }
        }
        if !something {
            return Ok(None);
        }
        self.number += 1;
        Ok(Some(if too_long { Line::TooLong } else { Line::Whole(&self.line) }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::{Compression, write::GzEncoder};
    use std::io::Write;

    fn all(mut lines: Lines<impl BufRead>) -> Vec<String> {
        let mut texts = Vec::new();
        while let Some(line) = lines.next().expect("readable") {
            texts.push(match line {
                Line::Whole(bytes) => String::from_utf8_lossy(bytes).into_owned(),
                Line::TooLong => "TOO LONG".to_owned(),
            });
        }
        texts
    }

    #[test]
    fn splits_at_line_breaks_and_keeps_the_last_line() {
        let lines = Lines::new(BufReader::with_capacity(3, &b"one\n\nthree3\nfour"[..]));
        assert_eq!(all(lines), ["one", "", "three3", "four"], "as written");
    }

    #[test]
    fn a_line_without_end_is_passed_over() {
        let mut text = vec![b'x'; LINE_BYTES_MAX + 1];
        text.extend(b"\nnext\n");
        assert_eq!(all(Lines::new(&text[..])), ["TOO LONG", "next"], "and reading goes on");
    }

    #[test]
    fn gzip_is_told_by_content() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("plain-name.log");
        let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
        encoder.write_all(b"a\nb\n").expect("memory");
        std::fs::write(&path, encoder.finish().expect("memory")).expect("a free disk");
        assert_eq!(all(open(&path).expect("it is there")), ["a", "b"], "decompressed");
        std::fs::write(&path, b"c").expect("a free disk");
        assert_eq!(all(open(&path).expect("it is there")), ["c"], "plain");
    }
}
