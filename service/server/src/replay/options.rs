//! What the options of a replay mean.

use std::{path::Path, str::FromStr};

use meetpoint_client::v1::{Pose, Start, UnknownStart, start};

/// Characters of a robot's id, at most.
const ROBOT_NAME_MAX: usize = 63;
/// Endings that say what a file is, not what it is called.
const ENDINGS: [&str; 4] = [".gz", ".log", ".clf", ".gfs"];

/// Where the robot of a recording begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StartOption {
    /// At this pose in the map: metres, metres, radians.
    Known([f64; 3]),
    /// Nobody knows.
    Unknown,
}

impl StartOption {
    pub(super) fn to_wire(self) -> Start {
        let kind = match self {
            Self::Known([x_m, y_m, theta_rad]) => start::Kind::Known(Pose { x_m, y_m, theta_rad }),
            Self::Unknown => start::Kind::Unknown(UnknownStart {}),
        };
        Start { kind: Some(kind) }
    }
}

impl FromStr for StartOption {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "known" => return Ok(Self::Known([0.0; 3])),
            "unknown" => return Ok(Self::Unknown),
            _ => {}
        }
        let numbers: Vec<f64> = text
            .split(',')
            .map(|field| field.trim().parse().ok().filter(|number: &f64| number.is_finite()))
            .collect::<Option<_>>()
            .unwrap_or_default();
        let pose = <[f64; 3]>::try_from(numbers);
        pose.map(Self::Known).map_err(|_| format!("`{text}` is not known, unknown or X,Y,THETA"))
    }
}

/// How fast a recording is sent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rate {
    /// As fast as the service takes it.
    Max,
    /// As it was driven, times this.
    TimesRealTime(f64),
}

impl Rate {
    pub(super) fn times_real_time(self) -> Option<f64> {
        match self {
            Self::Max => None,
            Self::TimesRealTime(factor) => Some(factor),
        }
    }
}

impl FromStr for Rate {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "max" {
            return Ok(Self::Max);
        }
        let factor = text.strip_suffix('x').unwrap_or(text).parse::<f64>();
        match factor {
            Ok(factor) if factor.is_finite() && 0.0 < factor => Ok(Self::TimesRealTime(factor)),
            _ => Err(format!("`{text}` is not max, 1x, 10x or the like")),
        }
    }
}

/// The id of the robot `number` among several: `NAME-2`, with the name cut where that is too long.
pub(super) fn numbered(name: &str, number: u32) -> String {
    let ending = format!("-{number}");
    let n_chars = ROBOT_NAME_MAX - ending.len();
    let stem: String = name.chars().take(n_chars).collect();
    stem + &ending
}

/// A robot's id from a file's name: `Intel Lab.log.gz` becomes `intel-lab`.
pub(super) fn robot_name(file: &Path) -> String {
    let name = file.file_name().map(|name| name.to_string_lossy().to_lowercase());
    let mut stem = name.as_deref().unwrap_or_default();
    while let Some(shorter) = ENDINGS.iter().find_map(|ending| stem.strip_suffix(ending)) {
        stem = shorter;
    }
    let keep = |c: char| if c.is_ascii_alphanumeric() || c == '_' { c } else { '-' };
    let slug: String = stem.chars().map(keep).collect();
    let slug = slug.trim_matches(['-', '_']);
    let slug = &slug[..slug.len().min(ROBOT_NAME_MAX)];
    if slug.is_empty() { "robot".to_owned() } else { slug.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn starts() {
        assert_eq!("known".parse(), Ok(StartOption::Known([0.0; 3])), "the map's origin");
        assert_eq!("unknown".parse(), Ok(StartOption::Unknown), "nobody knows");
        assert_eq!("1,-2.5, 3".parse(), Ok(StartOption::Known([1.0, -2.5, 3.0])), "a pose");
        for text in ["", "1,2", "1,2,3,4", "a,b,c", "1,2,nan", "Known"] {
            assert!(text.parse::<StartOption>().is_err(), "{text}");
        }
    }

    #[test]
    fn rates() {
        assert_eq!("max".parse(), Ok(Rate::Max), "no pacing");
        assert_eq!("1x".parse(), Ok(Rate::TimesRealTime(1.0)), "as driven");
        assert_eq!("2.5".parse(), Ok(Rate::TimesRealTime(2.5)), "the x may be left out");
        for text in ["", "x", "0x", "-1x", "infx", "fast"] {
            assert!(text.parse::<Rate>().is_err(), "{text}");
        }
    }

    #[test]
    fn robots_are_called_after_their_files() {
        for (file, name) in [
            ("/data/intel.log.gz", "intel"),
            ("mit-csail.clf", "mit-csail"),
            ("Intel Lab (1).LOG", "intel-lab--1"),
            ("Büro.log", "b-ro"),
            (".log", "robot"),
            ("", "robot"),
        ] {
            assert_eq!(robot_name(Path::new(file)), name, "{file}");
        }
        let long = robot_name(Path::new(&"x".repeat(200)));
        assert_eq!(long.len(), ROBOT_NAME_MAX, "cut");
        assert_eq!(numbered("mrclam6", 2), "mrclam6-2", "with its number");
        let numbered = numbered(&long, 2);
        assert!(numbered.ends_with("x-2") && numbered.len() == ROBOT_NAME_MAX, "cut: {numbered}");
    }
}
