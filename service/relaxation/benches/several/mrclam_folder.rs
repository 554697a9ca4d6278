//! The robots of an MRCLAM folder as travels, with the truth beside them: K. Y. K. Leung, Y. Halpern, T.
//! D. Barfoot, H. H. T. Liu, "The UTIAS multi-robot cooperative localization and mapping dataset",
//! International Journal of Robotics Research 30 (2011). Sightings of other robots are left out.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use flate2::read::MultiGzDecoder;
use meetpoint_geometry::{Point2, Pose};
use meetpoint_relaxation::{Detector, Motion, Sighting, Step, Travel};

/// Subjects up to this one are robots.
const ROBOT_MAX: u32 = 5;
/// Sightings within this time are one step's, in seconds.
const TOGETHER_S: f64 = 0.2;
/// Legs of a way are no longer than this, in metres and radians.
const LEG_MAX_M: f64 = 0.5;
const LEG_MAX_RAD: f64 = 0.2;

/// One robot.
pub(crate) struct Robot {
    pub(crate) travel: Travel,
    /// Where its first step truly is.
    pub(crate) start: Pose,
    /// Where its steps with sightings truly are, by index.
    pub(crate) truth: Vec<(usize, Pose)>,
}

/// Robots, and true places of landmarks by subject.
pub(crate) struct Folder {
    pub(crate) robots: Vec<Robot>,
    pub(crate) landmarks: BTreeMap<u32, Point2<f64>>,
}

impl Folder {
    pub(crate) fn read(path: &Path, is_anonymous: bool) -> Self {
        let subjects: BTreeMap<u32, u32> = rows(path, "Barcodes")
            .iter()
            .map(|row| (whole(row[1]), whole(row[0])))
            .filter(|&(_, subject)| ROBOT_MAX < subject)
            .collect();
        let landmarks = rows(path, "Landmark_Groundtruth");
        let landmarks = landmarks.iter().map(|row| (whole(row[0]), Point2::new(row[1], row[2])));
        let robots = (1..=ROBOT_MAX).map(|number| robot(path, number, &subjects, is_anonymous));
        Self { robots: robots.collect(), landmarks: landmarks.collect() }
    }
}

fn robot(path: &Path, number: u32, subjects: &BTreeMap<u32, u32>, is_anonymous: bool) -> Robot {
    let velocities = rows(path, &format!("Robot{number}_Odometry"));
    let seen: Vec<(f64, Sighting)> = rows(path, &format!("Robot{number}_Measurement"))
        .iter()
        .filter_map(|row| {
            let subject = *subjects.get(&whole(row[1]))?;
            let identity = (!is_anonymous).then_some(subject);
            let (range_m, bearing_rad) = (row[2], row[3]);
            Some((row[0], Sighting { identity, landmark_type: 0, range_m, bearing_rad }))
        })
        .collect();
    let begun_s = velocities[0][0].min(seen[0].0);
    let mut way = Way { velocities, next: 0, time_s: begun_s, velocity: (0.0, 0.0) };
    let mut steps = vec![Step { motion: Motion::NONE, sightings: Vec::new() }];
    let (mut station_s, mut from_station) = (f64::NEG_INFINITY, Pose::IDENTITY);
    let (mut kept, mut stamps_s) = (Vec::new(), Vec::new());
    for (stamp_s, sighting) in &seen {
        let legs = way.until(*stamp_s);
        from_station = legs.iter().fold(from_station, |pose, &leg| pose * leg);
        kept.extend(legs);
        if TOGETHER_S < stamp_s - station_s {
            let motion = Motion::new(joined(&std::mem::take(&mut kept)));
            steps.push(Step { motion, sightings: Vec::new() });
            (station_s, from_station) = (*stamp_s, Pose::IDENTITY);
            stamps_s.push((steps.len() - 1, *stamp_s));
        }
        let offset = (from_station * sighting.offset_m()).coords;
        let (range_m, bearing_rad) = (offset.norm(), offset.y.atan2(offset.x));
        if let Some(step) = steps.last_mut() {
            step.sightings.push(Sighting { range_m, bearing_rad, ..*sighting });
        }
        // What was driven since the station belongs to the way to the next.
    }
    let most = |value: &dyn Fn(&Sighting) -> f64| {
        seen.iter().map(|(_, sighting)| value(sighting)).fold(0.0, f64::max)
    };
    let detector = Detector {
        range_max_m: (most(&|seen| seen.range_m) / 0.5).ceil() * 0.5,
        half_field_of_view_rad: (most(&|seen| seen.bearing_rad.abs()) / 0.05).ceil() * 0.05,
    };
    let truth = rows(path, &format!("Robot{number}_Groundtruth"));
    let at = |time_s: f64| {
        let after = truth.partition_point(|row| row[0] < time_s).min(truth.len() - 1);
        Pose::new(truth[after][1], truth[after][2], truth[after][3])
    };
    let start = at(begun_s);
    let truth = stamps_s.into_iter().map(|(step, stamp_s)| (step, at(stamp_s))).collect();
    Robot { travel: Travel { detector, steps }, start, truth }
}

/// Velocities under way.
struct Way {
    velocities: Vec<Vec<f64>>,
    next: usize,
    time_s: f64,
    velocity: (f64, f64),
}

impl Way {
    /// The arcs driven until a time.
    fn until(&mut self, stamp_s: f64) -> Vec<Pose> {
        let mut legs = Vec::new();
        while let Some(row) = self.velocities.get(self.next).filter(|row| row[0] <= stamp_s) {
            let (time_s, velocity) = (row[0], (row[1], row[2]));
            legs.push(self.arc(time_s));
            self.velocity = velocity;
            self.next += 1;
        }
        legs.push(self.arc(stamp_s));
        legs.retain(|&leg| leg != Pose::IDENTITY);
        legs
    }

    fn arc(&mut self, until_s: f64) -> Pose {
        let elapsed_s = until_s - self.time_s;
        self.time_s = until_s;
        let (length_m, turn_rad) = (self.velocity.0 * elapsed_s, self.velocity.1 * elapsed_s);
        let (sin, cos) = (turn_rad / 2.0).sin_cos();
        Pose::new(length_m * cos, length_m * sin, turn_rad)
    }
}

/// Short legs joined to longer ones.
fn joined(legs: &[Pose]) -> Vec<Pose> {
    let mut all: Vec<Pose> = Vec::new();
    let mut last = Pose::IDENTITY;
    for &leg in legs {
        let longer = last * leg;
        if LEG_MAX_M < longer.distance_m() || LEG_MAX_RAD < longer.theta_rad.abs() {
            all.push(last);
            last = leg;
        } else {
            last = longer;
        }
    }
    all.push(last);
    all
}

fn rows(path: &Path, stem: &str) -> Vec<Vec<f64>> {
    let path = path.join(format!("{stem}.dat.gz"));
    let mut text = String::new();
    let file = File::open(&path).expect("the folder's files are gzipped");
    MultiGzDecoder::new(file).read_to_string(&mut text).expect("text");
    let lines = text.lines().filter(|line| !line.trim_start().starts_with('#'));
    let row = |line: &str| line.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    lines.map(row).filter(|row: &Vec<f64>| !row.is_empty()).collect()
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "subjects are below 100"
)]
fn whole(number: f64) -> u32 {
    number as u32
}
