//! Several travels as one list of scans, travel by travel.

use meetpoint_geometry::Pose;
use nalgebra::{Matrix3, Vector3};

use crate::closures::closure::ClosureMoment;
use crate::graph::pose_graph::Edge;
use crate::scans::key_scan::KeyScan;
use crate::scans::landmark_sighting::LandmarkSighting;
use crate::scans::laser_travel::{DrivenScan, LaserTravel, PlacedTravel};

/// The travels.
#[derive(Debug)]
pub(crate) struct Travels {
    /// Lasers and scans of all. Invariant: poses are finite.
    pub(crate) all: LaserTravel,
    /// The first scan of each travel, and at last the number of all scans.
    bounds: Vec<usize>,
    /// Covariance of the pose at the first scan of each, in the map's frame.
    starts: Vec<Matrix3<f64>>,
    /// The first scan of each that is not known from an earlier relaxation.
    news: Vec<usize>,
    /// What was seen of landmarks, with scans among all. Invariant: finite, of scans that are there.
    pub(crate) sightings: Vec<LandmarkSighting>,
}

/// No start is surer: a centimetre and a tenth of a degree. It also keeps the numbers well-behaved.
const START_STD_MIN: Vector3<f64> = Vector3::new(0.01, 0.01, 0.0017);
/// Square in units of its covariance at which the place of a start is half doubted: closures that say
/// otherwise are believed.
const START_CHI2_TURN: f64 = 9.0;

impl Travels {
    /// One after the other, in their order; all new unless an earlier relaxation is gone on from.
    pub(crate) fn new(travels: Vec<PlacedTravel>, goes_on: bool) -> Self {
        let mut all = LaserTravel::default();
        let (mut bounds, mut starts, mut news) = (vec![0], Vec::new(), Vec::new());
        let mut all_sightings = Vec::new();
        for PlacedTravel { travel, start_covariance, n_relaxed, sightings } in travels {
            let LaserTravel { lasers, scans } = with_finite_poses(travel);
            let (n_before, n_own) = (all.lasers.len(), lasers.len());
            all.lasers.extend(lasers);
            // A laser that is not listed must not become another robot's.
            let laser = |of: usize| if of < n_own { n_before + of } else { usize::MAX };
            let n_known = if goes_on { n_relaxed.min(scans.len()) } else { 0 };
            news.push(all.scans.len() + n_known);
            let first = all.scans.len();
            let own = sightings.into_iter().filter_map(|seen| seen.checked(scans.len()));
            all_sightings
                .extend(own.map(|seen| LandmarkSighting { scan: first + seen.scan, ..seen }));
            let scans = scans.into_iter();
            all.scans.extend(scans.map(|scan| DrivenScan { laser: laser(scan.laser), ..scan }));
            bounds.push(all.scans.len());
            starts.push(start(&start_covariance));
        }
        Self { all, bounds, starts, news, sightings: all_sightings }
    }

    pub(crate) fn len(&self) -> usize {
        self.starts.len()
    }

    /// Scans of a travel among all.
    pub(crate) fn scans(&self, travel: usize) -> std::ops::Range<usize> {
        self.bounds[travel]..self.bounds[travel + 1]
    }

    /// Which travel a scan is of.
    pub(crate) fn travel_of(&self, scan: usize) -> usize {
        self.bounds.partition_point(|&first| first <= scan) - 1
    }

    /// True for the first scan of a travel.
    pub(crate) fn begins_at(&self, scan: usize) -> bool {
        self.bounds.binary_search(&scan).is_ok()
    }

    /// True for a scan whose pose is known from an earlier relaxation.
    pub(crate) fn is_known(&self, scan: usize) -> bool {
        scan < self.news[self.travel_of(scan)]
    }

    /// For each scan, whether a landmark was seen at it.
    pub(crate) fn sighted(&self) -> Vec<bool> {
        let mut sighted = vec![false; self.all.scans.len()];
        for seen in &self.sightings {
            sighted[seen.scan] = true;
        }
        sighted
    }

    /// The scan of a moment.
    pub(crate) fn scan_at(&self, moment: ClosureMoment) -> Option<usize> {
        let ClosureMoment { travel, stamp_ns } = moment;
        let mut scans = self
            .bounds
            .get(travel)
            .zip(self.bounds.get(travel + 1))
            .map_or(0..0, |(&first, &end)| first..end);
        scans.find(|&scan| self.all.scans[scan].stamp_ns == stamp_ns)
    }

    /// What ties the first key scan of each travel but the first to where it was placed: edges from the
    /// first key scan of all, which stays.
    pub(crate) fn start_edges(&self, keys: &[KeyScan]) -> Vec<Edge> {
        let pose = |key: usize| self.all.scans[keys[key].scan].map_from_robot;
        let begins = |&to: &usize| keys[to - 1].travel != keys[to].travel;
        let edge = |to: usize| {
            let from_to = pose(0).step_to(pose(to));
            let (sin, cos) = pose(0).theta_rad.sin_cos();
            let turn = Matrix3::new(cos, sin, 0.0, -sin, cos, 0.0, 0.0, 0.0, 1.0);
            let covariance = turn * self.starts[keys[to].travel] * turn.transpose();
            let information = covariance.try_inverse().unwrap_or_else(Matrix3::zeros);
            Edge { from: 0, to, from_to, information, chi2_turn: START_CHI2_TURN }
        };
        (1..keys.len()).filter(begins).map(edge).collect()
    }
}

/// The covariance of a start, not smaller than it can be.
fn start(given: &[[f64; 3]; 3]) -> Matrix3<f64> {
    let known = || Matrix3::from_fn(|row, column| PlacedTravel::KNOWN_START[row][column]);
    let given = Matrix3::from_fn(|row, column| 0.5 * (given[row][column] + given[column][row]));
    let floor = Matrix3::from_diagonal(&START_STD_MIN.map(|std| std * std));
    let covariance = if given.iter().all(|number| number.is_finite()) { given } else { known() };
    let covariance = covariance + floor;
    if covariance.cholesky().is_some() { covariance } else { known() }
}

/// A travel without numbers that are none: a pose that is not finite is that of the scan before, and
/// odometry that is not finite is none.
fn with_finite_poses(mut travel: LaserTravel) -> LaserTravel {
    let mut last = Pose::IDENTITY;
    for scan in &mut travel.scans {
        if scan.map_from_robot.is_finite() {
            last = scan.map_from_robot;
        }
        scan.map_from_robot = last;
        scan.odometry_from_robot = scan.odometry_from_robot.filter(|pose| pose.is_finite());
    }
    travel
}
