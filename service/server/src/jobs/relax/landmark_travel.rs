//! A session past landmarks, relaxed by itself, for whoever lays it over others.

use std::time::Instant;

use meetpoint_relaxation::{Outcome, Travel};
use meetpoint_storage::SessionRecord;

use super::super::running::{Running, Stopped};
use super::super::workbench::{Next, Workbench};
use super::REPORT_EVERY;
use super::names::LandmarkNames;
use super::solver::{Piece, Reckoning, relaxed};
use super::stations::stations;
use super::way::way;
use crate::service::Service;

/// A session's travel past landmarks, and what follows from it alone.
#[derive(Debug)]
pub(in crate::jobs) struct LandmarkTravel {
    /// What the robot measured, from the session's start on.
    pub(in crate::jobs) travel: Travel,
    /// In the session's frame.
    pub(in crate::jobs) outcome: Outcome,
}

/// Relaxes a session by the landmarks along it while the job goes through a share of its work: where that
/// begins, and how much it is. `None` if the session has seen no landmark twice, or nothing fits it.
pub(in crate::jobs) async fn landmark_travel(
    service: &Service,
    record: &SessionRecord,
    names: &mut LandmarkNames,
    (running, bench): (&Running<'_>, &Workbench),
    [begin, extent]: [f64; 2],
) -> Result<Option<LandmarkTravel>, Stopped> {
    let way = way((service, bench), record, record.acked_through, None).await?;
    let Ok(way) = way else { return Ok(None) };
    if !way.course.has_odometry() {
        return Ok(None);
    }
    let stations = stations(&way.course, false);
    let travel = names.renamed(&stations.travel, &stations.names);
    let shares = [begin, extent];
    let outcome = relaxed_alone(&travel, Reckoning::Odometry, (running, bench), shares).await?;
    Ok(outcome.map(|outcome| LandmarkTravel { travel, outcome }))
}

/// Relaxes a travel while the job goes through a share of its work: where that begins, and how much it is.
/// `None` if nothing fits it.
pub(super) async fn relaxed_alone(
    travel: &Travel,
    reckoning: Reckoning,
    (running, bench): (&Running<'_>, &Workbench),
    [begin, extent]: [f64; 2],
) -> Result<Option<Outcome>, Stopped> {
    let work = travel.clone();
    let mut pieces =
        bench.pieces(move |teller| relaxed(&work, reckoning, None, |piece| teller.tell(piece)))?;
    let mut reported = Instant::now();
    loop {
        let Piece { share, milestone: _ } = match pieces.next().await? {
            Next::Piece(piece) => piece,
            Next::Done(Ok(Some(outcome))) => return Ok(Some(outcome)),
            Next::Done(Ok(None)) => return Err(Stopped::Left),
            Next::Done(Err(_)) => return Ok(None),
        };
        if REPORT_EVERY <= reported.elapsed() {
            running.progress(begin + extent * share.clamp(0.0, 1.0), None).await?;
            reported = Instant::now();
        }
    }
}
