//! A session past landmarks, relaxed by itself, for whoever lays it over others.

use std::time::Instant;

use meetpoint_relaxation::{Outcome, Travel};
use meetpoint_storage::SessionRecord;

use super::super::running::{Running, Stopped};
use super::super::workbench::{Next, Workbench};
use super::solver::{Piece, Reckoning, relaxed};
use super::stations::{Stations, stations};
use super::{REPORT_EVERY, read_way};
use crate::service::Service;

/// What landmarks are called, the same numbers in all sessions.
#[derive(Debug, Default)]
pub(in crate::jobs) struct LandmarkNames {
    types: Vec<String>,
    identities: Vec<String>,
}

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
    let way = read_way((service, bench), record, record.acked_through, None).await?;
    let Ok(way) = way else { return Ok(None) };
    if !way.course.has_odometry() {
        return Ok(None);
    }
    let travel = names.renamed(&stations(&way.course, false));
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

impl LandmarkNames {
    /// The number of a type.
    pub(super) fn landmark_type(&mut self, name: &str) -> u32 {
        number(&mut self.types, name)
    }

    /// The number of a name.
    pub(super) fn identity(&mut self, name: &str) -> u32 {
        number(&mut self.identities, name)
    }

    /// A travel whose types and identities have the numbers that all sessions share.
    pub(super) fn renamed(&mut self, stations: &Stations) -> Travel {
        let Stations { travel, places: _, types, identities } = stations;
        let mut travel = travel.clone();
        let types = numbers(&mut self.types, types);
        let identities = numbers(&mut self.identities, identities);
        let renamed = |numbers: &[u32], number: u32| {
            let index = usize::try_from(number).ok();
            index.and_then(|index| numbers.get(index)).copied().unwrap_or(number)
        };
        for sighting in travel.steps.iter_mut().flat_map(|step| &mut step.sightings) {
            sighting.landmark_type = renamed(&types, sighting.landmark_type);
            sighting.identity = sighting.identity.map(|number| renamed(&identities, number));
        }
        travel
    }
}

/// The numbers of these names among all, to which new ones are added.
fn numbers(all: &mut Vec<String>, names: &[String]) -> Vec<u32> {
    names.iter().map(|name| number(all, name)).collect()
}

fn number(all: &mut Vec<String>, name: &str) -> u32 {
    let known = all.iter().position(|known| known == name);
    let index = known.unwrap_or_else(|| {
        all.push(name.to_owned());
        all.len() - 1
    });
    u32::try_from(index).unwrap_or(u32::MAX)
}
