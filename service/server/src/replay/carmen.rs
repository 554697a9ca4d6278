//! One line of a CARMEN log.
//!
//! A log is one message a line, blanks between the fields, `#` for comments. Every message ends
//! with three trailers: the stamp of the message in seconds, the host's name and the logger's
//! stamp. The first of them is the scan's key. Sources: CARMEN's `logger` module; the reader of
//! A. Censi's csm.

mod fields;
mod geometry;
mod laser_line;

pub(crate) use geometry::{Beams, Parameters};

use meetpoint_geometry::Pose;

use fields::Fields;

/// What a line says.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Message<'a> {
    /// `ODOM`: dead reckoning.
    Odometry {
        /// First trailer.
        stamp_ns: i64,
        /// In the odometry's own frame.
        pose: Pose,
    },
    /// `FLASER`, `RLASER`, `RAWLASERn`, `ROBOTLASERn`.
    Scan(Scan),
    /// `PARAM`: a setting of the robot's software.
    Parameter {
        /// Module and variable, as in `robot_frontlaser_offset`.
        name: &'a str,
        /// As written.
        value: &'a str,
    },
    /// A tag that is not read here.
    Other(&'a str),
    /// Nothing, or a comment.
    Empty,
}

/// One sweep of a laser.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Scan {
    /// First trailer.
    pub(crate) stamp_ns: i64,
    /// Which laser, by what its line says.
    pub(crate) laser: Laser,
    /// As written, in metres.
    pub(crate) ranges_m: Vec<f32>,
    /// As written, if the line has them.
    pub(crate) remissions: Vec<f32>,
    /// The robot's dead reckoning, if the line has it.
    pub(crate) odometry: Option<Pose>,
    /// Where the laser sits, if the line has two poses that say so.
    pub(crate) robot_from_laser: Option<Pose>,
}

/// What tells one laser from another: two scans with equal keys share a geometry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Laser {
    /// The kind of line.
    pub(crate) tag: LaserTag,
    /// Readings a scan.
    pub(crate) n_beams: u32,
    /// The beams, if the line describes them.
    pub(crate) beams: Option<Beams>,
}

/// The kinds of line that hold a scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LaserTag {
    /// `FLASER`, of the laser at the front.
    Front,
    /// `RLASER`, of the laser at the back.
    Rear,
    /// `RAWLASERn`: a laser by itself.
    Raw(u8),
    /// `ROBOTLASERn`: a laser and the robot's odometry.
    Robot(u8),
}

impl LaserTag {
    /// The sensor's id in a session.
    pub(crate) fn sensor_id(self) -> String {
        match self {
            Self::Front => "front_laser".to_owned(),
            Self::Rear => "rear_laser".to_owned(),
            Self::Raw(n) => format!("raw_laser_{n}"),
            Self::Robot(n) => format!("robot_laser_{n}"),
        }
    }

    /// The tag as written in the log.
    pub(crate) fn name(self) -> String {
        match self {
            Self::Front => "FLASER".to_owned(),
            Self::Rear => "RLASER".to_owned(),
            Self::Raw(n) => format!("RAWLASER{n}"),
            Self::Robot(n) => format!("ROBOTLASER{n}"),
        }
    }
}

/// Why a line cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum BadLine {
    /// It is not text.
    #[error("not UTF-8")]
    NotText,
    /// It is longer than any line of such a log.
    #[error("longer than a mebibyte")]
    TooLong,
    /// It ends too early.
    #[error("no {0}: the line is too short")]
    Missing(&'static str),
    /// It goes on where it should end.
    #[error("{0} fields more than the line should have")]
    TooMany(usize),
    /// A number that is none.
    #[error("{field} is `{text}`, not a finite number")]
    NotANumber {
        /// What it should be.
        field: &'static str,
        /// As written, its beginning.
        text: String,
    },
    /// A time that cannot be kept to the nanosecond.
    #[error("the stamp is `{0}`, not seconds as a plain decimal number")]
    NotAStamp(String),
    /// A count out of range.
    #[error("{count} readings; from 1 to {limit} are taken")]
    WrongCount {
        /// As written, its beginning.
        count: String,
        /// The most.
        limit: u32,
    },
    /// Beams that point nowhere or beyond a full turn.
    #[error("the angles of the beams make no sense: {0}")]
    WrongBeams(&'static str),
    /// More kinds of laser than a session may declare.
    #[error("more than {0} different lasers")]
    TooManyLasers(usize),
}

/// Reads one line.
///
/// # Errors
///
/// [`BadLine`], if the line has a tag that is read here and does not keep its form.
pub(crate) fn parse(line: &[u8]) -> Result<Message<'_>, BadLine> {
    let text = std::str::from_utf8(line).map_err(|_| BadLine::NotText)?;
    let mut fields = Fields::new(text);
    let Some(tag) = fields.next() else { return Ok(Message::Empty) };
    match tag {
        _ if tag.starts_with('#') => Ok(Message::Empty),
        "ODOM" => odometry(fields),
        "PARAM" => {
            Ok(Message::Parameter { name: fields.text("name")?, value: fields.text("value")? })
        }
        "FLASER" => laser_line::old(LaserTag::Front, fields),
        "RLASER" => laser_line::old(LaserTag::Rear, fields),
        _ => match (numbered(tag, "RAWLASER", 4), numbered(tag, "ROBOTLASER", 2)) {
            (Some(n), _) => laser_line::raw(n, fields),
            (_, Some(n)) => laser_line::robot(n, fields),
            _ => Ok(Message::Other(tag)),
        },
    }
}

/// The digit behind `prefix`, from 0 to `most`.
fn numbered(tag: &str, prefix: &str, most: u8) -> Option<u8> {
    let digit = tag.strip_prefix(prefix)?;
    if digit.len() != 1 {
        return None;
    }
    digit.parse().ok().filter(|&n| n <= most)
}

/// `ODOM x y theta tv rv accel` and the trailers.
fn odometry(mut fields: Fields<'_>) -> Result<Message<'_>, BadLine> {
    let pose = fields.pose()?;
    for velocity in ["tv", "rv", "accel"] {
        fields.number(velocity)?;
    }
    let stamp_ns = fields.trailers()?;
    Ok(Message::Odometry { stamp_ns, pose })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn odometry_is_read() {
        let line = b"ODOM 1.5 -2 0.25 0.1 0 0 976052857.337284 robot 0.5\r";
        let pose = Pose::new(1.5, -2.0, 0.25);
        let expected = Message::Odometry { stamp_ns: 976_052_857_337_284_000, pose };
        assert_eq!(parse(line), Ok(expected), "first trailer, raw pose");
    }

    #[test]
    fn the_second_pose_of_a_laser_line_is_the_odometry() {
        let line = b"FLASER 3 1.0 2.5 81.83 9 9 9 1 2 0.5 12.000001 host 12.1";
        let Ok(Message::Scan(scan)) = parse(line) else { panic!("a good line") };
        assert_eq!(scan.stamp_ns, 12_000_001_000, "first trailer");
        assert_eq!(scan.ranges_m, [1.0, 2.5, 81.83], "as written");
        assert_eq!(scan.odometry, Some(Pose::new(1.0, 2.0, 0.5)), "the second pose");
        assert_eq!(scan.laser.tag, LaserTag::Front, "by its tag");
    }

    #[test]
    fn a_raw_laser_says_how_its_beams_point() {
        let line = b"RAWLASER1 0 -1.5 3.0 1.5 30 0.01 0 3 1 2 3 2 7 8 5 host 5";
        let Ok(Message::Scan(scan)) = parse(line) else { panic!("a good line") };
        let beams = Beams { angle_min_rad: -1.5, angle_increment_rad: 1.5, range_max_m: 30.0 };
        assert_eq!(scan.laser.beams, Some(beams), "from the line");
        assert_eq!(scan.remissions, [7.0, 8.0], "kept");
        assert_eq!(scan.odometry, None, "it has none");
    }

    #[test]
    fn a_robot_laser_is_read_with_and_without_the_remission_mode() {
        let tail = "2 1.5 2.5 0 1.2 2 0.5 1 2 0.5 0.1 0 0.3 0.3 1e6 7.5 host 7.5";
        for head in ["0 -1.57 3.14 1.57 80 0.01 1", "0 -1.57 3.14 1.57 80 0.01"] {
            let line = format!("ROBOTLASER1 {head} {tail}");
            let Ok(Message::Scan(scan)) = parse(line.as_bytes()) else { panic!("{line}") };
            assert_eq!(scan.ranges_m, [1.5, 2.5], "{head}");
            assert_eq!(scan.odometry, Some(Pose::new(1.0, 2.0, 0.5)), "{head}");
            let mount = scan.robot_from_laser.expect("two poses");
            assert!((mount.x_m - 0.2 * 0.5_f64.cos()).abs() < 1e-12, "{mount:?}");
            assert_eq!(scan.stamp_ns, 7_500_000_000, "{head}");
        }
    }

    #[test]
    fn other_lines_are_told_apart() {
        assert_eq!(parse(b"# FLASER 3"), Ok(Message::Empty), "a comment");
        assert_eq!(parse(b"  "), Ok(Message::Empty), "blank");
        assert_eq!(parse(b"SYNC x 1 h 1"), Ok(Message::Other("SYNC")), "not read");
        assert_eq!(parse(b"RAWLASER12 1"), Ok(Message::Other("RAWLASER12")), "not read");
        let parameter = Message::Parameter { name: "robot_frontlaser_offset", value: "0.1" };
        assert_eq!(parse(b"PARAM robot_frontlaser_offset 0.1 1 h 1"), Ok(parameter), "read");
    }

    #[test]
    fn a_bad_line_says_what_is_wrong_with_it() {
        for (line, reason) in [
            ("ODOM 1 2", "no theta: the line is too short"),
            ("ODOM 1 2 x 0 0 0 1 h 1", "theta is `x`, not a finite number"),
            ("ODOM 1 2 inf 0 0 0 1 h 1", "theta is `inf`, not a finite number"),
            (
                "ODOM 1 2 3 0 0 0 1e9 h 1",
                "the stamp is `1e9`, not seconds as a plain decimal number",
            ),
            ("ODOM 1 2 3 0 0 0 1 h", "no logger's stamp: the line is too short"),
            ("ODOM 1 2 3 0 0 0 1 h 1 9", "1 fields more than the line should have"),
            ("FLASER 0 1 2 3 1 2 3 1 h 1", "0 readings; from 1 to 8192 are taken"),
            (
                "FLASER 99999999999999999999 1",
                "99999999999999999999 readings; from 1 to 8192 are taken",
            ),
            ("FLASER 3 1 2", "no range: the line is too short"),
            ("FLASER 1 2 1 2 3 1 2 3 1 h 1 5", "1 fields more than the line should have"),
            ("RAWLASER1 0 -1 3 0 30 0 0 3 1 2 3 0 5 h 5", ""),
            (
                "RAWLASER1 0 -1 0 0 30 0 0 3 1 2 3 0 5 h 5",
                "the angles of the beams make no sense: no angle between them",
            ),
        ] {
            match parse(line.as_bytes()) {
                Err(error) => assert_eq!(error.to_string(), reason, "{line}"),
                Ok(_) => assert_eq!(reason, "", "{line} was taken"),
            }
        }
    }

    fn good_line() -> impl Strategy<Value = String> {
        prop_oneof![
            Just("ODOM 1.5 -2 0.25 0.1 0 0 976052857.337284 robot 0.5".to_owned()),
            Just("FLASER 3 1.0 2.5 81.83 9 9 9 1 2 0.5 12.000001 host 12.1".to_owned()),
            Just("RAWLASER1 0 -1.5 3.0 1.5 30 0.01 0 3 1 2 3 2 7 8 5 host 5".to_owned()),
            Just(
                "ROBOTLASER1 0 -1.57 3.14 1.57 80 0.01 1 2 1.5 2.5 0 1.2 2 0.5 1 2 0.5 0.1 0 \
                  0.3 0.3 1e6 7.5 host 7.5"
                    .to_owned()
            ),
            Just("PARAM robot_frontlaser_offset 0.1 1 h 1".to_owned()),
        ]
    }

    proptest! {
        #[test]
        fn no_bytes_can_make_it_panic(line in prop::collection::vec(any::<u8>(), 0..300)) {
            let _ = parse(&line);
        }

        #[test]
        fn no_mutation_can_make_it_panic(
            line in good_line(),
            changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        ) {
            let mut bytes = line.into_bytes();
            for (place, byte) in changes {
                let place = place.index(bytes.len());
                bytes[place] = byte;
            }
            if let Ok(Message::Scan(scan)) = parse(&bytes) {
                prop_assert_eq!(scan.ranges_m.len(), scan.laser.n_beams as usize);
            }
        }

        #[test]
        fn no_field_can_make_it_panic(
            line in good_line(),
            place in any::<prop::sample::Index>(),
            field in prop_oneof![
                Just("NaN"), Just("-inf"), Just("1e400"), Just("-9223372036854775809"),
                Just("18446744073709551616"), Just("0"), Just("-1"), Just(".")
            ],
        ) {
            let mut fields: Vec<_> = line.split(' ').collect();
            let place = 1 + place.index(fields.len() - 1);
            fields[place] = field;
            let _ = parse(fields.join(" ").as_bytes());
        }
    }
}
