//! Worse versions of a CARMEN log: thinned, cut, begun anywhere, with worse odometry and beams.

use std::fs::File;
use std::io::{BufRead, BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

use anyhow::Context;
use flate2::read::MultiGzDecoder;
use meetpoint_sim::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

/// Scale of odometry that is wrong.
const SCALE: f64 = 1.03;
/// Share of beams that say anything.
const WRONG_SHARE: f64 = 0.05;
/// What wrong beams say lies below this, in metres: across a hall.
const WRONG_MAX_M: f64 = 10.0;
/// Random starts.
const N_STARTS: u64 = 10;
/// They lie before this share of the log, so that enough is left to come back to.
const START_MAX: f64 = 0.4;

/// What is done to a log.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum LogVariant {
    /// Every other scan is left out.
    EverySecondScan,
    /// Only the first half of the time.
    FirstHalf,
    /// Only the second half.
    SecondHalf,
    /// The odometry takes every metre for [`SCALE`] of them.
    OdometryScaled,
    /// [`WRONG_SHARE`] of the beams say anything.
    WrongBeams(u64),
    /// It begins after this share of the time.
    From(f64),
}

/// All variants, with random starts by this seed.
pub(super) fn variants(seed: u64) -> Vec<LogVariant> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let starts = (0..N_STARTS).map(|_| LogVariant::From(rng.random_range(0.0..START_MAX)));
    let worse = [
        LogVariant::EverySecondScan,
        LogVariant::FirstHalf,
        LogVariant::SecondHalf,
        LogVariant::OdometryScaled,
        LogVariant::WrongBeams(seed),
    ];
    worse.into_iter().chain(starts).collect()
}

/// A log to be replayed; one that was written for it goes when this is dropped.
pub(super) struct WrittenLog {
    path: PathBuf,
    is_ours: bool,
}

impl WrittenLog {
    /// Where it lies.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for WrittenLog {
    fn drop(&mut self) {
        if self.is_ours {
            // A file that stays behind is in the way of nobody.
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

impl LogVariant {
    /// What it is called.
    pub(super) fn name(&self) -> String {
        match self {
            Self::EverySecondScan => "every second scan".to_owned(),
            Self::FirstHalf => "first half".to_owned(),
            Self::SecondHalf => "second half".to_owned(),
            Self::OdometryScaled => format!("odometry times {SCALE}"),
            Self::WrongBeams(_) => format!("{:.0} % of beams wrong", 100.0 * WRONG_SHARE),
            Self::From(share) => format!("from {:.0} % on", 100.0 * share),
        }
    }

    /// What a replay is told beside the file.
    pub(super) fn replay_options(&self) -> Vec<String> {
        let option = |name: &str, share: f64| vec![name.to_owned(), format!("{share:.4}")];
        match self {
            Self::FirstHalf => option("--to", 0.5),
            Self::SecondHalf => option("--from", 0.5),
            Self::From(share) => option("--from", *share),
            Self::EverySecondScan | Self::OdometryScaled | Self::WrongBeams(_) => Vec::new(),
        }
    }

    /// The log as the variant has it, in `folder` if it differs.
    pub(super) fn written(&self, log: &Path, folder: &Path) -> anyhow::Result<WrittenLog> {
        if !self.replay_options().is_empty() {
            return Ok(WrittenLog { path: log.to_owned(), is_ours: false });
        }
        let name = format!("meetpoint-bench-{}-variant.log", std::process::id());
        let path = folder.join(name);
        let file =
            File::create(&path).with_context(|| format!("cannot write {}", path.display()))?;
        let written = WrittenLog { path, is_ours: true };
        let mut out = BufWriter::new(file);
        let mut writer = self.lines();
        for line in lines(log)? {
            if let Some(line) = writer.line(&line?) {
                writeln!(out, "{line}")?;
            }
        }
        out.flush()?;
        Ok(written)
    }

    fn lines(&self) -> Lines {
        let seed = if let Self::WrongBeams(seed) = self { *seed } else { 0 };
        Lines { variant: self.clone(), n_scans: 0, rng: ChaCha8Rng::seed_from_u64(seed) }
    }
}

/// The lines of a log, packed or not.
fn lines(log: &Path) -> anyhow::Result<impl Iterator<Item = std::io::Result<String>>> {
    let file = File::open(log).with_context(|| format!("cannot read {}", log.display()))?;
    let is_packed = log.extension().is_some_and(|extension| extension == "gz");
    let reader: Box<dyn Read> =
        if is_packed { Box::new(MultiGzDecoder::new(file)) } else { Box::new(file) };
    Ok(BufReader::new(reader).lines())
}

/// Changes a log line by line.
struct Lines {
    variant: LogVariant,
    n_scans: usize,
    rng: ChaCha8Rng,
}

impl Lines {
    /// The line as the variant has it; `None` if it is left out.
    fn line(&mut self, line: &str) -> Option<String> {
        let mut words: Vec<String> = line.split_whitespace().map(str::to_owned).collect();
        let tag = words.first().map_or("", String::as_str);
        // Fields of poses, which begin with x and y; and those of readings.
        let (poses, readings) = match tag {
            "ODOM" => (vec![1], 0..0),
            "FLASER" | "RLASER" => {
                let n_beams = words.get(1).and_then(|n| n.parse::<usize>().ok())?;
                self.n_scans += 1;
                (vec![2 + n_beams, 5 + n_beams], 2..2 + n_beams)
            }
            _ => return Some(line.to_owned()),
        };
        if words.len() < readings.end || poses.iter().any(|pose| words.len() < pose + 3) {
            return Some(line.to_owned());
        }
        match &self.variant {
            LogVariant::EverySecondScan
                if !readings.is_empty() && self.n_scans.is_multiple_of(2) =>
            {
                return None;
            }
            LogVariant::OdometryScaled => {
                for field in poses.into_iter().flat_map(|pose| [pose, pose + 1]) {
                    if let Ok(metres) = words[field].parse::<f64>() {
                        words[field] = format!("{:.6}", SCALE * metres);
                    }
                }
            }
            LogVariant::WrongBeams(_) => {
                for word in &mut words[readings] {
                    if self.rng.random_bool(WRONG_SHARE) {
                        *word = format!("{:.2}", self.rng.random_range(0.1..WRONG_MAX_M));
                    }
                }
            }
            _ => {}
        }
        Some(words.join(" "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCAN: &str = "FLASER 2 1.50 2.50 1.0 2.0 0.5 10.0 20.0 0.25 7.5 robot 7.5";
    const ODOMETRY: &str = "ODOM 1.0 2.0 0.5 0 0 0 7.4 robot 7.4";

    #[test]
    fn lines_are_left_out_scaled_and_spoilt() {
        let all = |variant: LogVariant| {
            let mut lines = variant.lines();
            let lines = ["# log", ODOMETRY, SCAN, SCAN].map(|line| lines.line(line));
            lines.into_iter().flatten().collect::<Vec<String>>()
        };
        assert_eq!(all(LogVariant::EverySecondScan), ["# log", ODOMETRY, SCAN], "one scan less");
        let scaled = all(LogVariant::OdometryScaled);
        assert_eq!(scaled[1], "ODOM 1.030000 2.060000 0.5 0 0 0 7.4 robot 7.4", "not the heading");
        let expected =
            "FLASER 2 1.50 2.50 1.030000 2.060000 0.5 10.300000 20.600000 0.25 7.5 robot 7.5";
        assert_eq!(scaled[2], expected, "both poses, and no reading");
        let mut spoilt = LogVariant::WrongBeams(3).lines();
        let words: Vec<String> = (0..200)
            .filter_map(|_| spoilt.line(SCAN))
            .flat_map(|line| line.split(' ').skip(2).take(2).map(str::to_owned).collect::<Vec<_>>())
            .collect();
        let n_wrong = words.iter().filter(|word| *word != "1.50" && *word != "2.50").count();
        assert!((8..35).contains(&n_wrong), "about 20 of 400: {n_wrong}");
        assert_eq!(all(LogVariant::FirstHalf).len(), 4, "as it is");
    }

    #[test]
    fn starts_are_random_and_the_same() {
        assert_eq!(variants(5), variants(5), "the same seed");
        let starts = variants(5).into_iter().filter_map(|variant| match variant {
            LogVariant::From(share) => Some(share),
            _ => None,
        });
        let starts: Vec<f64> = starts.collect();
        assert_eq!(starts.len(), 10, "ten of them");
        assert!(starts.iter().all(|share| (0.0..START_MAX).contains(share)), "{starts:?}");
        assert!(starts.windows(2).all(|pair| (pair[0] - pair[1]).abs() > 0.0), "{starts:?}");
    }
}
