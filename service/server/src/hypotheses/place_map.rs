//! Local perceptual maps of a travel's places (HSSH 2004, section III-A): drawn from the scans around one visit,
//! by laser and odometry alone, in a frame of their own, and parsed there.
//!
//! What lies farther away than the robot went is of no concern, so that odometry's drift over the whole travel is
//! none of it: scans are matched with one another over some metres, as live mapping does.

use meetpoint_geometry::{Point2, Pose, angle_between};
use meetpoint_places::{
    LocalParams, LocalPerceptualMap, LocalPlace, ParsedMap, PlaceId, parsed_map,
};
use meetpoint_proto::v1;
use meetpoint_storage::BatchPayload;
use meetpoint_tracking::{
    LiveMap, MappingParams, Observation, ObservationKind, Odometry, SessionConfig, SessionKey,
    Velocity,
};
use prost::Message;

use super::travelled::Moment;
use crate::convert::{observation, sensor::DeclaredSensor};
use crate::error::Error;

/// Scans are drawn that were taken no farther from the visit than this, in metres: a robot has seen a crossing of
/// corridors from all sides by then, and has not yet turned into the next.
const REACH_M: f64 = 6.0;
/// Nor more scans than these before it, and as many after it: half a minute of a fast laser.
const N_SCANS_MAX: usize = 1000;
/// What lies farther from the visit is left out, in metres.
const RADIUS_M: f64 = 8.0;
/// Edge of a cell, in metres.
const RESOLUTION_M: f64 = 0.05;
/// A place whose core is farther from the robot than this is another one, in metres.
const CORE_MAX_M: f64 = 3.0;
/// How far behind a gateway a robot is sure to have been outside, in metres.
const OUTSIDE_M: f64 = 0.3;

/// What a session sent around a visit.
pub(crate) struct Around<'a> {
    pub(crate) sensors: &'a [DeclaredSensor],
    /// Without holes; the visit is in one of them.
    pub(crate) batches: &'a [BatchPayload],
    /// Whether there are others before the first and behind the last of them.
    pub(crate) has_more: [bool; 2],
    pub(crate) moment: Moment,
}

/// A place as it was drawn.
pub(crate) struct DrawnPlace {
    pub(crate) map: LocalPerceptualMap,
    /// In the map's own frame.
    pub(crate) robot: Pose,
    pub(crate) n_scans: usize,
    pub(crate) is_cut_short: bool,
    pub(crate) parsed: ParsedMap,
    /// Which of the parsed places it is.
    pub(crate) place: Option<PlaceId>,
    /// The gateway of it by which the robot came in.
    pub(crate) came_in_by: Option<u8>,
}

impl DrawnPlace {
    /// What was found; `None` where there is no place.
    pub(crate) fn found(&self) -> Option<&LocalPlace> {
        self.parsed.places().find(|(id, _)| Some(*id) == self.place).map(|(_, local)| local)
    }
}

/// Draws the place of a visit; `None` where no scan with odometry was taken around it, or the robot stood in what
/// was seen as a wall.
///
/// # Errors
/// [`Error::Internal`] if the journal holds what ingest never lets through.
pub(crate) fn drawn_place(around: &Around<'_>) -> Result<Option<DrawnPlace>, Error> {
    let (observations, at) = observations(around)?;
    let Some(at) = at else { return Ok(None) };
    let Some(window) = window(&observations, at) else { return Ok(None) };
    let is_at_edge = [window.start == 0, window.end == observations.len()];
    let is_cut_short = (0..2).any(|side| is_at_edge[side] && around.has_more[side]);
    let key = SessionKey(0);
    let mut live =
        LiveMap::new(MappingParams::INDOOR, RESOLUTION_M).map_err(|_| Error::internal("a cell"))?;
    let sensors = around.sensors.iter().map(|declared| declared.sensor.clone()).collect();
    live.open_session(key, SessionConfig { map_from_start: Pose::IDENTITY, sensors });
    let mut trail: Vec<(usize, Pose)> = Vec::new();
    for index in window {
        let estimate = live.apply(key, &observations[index]);
        trail.extend(estimate.map(|estimate| (index, estimate.map_from_robot)));
    }
    let n_scans = usize::try_from(live.n_drawn()).unwrap_or(usize::MAX);
    let before = trail.iter().rev().find(|(index, _)| *index <= at);
    let Some(&(_, robot)) = before.or(trail.first()).filter(|_| 0 < n_scans) else {
        return Ok(None);
    };
    let raster = live.grid().raster(None);
    let cut = LocalPerceptualMap::cut(&raster, robot.position(), RADIUS_M);
    let Some(map) = cut else { return Ok(None) };
    let local_from_map = map.map_from_local.inverse();
    let trail = trail.iter().take_while(|(index, _)| *index <= at);
    let trail: Vec<Point2<f64>> = trail.map(|(_, pose)| local_from_map * pose.position()).collect();
    let robot = local_from_map * robot;
    let parsed = parsed_map(&map.raster, &LocalParams::INDOOR);
    let place = place_near(&parsed, robot.position());
    let came_in_by = place.and_then(|(_, local)| came_in_by(local, &trail));
    let place = place.map(|(id, _)| id);
    Ok(Some(DrawnPlace { map, robot, n_scans, is_cut_short, parsed, place, came_in_by }))
}

/// All that was sent, in order, and which of it was the visit.
fn observations(around: &Around<'_>) -> Result<(Vec<Observation>, Option<usize>), Error> {
    let (mut all, mut at) = (Vec::new(), None);
    for BatchPayload { number, payload, rejected } in around.batches {
        let v1::Batch { number: _, observations } =
            v1::Batch::decode(payload.as_slice()).map_err(Error::internal)?;
        let told = (0_u32..).zip(observations).filter(|(index, _)| !rejected.contains(index));
        for (_, wire) in told {
            let is_there = around.moment == Moment { batch: *number, stamp_ns: wire.stamp_ns };
            let Some(observation) = observation::observation(wire, around.sensors) else {
                continue;
            };
            if is_there {
                at = Some(all.len());
            }
            all.push(observation);
        }
    }
    Ok((all, at))
}

/// Which observations are near the visit, without a hole, from the odometry before the first scan on; `None` if
/// odometry does not say where the visit was.
fn window(observations: &[Observation], at: usize) -> Option<std::ops::Range<usize>> {
    let mut odometry = Odometry::default();
    let positions: Vec<Option<Point2<f64>>> = observations
        .iter()
        .map(|Observation { stamp_ns, kind }| match kind {
            ObservationKind::OdometryPose(pose) => {
                odometry.add_pose(*stamp_ns, *pose);
                None
            }
            &ObservationKind::OdometryVelocity {
                forward_m_per_s,
                left_m_per_s,
                turn_rad_per_s,
            } => {
                let velocity = Velocity { forward_m_per_s, left_m_per_s, turn_rad_per_s };
                odometry.add_velocity(*stamp_ns, velocity);
                None
            }
            _ => odometry.pose_at(*stamp_ns).map(Pose::position),
        })
        .collect();
    let middle = positions[at]?;
    let is_near =
        |index: &usize| positions[*index].is_none_or(|there| (there - middle).norm() <= REACH_M);
    let is_scan =
        |index: usize| matches!(observations[index].kind, ObservationKind::LaserScan { .. });
    let few = |n_scans: &mut usize, index: usize| {
        *n_scans += usize::from(is_scan(index));
        (*n_scans <= N_SCANS_MAX).then_some(index)
    };
    let before = (0..at).rev().take_while(is_near).scan(0, |n, index| few(n, index)).last();
    let after = (at..observations.len()).take_while(is_near).scan(0, |n, index| few(n, index));
    Some(before.unwrap_or(at)..after.last().map_or(at + 1, |last| last + 1))
}

/// The place that holds a point, or else the nearest there is.
fn place_near(parsed: &ParsedMap, point: Point2<f64>) -> Option<(PlaceId, &LocalPlace)> {
    let holding = parsed.at(point, &LocalParams::INDOOR);
    let held = holding.and_then(|local| local.place.map(|id| (id, local)));
    let away_m = |local: &LocalPlace| (local.core - point).norm();
    let near = parsed.places().filter(|(_, local)| away_m(local) <= CORE_MAX_M);
    held.or_else(|| near.min_by(|(_, a), (_, b)| away_m(a).total_cmp(&away_m(b))))
}

/// The gateway of a place by which one came in who was last outside of all of them where the trail says.
fn came_in_by(place: &LocalPlace, trail: &[Point2<f64>]) -> Option<u8> {
    let away_m = |point: Point2<f64>| (point - place.core).norm();
    let gateways = || (0_u8..).zip(&place.gateways);
    let farthest_m = gateways().map(|(_, gateway)| away_m(gateway.center())).fold(0.0, f64::max);
    let outside = trail.iter().rev().find(|point| farthest_m + OUTSIDE_M < away_m(**point))?;
    let bearing_rad = |point: Point2<f64>| {
        let offset = point - place.core;
        offset.y.atan2(offset.x)
    };
    let off_rad =
        |center: Point2<f64>| angle_between(bearing_rad(*outside), bearing_rad(center)).abs();
    let nearest =
        gateways().min_by(|(_, a), (_, b)| off_rad(a.center()).total_cmp(&off_rad(b.center())));
    nearest.map(|(index, _)| index)
}
