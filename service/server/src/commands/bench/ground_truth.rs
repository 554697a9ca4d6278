//! Ground truth of an MRCLAM folder: where landmarks and robots truly were, by motion capture.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use anyhow::Context;
use flate2::read::MultiGzDecoder;
use meetpoint_geometry::Point2;

/// Robots that a folder may be of.
const N_ROBOTS: u32 = 5;
/// Between true places farther apart in time than this nothing is known, in nanoseconds.
const GAP_MAX_NS: i64 = 200_000_000;

/// What is true of a folder.
pub(super) struct GroundTruth {
    /// By subject number, in metres.
    pub(super) landmarks: BTreeMap<u32, Point2<f64>>,
    /// Robots with their ways, in the order of their numbers.
    pub(super) robots: Vec<(u32, TrueWay)>,
}

/// Where a robot was, by stamp in nanoseconds.
pub(super) struct TrueWay(BTreeMap<i64, Point2<f64>>);

impl GroundTruth {
    /// Reads `Landmark_Groundtruth` and `RobotN_Groundtruth`, plain or gzipped.
    ///
    /// # Errors
    /// If landmarks or all robots are missing, or a line is not what it must be.
    pub(super) fn read(folder: &Path) -> anyhow::Result<Self> {
        let text = text(folder, "Landmark_Groundtruth")?;
        let text = text.with_context(|| format!("{} has no landmarks", folder.display()))?;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a number below 100"
        )]
        let landmark = |[subject, x_m, y_m]: [f64; 3]| (subject as u32, Point2::new(x_m, y_m));
        let landmarks = rows(&text).map(|row| row.map(landmark)).collect::<anyhow::Result<_>>()?;
        let mut robots = Vec::new();
        for number in 1..=N_ROBOTS {
            if let Some(text) = self::text(folder, &format!("Robot{number}_Groundtruth"))? {
                let place =
                    |[time_s, x_m, y_m]: [f64; 3]| (stamp_ns(time_s), Point2::new(x_m, y_m));
                let way = rows(&text).map(|row| row.map(place)).collect::<anyhow::Result<_>>()?;
                robots.push((number, TrueWay(way)));
            }
        }
        anyhow::ensure!(!robots.is_empty(), "{} has no robot's ground truth", folder.display());
        Ok(Self { landmarks, robots })
    }
}

impl TrueWay {
    /// Where the robot was, between the places before and after; `None` where nobody looked.
    pub(super) fn at(&self, stamp_ns: i64) -> Option<Point2<f64>> {
        let (&before_ns, before) = self.0.range(..=stamp_ns).next_back()?;
        let (&after_ns, after) = self.0.range(stamp_ns..).next()?;
        let gap_ns = after_ns - before_ns;
        let share = (stamp_ns - before_ns) as f64 / gap_ns.max(1) as f64;
        (gap_ns < GAP_MAX_NS).then(|| before + (after - before) * share)
    }
}

/// A file's text; `None` if it is not there.
fn text(folder: &Path, stem: &str) -> anyhow::Result<Option<String>> {
    for (ending, is_gzipped) in [("dat", false), ("dat.gz", true)] {
        let path = folder.join(format!("{stem}.{ending}"));
        if !path.is_file() {
            continue;
        }
        let mut file = File::open(&path)?;
        let mut text = String::new();
        let read = if is_gzipped {
            MultiGzDecoder::new(file).read_to_string(&mut text)
        } else {
            file.read_to_string(&mut text)
        };
        read.with_context(|| format!("cannot read {}", path.display()))?;
        return Ok(Some(text));
    }
    Ok(None)
}

/// The first three numbers of every line that is no comment.
fn rows(text: &str) -> impl Iterator<Item = anyhow::Result<[f64; 3]>> + '_ {
    let lines = text.lines().enumerate().filter(|(_, line)| {
        let line = line.trim_start();
        !line.is_empty() && !line.starts_with('#')
    });
    lines.map(|(index, line)| {
        let words = line.split_whitespace().take(3).map(str::parse);
        let numbers: Option<Vec<f64>> = words.collect::<Result<_, _>>().ok();
        let row = numbers.and_then(|numbers| <[f64; 3]>::try_from(numbers).ok());
        row.with_context(|| format!("line {} of the ground truth has no three numbers", index + 1))
    })
}

#[expect(clippy::cast_possible_truncation, reason = "stamps of this century fit; others saturate")]
fn stamp_ns(seconds: f64) -> i64 {
    (seconds * 1e9).round() as i64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(robot: &str) -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("a folder");
        let files = [
            ("Landmark_Groundtruth.dat", "# Subject x y sx sy\n 6 \t 0.5 \t -4.25 \t 0 \t 0\n"),
            ("Robot2_Groundtruth.dat", robot),
        ];
        for (name, text) in files {
            std::fs::write(folder.path().join(name), text).expect("a free disk");
        }
        folder
    }

    #[test]
    fn ways_are_known_between_neighbouring_stamps() {
        let folder = folder("# Time x y theta\n1.0 2 3 0\n1.1 3 3 0\n9.0 5 5 0\n");
        let truth = GroundTruth::read(folder.path()).expect("good files");
        assert_eq!(truth.landmarks, BTreeMap::from([(6, Point2::new(0.5, -4.25))]), "one");
        let [(2, way)] = &truth.robots[..] else { panic!("only the second robot") };
        let at = way.at(1_050_000_000).expect("it is known");
        assert!((at - Point2::new(2.5, 3.0)).norm() < 1e-9, "half way: {at}");
        assert_eq!(way.at(9_000_000_000), Some(Point2::new(5.0, 5.0)), "to the very stamp");
        assert_eq!(way.at(5_000_000_000), None, "nobody looked");
        assert_eq!(way.at(0), None, "before it began");
    }

    #[test]
    fn a_bad_line_is_named() {
        let folder = folder("1.0 2 3 0\n1.1 far 3 0\n");
        let error = GroundTruth::read(folder.path()).err().map(|error| error.to_string());
        let expected = "line 2 of the ground truth has no three numbers";
        assert_eq!(error.as_deref(), Some(expected), "its number");
    }
}
