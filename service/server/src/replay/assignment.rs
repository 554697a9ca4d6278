//! Which recordings a file or folder holds, and as whom each is sent.

use std::{
    fmt,
    path::{Path, PathBuf},
    sync::Arc,
};

use super::{
    ReplayArgs, StartOption,
    content::Content,
    mrclam::{Folder, RobotFiles, Run},
    options,
};

/// Where the robot of a recording begins, if nothing else is said.
const MAP_ORIGIN: StartOption = StartOption::Known([0.0; 3]);

/// A recording that is to be sent.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Assignment {
    pub(super) source: Source,
    /// As whom.
    pub(super) robot: String,
    pub(super) start: StartOption,
}

/// Where a recording lies.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Source {
    /// A CARMEN log.
    Log(PathBuf),
    /// A robot of an MRCLAM folder.
    Run { path: PathBuf, folder: Arc<Folder>, robot: RobotFiles },
}

impl Source {
    /// Reads it from beginning to end.
    ///
    /// # Errors
    ///
    /// If it cannot be read.
    pub(super) fn read(&self, anonymous: bool) -> anyhow::Result<Content> {
        Ok(match self {
            Self::Log(path) => Content::log(path)?,
            Self::Run { folder, robot, .. } => {
                Content::Run(Arc::new(Run::read(folder, robot, anonymous)?))
            }
        })
    }
}

impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Log(path) => path.display().fmt(f),
            Self::Run { path, robot, .. } => {
                write!(f, "{}, robot {}", path.display(), robot.number)
            }
        }
    }
}

/// What there is to send of a file or folder.
///
/// # Errors
///
/// If an option does not fit what it is, or a folder lacks a file.
pub(super) fn assignments(args: &ReplayArgs, path: &Path) -> anyhow::Result<Vec<Assignment>> {
    let name = args.robot.clone().unwrap_or_else(|| options::robot_name(path));
    if !path.is_dir() {
        let shown = path.display();
        for (given, option) in [
            (args.source_robot.is_some(), "--source-robot"),
            (args.anonymous_landmarks, "--anonymous-landmarks"),
        ] {
            anyhow::ensure!(!given, "{option} is for MRCLAM folders, and {shown} is no folder");
        }
        let start = args.start.unwrap_or(MAP_ORIGIN);
        return Ok(vec![Assignment { source: Source::Log(path.to_owned()), robot: name, start }]);
    }
    let folder = Arc::new(Folder::open(path)?);
    let robots = match args.source_robot {
        Some(number) => vec![folder.robot(number)?.clone()],
        None => folder.robots.clone(),
    };
    let is_alone = robots.len() == 1;
    if let (false, Some(StartOption::Known(_))) = (is_alone, args.start) {
        let n_robots = robots.len();
        anyhow::bail!(
            "{n_robots} robots cannot begin at one pose: choose one by --source-robot, or --start unknown"
        );
    }
    let assign = |(index, robot): (usize, RobotFiles)| Assignment {
        robot: match (&args.robot, is_alone) {
            (Some(name), true) => name.clone(),
            _ => options::numbered(&name, robot.number),
        },
        start: args.start.unwrap_or(if index == 0 { MAP_ORIGIN } else { StartOption::Unknown }),
        source: Source::Run { path: path.to_owned(), folder: Arc::clone(&folder), robot },
    };
    Ok(robots.into_iter().enumerate().map(assign).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Command {
        #[command(flatten)]
        replay: ReplayArgs,
    }

    /// Robots and starts of a folder of three robots, or why not.
    fn assigned(options: &[&str]) -> Result<Vec<(String, StartOption)>, String> {
        let parent = tempfile::tempdir().expect("a folder");
        let folder = parent.path().join("Lab 6");
        std::fs::create_dir(&folder).expect("a free disk");
        let of_robots = (1..=3)
            .flat_map(|n| ["Odometry", "Measurement"].map(|what| format!("Robot{n}_{what}.dat")));
        for name in of_robots.chain(["Barcodes.dat".to_owned()]) {
            std::fs::write(folder.join(name), "").expect("a free disk");
        }
        let words = [&["replay", "FILE", "--map", "lab"], options].concat();
        let args = Command::try_parse_from(words).map_err(|error| error.to_string())?.replay;
        let assigned = assignments(&args, &folder).map_err(|error| error.to_string())?;
        Ok(assigned.into_iter().map(|one| (one.robot, one.start)).collect())
    }

    #[test]
    fn every_robot_of_a_folder_is_one_of_its_own() {
        let found = assigned(&[]).expect("all three");
        let expected = [
            ("lab-6-1".to_owned(), MAP_ORIGIN),
            ("lab-6-2".to_owned(), StartOption::Unknown),
            ("lab-6-3".to_owned(), StartOption::Unknown),
        ];
        assert_eq!(found, expected, "one of them makes the map's frame");
        let found = assigned(&["--robot", "rover", "--start", "unknown"]).expect("all three");
        let expected = ["rover-1", "rover-2", "rover-3"];
        let expected = expected.map(|name| (name.to_owned(), StartOption::Unknown));
        assert_eq!(found, expected, "as named, as said");
    }

    #[test]
    fn one_robot_of_a_folder() {
        let found = assigned(&["--source-robot", "2"]);
        assert_eq!(found, Ok(vec![("lab-6-2".to_owned(), MAP_ORIGIN)]), "numbered all the same");
        let found = assigned(&["--source-robot", "3", "--robot", "rover", "--start", "1,2,0"]);
        let start = StartOption::Known([1.0, 2.0, 0.0]);
        assert_eq!(found, Ok(vec![("rover".to_owned(), start)]), "as named, as said");
        let error = assigned(&["--source-robot", "4"]).expect_err("there are three");
        assert_eq!(error, "no robot 4 in it; there are 1, 2, 3", "which there are");
    }

    #[test]
    fn several_robots_do_not_begin_at_one_pose() {
        let error = assigned(&["--start", "known"]).expect_err("three at the origin");
        assert!(error.starts_with("3 robots cannot begin at one pose"), "{error}");
    }

    #[test]
    fn options_of_folders_do_not_fit_files() {
        let words = ["replay", "FILE", "--map", "lab", "--source-robot", "1"];
        let args = Command::try_parse_from(words).map_err(|_| ()).expect("good options").replay;
        let error = assignments(&args, Path::new("a.log")).expect_err("a file").to_string();
        assert_eq!(error, "--source-robot is for MRCLAM folders, and a.log is no folder", "why");
    }
}
