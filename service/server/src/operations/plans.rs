//! Plans: paths, matrices, next motions, nearest points, reachable areas.

use std::sync::Arc;
use std::time::Instant;

use meetpoint_planning::nearest_enterable;
use meetpoint_proto::v1;

use super::maps::shortened;
use crate::convert::plan::{
    End, basis, choice, code, length_m, micros, path_to_wire, point, point_to_wire,
};
use crate::planning::{
    self, Choice, Field, Located, Motion, Nowhere, PathAnswer, PathQuery, Profile, locate,
};
use crate::{error::Error, service::Service};

/// Alternatives that can be asked for.
const N_ALTERNATIVES_MAX: u32 = 8;
/// How far a nearest point is looked for where nothing is said, in metres.
const NEAREST_DEFAULT_M: f64 = 10.0;
/// And at most: more takes long.
const NEAREST_MAX_M: f64 = 50.0;

/// The fields to ask for a robot, one after the other.
struct Fields<'a> {
    service: &'a Service,
    standing: planning::Standing,
    version: u64,
    profiles: std::vec::IntoIter<Profile>,
}

impl Fields<'_> {
    /// The next field; `None` if there is none left.
    async fn next(&mut self) -> Result<Option<Arc<Field>>, Error> {
        let Some(profile) = self.profiles.next() else { return Ok(None) };
        self.service.field(&self.standing, self.version, &profile).await.map(Some)
    }

    /// Whether an answer that is not good can be had otherwise.
    fn is_last(&self) -> bool {
        self.profiles.len() == 0
    }
}

impl Service {
    /// The shortest path between two points, and others.
    pub(crate) async fn plan_path(
        &self,
        request: v1::PlanPathRequest,
    ) -> Result<v1::PlanPathResponse, Error> {
        if !request.hypothesis.is_empty() {
            return self.plan_path_of_places(request).await;
        }
        if let Some(field) = of_places(&request) {
            return Err(Error::field(field, "only together with `hypothesis`"));
        }
        let v1::PlanPathRequest {
            map,
            start,
            goal,
            robot,
            mode,
            alternatives,
            map_version,
            route_only,
            cells,
            hypothesis: _,
            tree: _,
            from_place: _,
            to_place: _,
        } = request;
        let mode = v1::PlanMode::try_from(mode)
            .map_err(|_| Error::field("mode", format!("{mode} is no mode")))?;
        if N_ALTERNATIVES_MAX < alternatives {
            let problem = format!("{alternatives}, at most {N_ALTERNATIVES_MAX} are given");
            return Err(Error::field("alternatives", problem));
        }
        let query = PathQuery {
            start: point("start", start)?,
            goal: point("goal", goal)?,
            n_alternatives: alternatives as usize,
            is_dense: !route_only,
            with_cells: cells,
            tolerance_m: self.settings.planning.snap_tolerance_m,
        };
        let asked = choice(robot)?;
        let begun = Instant::now();
        let mut fields = self.fields(&map, map_version, &asked).await?;
        while let Some(field) = fields.next().await? {
            let answer = self.path_in(&field, query, mode).await?;
            if answer.best.is_some() || fields.is_last() {
                let mut reply = self.path_reply(&field, &query, answer).await?;
                reply.warnings.extend(taken_larger(&asked, &field));
                reply.planning_time_us = micros(begun.elapsed());
                return Ok(reply);
            }
        }
        Err(Error::internal("no field to plan in"))
    }

    /// A path in one field, on this thread if it is a matter of microseconds.
    async fn path_in(
        &self,
        field: &Arc<Field>,
        query: PathQuery,
        mode: v1::PlanMode,
    ) -> Result<PathAnswer, Error> {
        let is_exact = matches!(mode, v1::PlanMode::Unspecified | v1::PlanMode::Exact);
        if is_exact && query.n_alternatives == 0 && field.plans().is_some() {
            return Ok(planning::plan(field, &query));
        }
        self.searched(field, move |field| match mode {
            v1::PlanMode::Unspecified | v1::PlanMode::Exact => planning::plan(field, &query),
            v1::PlanMode::Triplet => planning::plan_by_triplets(field, &query),
            v1::PlanMode::Paper => planning::plan_as_paper(field, &query),
        })
        .await
    }

    async fn path_reply(
        &self,
        field: &Arc<Field>,
        query: &PathQuery,
        answer: PathAnswer,
    ) -> Result<v1::PlanPathResponse, Error> {
        let PathAnswer { start, goal, best, alternatives, by_tables } = answer;
        let mut reply = v1::PlanPathResponse {
            basis: Some(basis(field, by_tables)),
            code: v1::PlanCode::Ok.into(),
            warnings: moved(&[("start", start), ("goal", goal)]),
            ..v1::PlanPathResponse::default()
        };
        let snapped = |end: Result<Located, Nowhere>| {
            end.ok().filter(|end| 0.0 < end.moved_m).map(|end| point_to_wire(end.point))
        };
        (reply.snapped_start, reply.snapped_goal) = (snapped(start), snapped(goal));
        if let Some(best) = best {
            reply.path = Some(path_to_wire(field, best));
            reply.alternatives =
                alternatives.into_iter().map(|path| path_to_wire(field, path)).collect();
            if 0 < query.n_alternatives && !by_tables {
                reply.warnings.push(
                    "alternatives are found by plan tables, which are still being made".to_owned(),
                );
            }
            return Ok(reply);
        }
        let ends = [(End::Start, start, query.start), (End::Goal, goal, query.goal)];
        let (code, what_to_do) = self.advice(field, ends).await?;
        (reply.code, reply.what_to_do) = (code.into(), what_to_do);
        Ok(reply)
    }

    /// Why there is no path, and what can be done.
    async fn advice(
        &self,
        field: &Arc<Field>,
        ends: [(End, Result<Located, Nowhere>, meetpoint_geometry::Point2<f64>); 2],
    ) -> Result<(v1::PlanCode, String), Error> {
        let advised = self.searched(field, move |field| {
            for (end, located, asked) in ends {
                if let Err(why) = located {
                    return (code(end, why), planning::nowhere(field, end.name(), asked, why));
                }
            }
            let what_to_do = match ends.map(|(_, located, _)| located) {
                [Ok(from), Ok(to)] => planning::no_route(field, from.cell, to.cell),
                _ => String::new(),
            };
            (v1::PlanCode::NoRoute, what_to_do)
        });
        advised.await
    }

    /// Costs of the paths from many to many.
    pub(crate) async fn plan_matrix(
        &self,
        request: v1::PlanMatrixRequest,
    ) -> Result<v1::PlanMatrixResponse, Error> {
        let v1::PlanMatrixRequest { map, starts, goals, robot, map_version } = request;
        let n_pairs = starts.len() as u64 * goals.len() as u64;
        let limit_pairs = self.settings.planning.matrix_pairs_max;
        if limit_pairs < n_pairs.max(starts.len() as u64).max(goals.len() as u64) {
            return Err(Error::MatrixTooLarge { n_pairs, limit_pairs });
        }
        let points = |name: &str, wire: Vec<v1::Point>| {
            let checked = |(at, wire)| point(&format!("{name}[{at}]"), Some(wire));
            wire.into_iter().enumerate().map(checked).collect::<Result<Vec<_>, Error>>()
        };
        let (starts, goals) = (points("starts", starts)?, points("goals", goals)?);
        let tolerance_m = self.settings.planning.snap_tolerance_m;
        let begun = Instant::now();
        let field = self.one_field(&map, map_version, robot).await?;
        let found = self.searched(&field, move |field| {
            let ends = |points: &[_]| {
                points.iter().map(|&point| locate(field, point, tolerance_m)).collect::<Vec<_>>()
            };
            let (starts, goals) = (ends(&starts), ends(&goals));
            let (rows, by_tables) = planning::matrix(field, &starts, &goals);
            (rows, by_tables, codes(End::Start, &starts), codes(End::Goal, &goals))
        });
        let (rows, by_tables, start_codes, goal_codes) = found.await?;
        Ok(v1::PlanMatrixResponse {
            basis: Some(basis(&field, by_tables)),
            rows: rows.into_iter().map(|lengths_m| v1::MatrixRow { lengths_m }).collect(),
            start_codes,
            goal_codes,
            planning_time_us: micros(begun.elapsed()),
        })
    }

    /// Which way to go now.
    pub(crate) async fn next_motion(
        &self,
        request: v1::NextMotionRequest,
    ) -> Result<v1::NextMotionResponse, Error> {
        let v1::NextMotionRequest { map, position, goal, robot, map_version } = request;
        let (position, goal) = (point("position", position)?, point("goal", goal)?);
        let tolerance_m = self.settings.planning.snap_tolerance_m;
        let mut fields = self.fields(&map, map_version, &choice(robot)?).await?;
        while let Some(field) = fields.next().await? {
            let look =
                move |field: &Field| planning::next_motion(field, position, goal, tolerance_m);
            let motion = match field.plans() {
                Some(_) => look(&field),
                None => self.searched(&field, look).await?,
            };
            if motion.step.is_some() || fields.is_last() {
                let ends =
                    [(End::Start, motion.position, position), (End::Goal, motion.goal, goal)];
                return self.motion_reply(&field, motion, ends).await;
            }
        }
        Err(Error::internal("no field to plan in"))
    }

    async fn motion_reply(
        &self,
        field: &Arc<Field>,
        motion: Motion,
        ends: [(End, Result<Located, Nowhere>, meetpoint_geometry::Point2<f64>); 2],
    ) -> Result<v1::NextMotionResponse, Error> {
        let basis = Some(basis(field, motion.by_tables));
        let Some(step) = motion.step else {
            let (code, what_to_do) = self.advice(field, ends).await?;
            let code = code.into();
            return Ok(v1::NextMotionResponse { code, basis, what_to_do, ..Default::default() });
        };
        Ok(v1::NextMotionResponse {
            code: v1::PlanCode::Ok.into(),
            basis,
            heading_rad: step.heading_rad,
            distance_left_m: step.distance_left_m,
            region: step.region,
            next_arc: step.next_arc,
            next_point: Some(point_to_wire(step.next)),
            what_to_do: String::new(),
        })
    }

    /// The nearest point that the robot can be at.
    pub(crate) async fn get_nearest_free_point(
        &self,
        request: v1::GetNearestFreePointRequest,
    ) -> Result<v1::GetNearestFreePointResponse, Error> {
        let v1::GetNearestFreePointRequest { map, point: wire, robot, map_version, distance_max_m } =
            request;
        let asked = point("point", wire)?;
        let distance_max_m = match length_m("distance_max_m", distance_max_m)? {
            0.0 => NEAREST_DEFAULT_M,
            distance_m if distance_m <= NEAREST_MAX_M => distance_m,
            distance_m => {
                let problem = format!("{distance_m} m, at most {NEAREST_MAX_M} m");
                return Err(Error::field("distance_max_m", problem));
            }
        };
        let field = self.one_field(&map, map_version, robot).await?;
        let look = move |field: &Field| nearest_enterable(&field.space, asked, distance_max_m);
        let found = self.searched(&field, look).await?;
        let mut reply = v1::GetNearestFreePointResponse {
            basis: Some(basis(&field, field.plans().is_some())),
            ..Default::default()
        };
        if let Some(found) = found {
            reply.point = Some(point_to_wire(found.point));
            reply.distance_m = found.moved_m;
            reply.region = field.ground.region_id_at(found.cell);
        }
        Ok(reply)
    }

    /// How much can be reached.
    pub(crate) async fn get_reachable_area(
        &self,
        request: v1::GetReachableAreaRequest,
    ) -> Result<v1::GetReachableAreaResponse, Error> {
        let v1::GetReachableAreaRequest { map, start, robot, map_version, length_max_m } = request;
        let asked = point("start", start)?;
        let length_max_m = match length_m("length_max_m", length_max_m)? {
            0.0 => f64::INFINITY,
            length_m => length_m,
        };
        let field = self.one_field(&map, map_version, robot).await?;
        let tolerance_m = self.settings.planning.snap_tolerance_m;
        let found = self.searched(&field, move |field| match locate(field, asked, tolerance_m) {
            Ok(start) => Ok(planning::reached(field, start.cell, length_max_m)),
            Err(why) => Err((why, planning::nowhere(field, "start", asked, why))),
        });
        let basis = Some(basis(&field, false));
        Ok(match found.await? {
            Ok(areas) => v1::GetReachableAreaResponse {
                code: v1::PlanCode::Ok.into(),
                basis,
                area_m2: areas.values().sum(),
                regions: areas
                    .into_iter()
                    .filter(|(region, _)| *region != 0)
                    .map(|(region, area_m2)| v1::ReachedRegion { region, area_m2 })
                    .collect(),
                what_to_do: String::new(),
            },
            Err((why, what_to_do)) => v1::GetReachableAreaResponse {
                code: code(End::Start, why).into(),
                basis,
                what_to_do,
                ..Default::default()
            },
        })
    }

    /// The fields to ask, at least one.
    async fn fields(&self, map: &str, version: u64, choice: &Choice) -> Result<Fields<'_>, Error> {
        let standing = self.standing(map).await?;
        let profiles = standing.chosen(choice, &self.settings.planning);
        if let Choice::Named(name) = choice
            && profiles.is_empty()
        {
            return Err(Error::NoSuchProfile { map: map.to_owned(), name: shortened(name) });
        }
        Ok(Fields { service: self, standing, version, profiles: profiles.into_iter() })
    }

    /// The first field to ask.
    pub(super) async fn one_field(
        &self,
        map: &str,
        version: u64,
        robot: Option<v1::RobotChoice>,
    ) -> Result<Arc<Field>, Error> {
        let mut fields = self.fields(map, version, &choice(robot)?).await?;
        fields.next().await?.ok_or_else(|| Error::internal("no field to plan in"))
    }

    /// Runs what takes more than half a millisecond beside the async threads, a few at a time.
    pub(super) async fn searched<T: Send + 'static>(
        &self,
        field: &Arc<Field>,
        query: impl FnOnce(&Field) -> T + Send + 'static,
    ) -> Result<T, Error> {
        let _permit = self.planner.searching.acquire().await.map_err(|_| Error::Stopping)?;
        let field = field.clone();
        tokio::task::spawn_blocking(move || query(&field)).await.map_err(Error::internal)
    }
}

/// A field that is given and would be overlooked, since no map of places is asked for.
fn of_places(request: &v1::PlanPathRequest) -> Option<&'static str> {
    let given = [("from_place", request.from_place), ("to_place", request.to_place)];
    given.into_iter().find(|(_, place)| place.is_some()).map(|(name, _)| name)
}

/// What is true of each end of a matrix.
fn codes(end: End, ends: &[Result<Located, Nowhere>]) -> Vec<i32> {
    let code = |found: &Result<_, Nowhere>| match found {
        Ok(_) => v1::PlanCode::Ok,
        Err(why) => code(end, *why),
    };
    ends.iter().map(|found| code(found).into()).collect()
}

/// Tells of ends that were moved.
fn moved(ends: &[(&str, Result<Located, Nowhere>)]) -> Vec<String> {
    let warning = |&(name, end): &(&str, Result<Located, Nowhere>)| {
        let Located { point, moved_m, .. } = end.ok().filter(|end| 0.0 < end.moved_m)?;
        let (x_m, y_m) = (point.x, point.y);
        Some(format!("the {name} was moved by {moved_m:.3} m to ({x_m:.3}, {y_m:.3}) m"))
    };
    ends.iter().filter_map(warning).collect()
}

/// Tells that the answer holds for a larger robot than the one asked for.
fn taken_larger(asked: &Choice, field: &Field) -> Option<String> {
    let Choice::Radius(asked_m) = asked else { return None };
    let Profile { name, radius_m, .. } = &field.profile;
    (asked_m < radius_m).then(|| {
        format!(
            "planned for the profile `{name}` of {radius_m} m radius, the next above {asked_m} m"
        )
    })
}
