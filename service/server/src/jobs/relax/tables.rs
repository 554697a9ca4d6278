//! What expectation maximisation knew at the end of where the robot was at a step: made again from
//! the last iteration that the job kept.

use std::ops::ControlFlow;

use meetpoint_proto::v1;
use meetpoint_relaxation::{Belief, PoseGrid};
use meetpoint_storage::{JobRecord, SessionId};

use super::grid_landmarks::with_grid_landmarks;
use super::saved::{Method, Saved};
use super::solver;
use super::stations::stations;
use super::way::way_now;
use crate::convert::job;
use crate::convert::table_picture::Table;
use crate::{error::Error, service::Service};

/// Which table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Which {
    /// From what came before the step, and what was seen at it.
    Alpha,
    /// From what came after it.
    Beta,
    /// From all.
    Posterior,
}

/// A table of a session that a job relaxed, at a step from 0 on; `None` if the job kept none, or the
/// step is beyond the last.
pub(crate) async fn table(
    service: &Service,
    record: &JobRecord,
    id: SessionId,
    (which, step): (Which, usize),
) -> Result<Option<Table>, Error> {
    let Some(checkpoint) = &record.checkpoint else { return Ok(None) };
    let saved = Saved::from_bytes(checkpoint)?;
    let planned = saved.sessions.iter().find(|planned| planned.session == id);
    let kept = saved.tables.into_iter().find(|kept| kept.session == id);
    let (Some(planned), Some(kept)) = (planned, kept) else { return Ok(None) };
    let session = service.session_record(&id.0.to_string()).await?;
    let method = planned.method;
    let is_of_grid = method == Method::GridLandmarks;
    let limit = is_of_grid.then_some(service.settings.jobs.scans_bytes_max);
    let Ok(way) = way_now(service, &session, planned.through, limit).await? else {
        return Ok(None);
    };
    let v1::RelaxParams { forget_identities, estimate_odometry, .. } =
        job::relax_params(&record.params)?;
    let drawn = tokio::task::spawn_blocking(move || {
        let course = if is_of_grid {
            with_grid_landmarks(way, |_| ControlFlow::Continue(())).ok()??.course
        } else {
            way.course
        };
        let travel = stations(&course, forget_identities).travel;
        if travel.steps.len() <= step {
            return None;
        }
        let params = solver::params(&travel, solver::Reckoning::of(method, estimate_odometry));
        let state = meetpoint_relaxation::Relaxation::from_bytes(&travel, params, &kept.state);
        let state = state.ok()?;
        let em = state.em()?;
        let belief = match which {
            Which::Alpha => em.alphas().into_iter().nth(step)?,
            Which::Beta => em.beta(step),
            Which::Posterior => em.posterior().beliefs.into_iter().nth(step)?,
        };
        Some(over_places(&belief, em.grid()))
    });
    drawn.await.map_err(Error::internal)
}

fn over_places(belief: &Belief, grid: &PoseGrid) -> Table {
    Table { width: n_columns(grid), values: belief.over_positions(grid) }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "columns of a grid")]
pub(super) fn n_columns(grid: &PoseGrid) -> usize {
    let area = grid.area();
    ((area.max.x - area.min.x) / grid.resolution_m()).round() as usize + 1
}
