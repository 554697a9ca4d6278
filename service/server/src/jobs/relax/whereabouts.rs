//! Where a session's robot is among landmarks that are known, when nothing is known of where it started:
//! TBF98 section 8 and Fig. 18, as far as it has driven.

use meetpoint_geometry::Point2;
use meetpoint_proto::v1;
use meetpoint_relaxation::{
    Landmark, LandmarkKind, Localization, LocalizationParams, Peak, Travel, Whereabouts,
};
use meetpoint_storage::SessionRecord;

use super::landmark_travel::LandmarkNames;
use super::stations::stations;
use super::tables::{n_columns, way_now};
use crate::convert::pose;
use crate::convert::table_picture::{self, Table};
use crate::{error::Error, service::Service};

/// Steps that are gone through for one answer, at most: seconds of work. A robot is found within some ten.
const N_STEPS_MAX: usize = 1000;

/// Landmarks of a version that a robot is looked for among.
pub(crate) struct KnownLandmarks {
    pub(crate) map: String,
    pub(crate) version: u64,
    pub(crate) landmarks: Vec<v1::Landmark>,
}

/// Where the robot is at a step, the last if none is given; with a picture if one is wanted.
///
/// # Errors
/// [`Error::NothingSeen`], [`Error::LandmarksUnknown`], [`Error::InvalidField`] for a step that there is
/// not, [`Error::MapTooLarge`] for landmarks that lie too far apart for any grid.
pub(crate) async fn whereabouts(
    service: &Service,
    record: &SessionRecord,
    known: KnownLandmarks,
    (step, picture): (Option<u32>, bool),
) -> Result<v1::GetWhereaboutsResponse, Error> {
    let session = record.id.0.to_string();
    let nothing_seen = || Error::NothingSeen(session.clone());
    let way = way_now(service, record, record.acked_through, None).await?;
    let course = way.map_err(|_| nothing_seen())?.course;
    if !course.has_odometry() {
        return Err(nothing_seen());
    }
    let mut names = LandmarkNames::default();
    let travel = names.renamed(&stations(&course, false));
    if travel.n_sightings() == 0 {
        return Err(nothing_seen());
    }
    let landmarks: Vec<Landmark> = known
        .landmarks
        .iter()
        .filter_map(|landmark| known_landmark(landmark, &mut names))
        .collect();
    if landmarks.is_empty() {
        let KnownLandmarks { map, version: number, .. } = known;
        return Err(Error::LandmarksUnknown { map, number });
    }
    let step = asked(step, travel.steps.len())?;
    let told = v1::Whereabouts {
        session,
        map: known.map,
        map_version: known.version,
        landmarks: count(landmarks.len()),
        step: count(step),
        steps: count(travel.steps.len()),
        sightings: count(travel.steps[..=step].iter().map(|step| step.sightings.len()).sum()),
        ..v1::Whereabouts::default()
    };
    let found = tokio::task::spawn_blocking(move || found(&travel, &landmarks, step, picture));
    let (found, png) = found.await.map_err(Error::internal)??;
    let Whereabouts { peaks, elsewhere, entropy, log_evidence: _ } = found;
    let peaks = peaks.into_iter().map(|Peak { pose, probability, around }| v1::Peak {
        map_from_robot: Some(pose::to_wire(pose)),
        probability,
        around,
    });
    let whereabouts =
        v1::Whereabouts { peaks: peaks.collect(), elsewhere, entropy_nats: entropy, ..told };
    Ok(v1::GetWhereaboutsResponse { whereabouts: Some(whereabouts), png })
}

/// Which step is meant.
fn asked(step: Option<u32>, n_steps: usize) -> Result<usize, Error> {
    let last = n_steps.saturating_sub(1);
    let step = step.map_or(last, |step| usize::try_from(step).unwrap_or(usize::MAX));
    if last < step {
        return Err(Error::field("step", format!("{step}, the last one is {last}")));
    }
    if N_STEPS_MAX <= step {
        let problem = format!("{step}, at most {} can be asked for", N_STEPS_MAX - 1);
        return Err(Error::field("step", problem));
    }
    Ok(step)
}

/// A landmark of the map as one that is known.
fn known_landmark(landmark: &v1::Landmark, names: &mut LandmarkNames) -> Option<Landmark> {
    let v1::Point { x_m, y_m } = landmark.position?;
    let v1::Covariance { xx_m2, xy_m2, yy_m2 } = landmark.covariance?;
    let (of_type, of_name) = (&landmark.landmark_type, landmark.identity.as_deref());
    Some(Landmark {
        position: Point2::new(x_m, y_m),
        covariance_m2: [[xx_m2, xy_m2], [xy_m2, yy_m2]].into(),
        kind: match of_name {
            Some(name) => LandmarkKind::Identity(names.identity(name)),
            None => LandmarkKind::Type(names.landmark_type(of_type)),
        },
        certainty: landmark.confidence.clamp(0.0, 1.0),
    })
}

/// Goes through the steps up to one.
fn found(
    travel: &Travel,
    landmarks: &[Landmark],
    step: usize,
    picture: bool,
) -> Result<(Whereabouts, Vec<u8>), Error> {
    let params = LocalizationParams::of_detector(&travel.detector);
    let localization = Localization::new(landmarks, travel.detector, params);
    let mut localization = localization.map_err(|_| {
        Error::field("session", "the map's landmarks lie too far apart for any grid")
    })?;
    for step in &travel.steps[..=step] {
        localization.advance(step);
    }
    let png = if picture {
        let width = n_columns(localization.grid());
        table_picture::png(&Table { width, values: localization.over_positions() })?
    } else {
        Vec::new()
    };
    Ok((localization.whereabouts(), png))
}

fn count(n: usize) -> u32 {
    u32::try_from(n).unwrap_or(u32::MAX)
}
