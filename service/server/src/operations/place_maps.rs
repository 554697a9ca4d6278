//! What was seen of the places of a travel: local perceptual maps with their stars.

use meetpoint_places::LargeScaleStar;
use meetpoint_proto::v1;
use meetpoint_storage::{BatchPayload, SessionId};

use super::hypotheses::found;
use crate::convert::grid::{self, Drawn};
use crate::convert::{hypothesis, place_map, sensor, session};
use crate::error::Error;
use crate::hypotheses::{Around, DrawnPlace, Moment, drawn_place};
use crate::service::Service;

/// Batches read before the one of the visit, and as many from it on: a minute of a robot that sends each second.
const N_BATCHES_BESIDE: u32 = 64;
/// Visits that are looked through for one that has scans, where none is named.
const N_VISITS_TRIED: usize = 8;

/// A place of a hypothesis, before it is drawn.
struct Meant {
    reply: v1::GetPlaceMapResponse,
    /// The visits to be drawn, the first that can be; each with its star as it was told.
    tried: Vec<(u32, Moment, String)>,
}

impl Service {
    /// What was seen of a place.
    pub(crate) async fn get_place_map(
        &self,
        request: v1::GetPlaceMapRequest,
    ) -> Result<v1::GetPlaceMapResponse, Error> {
        let v1::GetPlaceMapRequest { tree, hypothesis, place, visit, picture } = request;
        let asked = self.asked(tree).await?;
        let session = asked.session;
        let Meant { reply, tried } = self
            .with_tree(asked, move |name, travelled, tree| {
                let of = found(travelled, tree, &hypothesis)?;
                let told = hypothesis::hypothesis(travelled, tree, of);
                let numbered = (0_u32..).zip(&told.visits);
                let visits = numbered.filter(|(_, at)| **at == place).map(|(number, _)| number);
                let visits: Vec<u32> = visits.collect();
                if visits.is_empty() {
                    return Err(Error::NoSuchPlace(place));
                }
                let travel = travelled.travel().unwrap_or_else(|| tree.maps().travel().clone());
                let meant = visits.iter().copied().filter(|at| visit.is_none_or(|it| it == *at));
                let tried = meant.take(N_VISITS_TRIED).filter_map(|number| {
                    let moment = travelled.moments().get(number as usize).copied()?;
                    Some((number, moment, travel.seen(number as usize)?.star.to_string()))
                });
                let tried: Vec<_> = tried.collect();
                if tried.is_empty() {
                    let problem = format!("{} was to another place", visit.unwrap_or(0));
                    return Err(Error::field("visit", problem));
                }
                let reply = v1::GetPlaceMapResponse {
                    tree: Some(hypothesis::tree(name, travelled, tree)),
                    hypothesis: told.id,
                    place,
                    visits,
                    ..v1::GetPlaceMapResponse::default()
                };
                Ok(Meant { reply, tried })
            })
            .await?;
        let map = reply.tree.as_ref().and_then(|tree| tree.name.clone()).unwrap_or_default().map;
        for (visit, moment, star_told) in tried {
            if let Some(drawn) = self.drawn_place(session, moment).await? {
                let known = v1::GetPlaceMapResponse { visit, star_told, ..reply };
                return Ok(answer(known, map, &drawn, picture));
            }
        }
        Err(Error::PlaceNotScanned(place))
    }

    async fn drawn_place(
        &self,
        session: SessionId,
        moment: Moment,
    ) -> Result<Option<DrawnPlace>, Error> {
        let record = self.session_record(&session.0.to_string()).await?;
        let sensors = sensor::sensors(&session::declaration(&record.declaration)?.sensors)?;
        let first = moment.batch.saturating_sub(u64::from(N_BATCHES_BESIDE)).max(1);
        let mut batches = self.store.session_batches(session, first, 2 * N_BATCHES_BESIDE).await?;
        keep_run(&mut batches, moment.batch);
        let ends = [batches.first(), batches.last()].map(|end| end.map_or(0, |end| end.number));
        let has_more = [1 < ends[0], ends[1] < record.acked_through];
        let _permit = self.planner.searching.acquire().await.map_err(|_| Error::Stopping)?;
        let drawing = tokio::task::spawn_blocking(move || {
            drawn_place(&Around { sensors: &sensors, batches: &batches, has_more, moment })
        });
        drawing.await.map_err(Error::internal)?
    }
}

/// Keeps the batches that hang together with one, without a number left out.
fn keep_run(batches: &mut Vec<BatchPayload>, middle: u64) {
    let Some(at) = batches.iter().position(|batch| batch.number == middle) else {
        batches.clear();
        return;
    };
    let follows = |pair: &[BatchPayload]| pair[0].number + 1 == pair[1].number;
    let after = batches[at..].windows(2).take_while(|pair| follows(pair)).count();
    let before = batches[..=at].windows(2).rev().take_while(|pair| follows(pair)).count();
    batches.truncate(at + after + 1);
    batches.drain(..at - before);
}

fn answer(
    known: v1::GetPlaceMapResponse,
    map: String,
    drawn: &DrawnPlace,
    has_picture: bool,
) -> v1::GetPlaceMapResponse {
    let raster = &drawn.map.raster;
    let found = drawn.found();
    let states = found.map(|local| LargeScaleStar::from(local.small_scale_star.clone()));
    let star_found = found.zip(drawn.came_in_by).map(|(local, by)| local.star.read_from(by));
    let star = found.zip(drawn.place).map(|(local, id)| place_map::alone(id, local, &drawn.parsed));
    let not_a_place = match star {
        Some(_) => String::new(),
        None => "ways neither meet nor end here as far as was seen: a path passes".to_owned(),
    };
    v1::GetPlaceMapResponse {
        grid: Some(grid::to_wire(raster, Drawn { map, version: 0, cost_revision: 0, frame: None })),
        png: if has_picture { meetpoint_occupancy::png(raster) } else { Vec::new() },
        scans: hypothesis::small(drawn.n_scans),
        cut_short: drawn.is_cut_short,
        robot: Some(place_map::pose(drawn.robot)),
        star,
        not_a_place,
        came_in_by: drawn.came_in_by.map(u32::from),
        star_found: star_found.map_or_else(String::new, |star| star.to_string()),
        states: states.as_ref().map_or_else(Vec::new, place_map::states),
        ..known
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn batches_around_a_hole_are_left_out() {
        let batch = |number| BatchPayload { number, payload: Vec::new(), rejected: Vec::new() };
        let kept = |middle| {
            let mut batches: Vec<BatchPayload> = [2, 3, 5, 6, 7, 9].map(batch).into();
            keep_run(&mut batches, middle);
            batches.iter().map(|batch| batch.number).collect::<Vec<_>>()
        };
        assert_eq!(kept(6), [5, 6, 7], "between two holes");
        assert_eq!(kept(2), [2, 3], "from the first on");
        assert!(kept(4).is_empty(), "the visit's own was skipped");
    }
}
