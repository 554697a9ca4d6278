//! What lies on what: the frames of the newest version, made ready for being laid on one another.

use std::sync::Arc;

use meetpoint_geometry::Pose;
use meetpoint_merging::{AlignmentParams, Look, NamedLandmark, NamelessLandmark, Part};
use meetpoint_occupancy::Grid;
use meetpoint_proto::v1;
use meetpoint_storage::{MapRecord, MergeState, SessionFilter, SessionId, SessionRecord};

use v1::sensor::Kind;

use super::super::relax::named_sums::{NamedSums, SeenSums, add_seen};
use super::super::relax::names::LandmarkNames;
use super::super::running::Stopped;
use super::Merging;
use crate::convert::{merge, pose, session};
use crate::error::Error;

/// Sessions of a map read at a time.
const N_SESSIONS_READ: u32 = 100;
/// Sightings of one name scatter by no more than this about one landmark, in metres: what detectors are off,
/// and live mapping before it is relaxed.
const NAMED_STD_MAX_M: f64 = 1.0;
/// What a landmark is off, in metres, however often it was seen: how the detector sits.
const SIGHTING_STD_M: f64 = 0.2;

/// The parts of a map's newest version.
#[derive(Debug)]
pub(super) struct Parts {
    /// The version.
    pub(super) version: u64,
    /// Scans that the map had drawn.
    pub(super) n_scans_drawn: u64,
    /// Whether any session has a place in the map, even if it has drawn nothing yet.
    pub(super) has_placed: bool,
    /// What is drawn in the map's frame; `None` if nothing is.
    pub(super) site: Option<Arc<Part>>,
    /// Those that are asked for, in the order in which they were opened.
    pub(super) newcomers: Vec<Newcomer>,
    /// Sessions that detect landmarks and saw no walls, newcomers or placed, in the order in which they
    /// were opened.
    pub(super) starred: Vec<SessionRecord>,
}

/// What is drawn in the frame of a session that is not placed.
#[derive(Debug)]
pub(super) struct Newcomer {
    /// The session.
    pub(super) session: SessionId,
    /// Its robot, for people.
    pub(super) robot: String,
    /// Poses that the session has.
    pub(super) n_poses: u64,
    /// Whether nobody has decided about its merge.
    pub(super) may_accept: bool,
    /// Whether its walls were heard by sonars, and none seen by a laser.
    pub(super) hears_only: bool,
    /// What it has drawn; `None` if nothing.
    pub(super) part: Option<Arc<Part>>,
}

impl Parts {
    /// Those that the job is asked for.
    pub(super) async fn load(merging: &Merging<'_>) -> Result<Self, Stopped> {
        let Merging { service, params, .. } = merging;
        let map = service.map_record(&merging.map.id.0).await?;
        if map.latest_version == 0 {
            return Err(Error::NothingToMerge(map.id.0).into());
        }
        let version = service.version_record(&map.id.0, map.latest_version).await?;
        let asked = params.sessions.iter().map(|id| session::id("merge.sessions", id));
        let asked = asked.collect::<Result<Vec<SessionId>, Error>>()?;
        let mut parts = Self {
            version: version.number,
            n_scans_drawn: version.n_scans,
            has_placed: false,
            site: None,
            newcomers: Vec::new(),
            starred: Vec::new(),
        };
        let (sessions, mut names) = (sessions(merging).await?, LandmarkNames::default());
        let of_site: Vec<&SessionRecord> =
            sessions.iter().filter(|record| record.frame.is_none()).collect();
        let of_site = seen(merging, &map, (&of_site, &mut names)).await?;
        parts.site = part(merging, version.number, None, of_site).await?;
        for record in &sessions {
            parts.has_placed |= record.frame.is_none();
            let is_asked = asked.is_empty() || asked.contains(&record.id);
            let is_looked_at =
                record.frame.is_none() || (is_asked && record.frame == Some(record.id));
            if is_looked_at && record.n_scans == 0 && detects(record)? {
                parts.starred.push(record.clone());
            }
            if !is_asked || record.frame != Some(record.id) {
                continue;
            }
            let of_part = seen(merging, &map, (&[record], &mut names)).await?;
            let part = part(merging, version.number, Some(record.id), of_part).await?;
            let page = service.store.trajectory(record.id, version.number, 0, 0).await?;
            let merge = service.store.merge(merge::id_of(record.id)).await?;
            parts.newcomers.push(Newcomer {
                session: record.id,
                robot: record.robot.0.clone(),
                n_poses: page.map_or(0, |page| page.n_poses),
                may_accept: merge.is_none_or(|merge| merge.state == MergeState::Open),
                hears_only: hears_only(record)?,
                part,
            });
        }
        Ok(parts)
    }
}

/// True if a session detects landmarks.
fn detects(record: &SessionRecord) -> Result<bool, Error> {
    let sensors = session::declaration(&record.declaration)?.sensors;
    let detects = |sensor: &v1::Sensor| matches!(sensor.kind, Some(Kind::LandmarkDetector(_)));
    Ok(sensors.iter().any(detects))
}

/// True if a session declares sonars and no laser.
fn hears_only(record: &SessionRecord) -> Result<bool, Error> {
    let sensors = session::declaration(&record.declaration)?.sensors;
    let has = |is: fn(&Kind) -> bool| sensors.iter().any(|it| it.kind.as_ref().is_some_and(is));
    Ok(has(|kind| matches!(kind, Kind::SonarRing(_)))
        && !has(|kind| matches!(kind, Kind::Laser(_))))
}

/// Landmarks that some sessions saw beside walls, in the frame that they share.
#[derive(Debug)]
struct Landmarks {
    named: Vec<NamedLandmark>,
    nameless: Vec<NamelessLandmark>,
    /// Where robots looked for them.
    looks: Vec<Look>,
}

/// What some sessions saw of landmarks beside walls.
async fn seen(
    merging: &Merging<'_>,
    map: &MapRecord,
    (sessions, names): (&[&SessionRecord], &mut LandmarkNames),
) -> Result<Landmarks, Stopped> {
    let mut sums = SeenSums::default();
    for &record in sessions {
        if record.n_scans == 0 || !detects(record)? {
            continue;
        }
        let reader = (merging.service, merging.bench);
        let frame_from_session = record.map_from_session.filter(|_| record.frame.is_none());
        let at = frame_from_session.map_or(Pose::IDENTITY, pose::from_record);
        add_seen(reader, map, (record, at), (names, &mut sums)).await?;
    }
    let sighting_m2 = SIGHTING_STD_M * SIGHTING_STD_M;
    let landmark = |(&name, sums): (&u32, &NamedSums)| {
        let (at, variance_m2) = sums.mean();
        // Several landmarks are called that, or it is carried about.
        let is_one = variance_m2 <= NAMED_STD_MAX_M * NAMED_STD_MAX_M;
        is_one.then_some(NamedLandmark { name, at, variance_m2: variance_m2 + sighting_m2 })
    };
    let named = sums.named.iter().filter_map(landmark).collect();
    let (nameless, looks) = sums.nameless.told(sighting_m2);
    Ok(Landmarks { named, nameless, looks })
}

/// All sessions of the map, in the order in which they were opened.
async fn sessions(merging: &Merging<'_>) -> Result<Vec<SessionRecord>, Error> {
    let filter = SessionFilter { map: Some(merging.map.id.clone()), robot: None };
    let (mut found, mut after) = (Vec::new(), None);
    loop {
        let page = merging.service.store.sessions(&filter, after, N_SESSIONS_READ).await?;
        let Some(last) = page.last() else { return Ok(found) };
        after = Some(last.id);
        found.extend(page);
    }
}

/// What a version has drawn in a frame, made ready; `None` if nothing.
async fn part(
    merging: &Merging<'_>,
    version: u64,
    frame: Option<SessionId>,
    seen: Landmarks,
) -> Result<Option<Arc<Part>>, Stopped> {
    let drawn = merging.service.frame_grid(&merging.map.id.0, version, frame).await?.grid;
    if drawn.bounds().is_none() {
        return Ok(None);
    }
    let part = merging.bench.slice(move || made(&drawn, seen)).await?;
    Ok(Some(Arc::new(part)))
}

fn made(drawn: &Grid, seen: Landmarks) -> Part {
    let Landmarks { named, nameless, looks } = seen;
    let part = Part::of_grid(drawn, &AlignmentParams::INDOOR);
    part.with_landmarks(named).with_nameless(nameless, &looks)
}
