//! Where a session's robot is among landmarks that are known, when nothing is known of where it started:
//! TBF98 section 8 and Fig. 18, as far as it has driven.

use meetpoint_geometry::Point2;
use meetpoint_proto::v1;
use meetpoint_relaxation::{
    Landmark, LandmarkKind, Localization, LocalizationParams, Peak, PoseGrid, Step, Whereabouts,
};
use meetpoint_storage::SessionRecord;

use super::finding::count;
use super::names::LandmarkNames;
use super::stations::stations;
use super::tables::n_columns;
use super::way::way_now;
use crate::convert::pose;
use crate::convert::table_picture::{self, Table};
use crate::{error::Error, service::Service};

/// Steps that are gone through for one answer, at most. A robot is found within some ten.
const N_STEPS_MAX: usize = 1000;
/// Poses that all steps together weigh, at most: each a multiplication and a look-up for everything that
/// is seen, ten seconds or so in all.
const N_WEIGHED_MAX: usize = 1_000_000_000;
/// Poses, and places where landmarks may be, that an answer holds in memory at most: 4 to 12 bytes each.
const N_CELLS_MAX: usize = 50_000_000;

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
    let stations = stations(&course, false);
    let travel = names.renamed(&stations.travel, &stations.names);
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
    let params = LocalizationParams::of_detector(&travel.detector);
    let grid = grid(&landmarks, &params)?;
    let n_steps_max = (N_WEIGHED_MAX / grid.n_cells().max(1)).clamp(1, N_STEPS_MAX);
    let step = asked(step, travel.steps.len(), n_steps_max)?;
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
    let found = tokio::task::spawn_blocking(move || {
        let localization = Localization::on(grid, &landmarks, travel.detector, params);
        found(localization, &travel.steps[..=step], picture)
    });
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

/// The poses where the robot may be, unless there are more than may be worked on.
fn grid(landmarks: &[Landmark], params: &LocalizationParams) -> Result<PoseGrid, Error> {
    let limit_cells = N_CELLS_MAX as u64;
    // Landmarks that lie too far apart for any grid are too far apart for this one.
    let grid = Localization::grid_of(landmarks, params)
        .map_err(|_| Error::MapTooLarge { n_cells: u64::MAX, limit_cells })?;
    let n_cells = grid.n_cells() + grid.n_nodes() * landmarks.len();
    if N_CELLS_MAX < n_cells {
        return Err(Error::MapTooLarge { n_cells: n_cells as u64, limit_cells });
    }
    Ok(grid)
}

/// Which step is meant.
fn asked(step: Option<u32>, n_steps: usize, n_steps_max: usize) -> Result<usize, Error> {
    let last = n_steps.saturating_sub(1);
    let step = step.map_or(last, |step| usize::try_from(step).unwrap_or(usize::MAX));
    if last < step {
        return Err(Error::field("step", format!("{step}, the last one is {last}")));
    }
    if n_steps_max <= step {
        let problem = format!("{step}, at most {} can be asked for here", n_steps_max - 1);
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
            Some(name) => LandmarkKind::Identity(names.landmark(of_type, name)),
            None => LandmarkKind::Type(names.landmark_type(of_type)),
        },
        certainty: landmark.confidence.clamp(0.0, 1.0),
    })
}

/// Goes through some steps.
fn found(
    mut localization: Localization,
    steps: &[Step],
    picture: bool,
) -> Result<(Whereabouts, Vec<u8>), Error> {
    for step in steps {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn landmark(x_m: f64, y_m: f64) -> Landmark {
        Landmark {
            position: Point2::new(x_m, y_m),
            covariance_m2: [[0.01, 0.0], [0.0, 0.01]].into(),
            kind: LandmarkKind::Type(0),
            certainty: 1.0,
        }
    }

    #[test]
    fn what_would_fill_the_memory_is_refused() {
        let hall = [landmark(0.0, 0.0), landmark(100.0, 60.0)];
        let params = LocalizationParams::CAMERA;
        let of_hall = grid(&hall, &params).expect("a hall");
        assert!(of_hall.n_cells() < N_CELLS_MAX, "{}", of_hall.n_cells());
        for far_m in [1e3, 1e6, f64::INFINITY] {
            let refused = grid(&[landmark(0.0, 0.0), landmark(far_m, far_m)], &params);
            assert!(matches!(refused, Err(Error::MapTooLarge { .. })), "{far_m} m: {refused:?}");
        }
        let many = vec![landmark(50.0, 30.0); N_CELLS_MAX / of_hall.n_nodes()];
        let refused = grid(&[hall.to_vec(), many].concat(), &params);
        assert!(matches!(refused, Err(Error::MapTooLarge { .. })), "many landmarks: {refused:?}");
    }

    #[test]
    fn steps_that_there_are_and_that_can_be_afforded() {
        assert_eq!(asked(None, 20, 1000).ok(), Some(19), "the last");
        assert_eq!(asked(Some(3), 20, 1000).ok(), Some(3), "this one");
        assert!(asked(Some(20), 20, 1000).is_err(), "there is none");
        assert!(asked(None, 20, 10).is_err(), "too many for one answer");
        assert_eq!(asked(Some(9), 20, 10).ok(), Some(9), "so many are gone through");
    }
}
