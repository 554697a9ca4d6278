//! The files of an MRCLAM folder.

use std::path::{Path, PathBuf};

use super::barcodes::ROBOT_SUBJECT_MAX;

/// Endings of the files, in order of preference.
const ENDINGS: [&str; 2] = ["dat", "dat.gz"];

/// A folder with the files of one run of several robots.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Folder {
    /// Says whose the barcodes are.
    pub(super) barcodes: PathBuf,
    /// In the order of their numbers; at least one.
    pub(crate) robots: Vec<RobotFiles>,
}

/// The files of one robot.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct RobotFiles {
    /// Its subject number, 1 to 5.
    pub(crate) number: u32,
    /// Velocities.
    pub(super) odometry: PathBuf,
    /// Sightings.
    pub(super) measurement: PathBuf,
}

impl Folder {
    /// Looks which files there are.
    ///
    /// # Errors
    ///
    /// Which file is missing.
    pub(crate) fn open(path: &Path) -> anyhow::Result<Self> {
        let shown = path.display();
        let mut robots = Vec::new();
        for number in 1..=ROBOT_SUBJECT_MAX {
            let [odometry, measurement] = ["Odometry", "Measurement"]
                .map(|what| find(path, &format!("Robot{number}_{what}")));
            match (odometry, measurement) {
                (Some(odometry), Some(measurement)) => {
                    robots.push(RobotFiles { number, odometry, measurement });
                }
                (None, None) => {}
                (None, _) => anyhow::bail!("{shown} has no Robot{number}_Odometry.dat or .dat.gz"),
                (_, None) => {
                    anyhow::bail!("{shown} has no Robot{number}_Measurement.dat or .dat.gz")
                }
            }
        }
        anyhow::ensure!(
            !robots.is_empty(),
            "{shown} is no MRCLAM folder: no Robot1_Odometry.dat to \
             Robot{ROBOT_SUBJECT_MAX}_Odometry.dat in it, plain or gzipped"
        );
        match find(path, "Barcodes") {
            Some(barcodes) => Ok(Self { barcodes, robots }),
            None => anyhow::bail!("{shown} has no Barcodes.dat or .dat.gz"),
        }
    }

    /// The files of one robot.
    ///
    /// # Errors
    ///
    /// Which robots there are, if not this one.
    pub(crate) fn robot(&self, number: u32) -> anyhow::Result<&RobotFiles> {
        let found = self.robots.iter().find(|robot| robot.number == number);
        found.ok_or_else(|| {
            let numbers: Vec<_> =
                self.robots.iter().map(|robot| robot.number.to_string()).collect();
            anyhow::anyhow!("no robot {number} in it; there are {}", numbers.join(", "))
        })
    }
}

fn find(folder: &Path, stem: &str) -> Option<PathBuf> {
    let paths = ENDINGS.map(|ending| folder.join(format!("{stem}.{ending}")));
    paths.into_iter().find(|path| path.is_file())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(names: &[&str]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("a folder");
        for name in names {
            std::fs::write(folder.path().join(name), "").expect("a free disk");
        }
        folder
    }

    fn opened(names: &[&str]) -> Result<Folder, String> {
        let folder = folder(names);
        let shown = folder.path().display().to_string();
        let opened = Folder::open(folder.path());
        opened.map_err(|error| error.to_string().replace(&shown, "FOLDER"))
    }

    #[test]
    fn plain_files_go_before_gzipped_ones() {
        let found = opened(&[
            "Barcodes.dat.gz",
            "Robot2_Odometry.dat",
            "Robot2_Odometry.dat.gz",
            "Robot2_Measurement.dat.gz",
            "Robot2_Groundtruth.dat.gz",
            "Robot4_Odometry.dat",
            "Robot4_Measurement.dat",
        ])
        .expect("a good folder");
        let numbers: Vec<_> = found.robots.iter().map(|robot| robot.number).collect();
        assert_eq!(numbers, [2, 4], "those that are there");
        let second = found.robot(2).expect("it is there");
        assert!(second.odometry.ends_with("Robot2_Odometry.dat"), "the plain one");
        assert!(second.measurement.ends_with("Robot2_Measurement.dat.gz"), "the only one");
        let error = found.robot(3).expect_err("it is not there").to_string();
        assert_eq!(error, "no robot 3 in it; there are 2, 4", "which there are");
    }

    #[test]
    fn a_missing_file_is_named() {
        for (names, reason) in [
            (&["Robot1_Odometry.dat"][..], "FOLDER has no Robot1_Measurement.dat or .dat.gz"),
            (&["Robot3_Measurement.dat"], "FOLDER has no Robot3_Odometry.dat or .dat.gz"),
            (
                &["Robot1_Odometry.dat", "Robot1_Measurement.dat"],
                "FOLDER has no Barcodes.dat or .dat.gz",
            ),
            (
                &["Barcodes.dat"],
                "FOLDER is no MRCLAM folder: no Robot1_Odometry.dat to Robot5_Odometry.dat in it, \
                 plain or gzipped",
            ),
        ] {
            assert_eq!(opened(names), Err(reason.to_owned()), "{names:?}");
        }
    }
}
