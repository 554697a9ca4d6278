//! Exploration: where robots go to see what nobody has seen.

use std::sync::Arc;
use std::time::Instant;

use meetpoint_geometry::{Point2, Pose};
use meetpoint_occupancy::Grid;
use meetpoint_planning::{Errand, Exploration, Explored, Known, Shape, exploration_rectangle};
use meetpoint_proto::v1;
use meetpoint_storage::{MapId, PoseRecord, RobotId, SessionId, SessionRecord};

use super::maps::shortened;
use crate::convert::exploration::{
    Asked, Explorer, N_EXPLORERS_MAX, asked, frontiers_to_wire, robot_to_wire,
};
use crate::convert::{plan, pose, value_picture};
use crate::planning::{Choice, Standing, barred, closed};
use crate::{error::Error, service::Service};

/// Open sessions on a map that are looked at. A robot has one, its newest.
const N_SESSIONS_MAX: u32 = 1000;

/// The grid that is explored.
struct Ground {
    grid: Arc<Grid>,
    /// The newest version, or the one asked for; 0 before the first.
    version: u64,
    is_live: bool,
}

impl Service {
    /// The next goal of every robot, and how much is unexplored.
    pub(crate) async fn get_exploration(
        &self,
        request: v1::GetExplorationRequest,
    ) -> Result<v1::GetExplorationResponse, Error> {
        let begun = Instant::now();
        let v1::GetExplorationRequest { map, explorers, robot, map_version, picture, session } =
            request;
        let (asked, choice) = (asked(explorers)?, plan::choice(robot)?);
        let standing = self.standing(&map).await?;
        let radius_m = self.radius_m(&standing, choice)?;
        let frame = self.explored_frame(&standing.map, &session).await?;
        let ground = self.explored_ground(&standing.map, frame, map_version).await?;
        let (obstacles, missing_arcs) = match frame {
            None => self.obstacles(&standing, ground.version).await?,
            Some(_) => Default::default(),
        };
        let explorers = self.explorers(&standing.map, asked, (frame, ground.version)).await?;
        let of_grid = (&*ground.grid, radius_m);
        let exploration = self.planner.explorations.of(&standing.map, frame, of_grid);
        let points: Vec<_> = placed(&explorers).collect();
        let question = Question {
            grid: ground.grid,
            obstacles,
            points,
            radius_m,
            picture,
            n_cells_max: self.settings.limits.grid_cells_max,
        };
        // One after the other, and who waits for that keeps no other query waiting.
        let mut held = exploration.clone().lock_owned().await;
        let _permit = self.planner.searching.acquire().await.map_err(|_| Error::Stopping)?;
        let answering = tokio::task::spawn_blocking(move || question.answer(&mut held));
        let (explored, n_cells, png) = answering.await.map_err(Error::internal)??;
        self.planner.explorations.forget_large(&exploration, n_cells);
        let frontier_m = explored.frontier_m();
        let Explored { errands, frontiers, observed_m2, reached_m2, settled: _ } = explored;
        let is_explored = !errands.is_empty() && errands.iter().all(|it| *it == Errand::Explored);
        let mut errands = errands.into_iter();
        let robots = explorers.into_iter().map(|explorer| {
            let errand = explorer.map_from_robot.and_then(|_| errands.next());
            robot_to_wire(explorer, errand)
        });
        let exploration = v1::Exploration {
            map: standing.map.0,
            map_version: ground.version,
            cost_revision: standing.costs.revision(),
            live: ground.is_live,
            robot_radius_m: radius_m,
            robots: robots.collect(),
            explored: is_explored,
            frontiers: frontiers_to_wire(frontiers),
            frontier_m,
            observed_m2,
            reached_m2,
            planning_time_us: plan::micros(begun.elapsed()),
            frame_session: frame.map(name_of).unwrap_or_default(),
            missing_arcs,
        };
        Ok(v1::GetExplorationResponse { exploration: Some(exploration), png })
    }

    /// Radius of the robots that are asked about, in metres.
    fn radius_m(&self, standing: &Standing, choice: Choice) -> Result<f64, Error> {
        match choice {
            Choice::Radius(radius_m) => Ok(radius_m),
            Choice::Named(name) => {
                let mut profiles = standing.profiles(&self.settings.planning).into_iter();
                let found = profiles.find(|profile| profile.name == name);
                let map = standing.map.0.clone();
                let missing = || Error::NoSuchProfile { map, name: shortened(&name) };
                Ok(found.ok_or_else(missing)?.radius_m)
            }
        }
    }

    /// The session in whose frame a session maps, on this map; `None`, the map's, where none is named.
    async fn explored_frame(&self, map: &MapId, session: &str) -> Result<Option<SessionId>, Error> {
        if session.is_empty() {
            return Ok(None);
        }
        let (of_map, frame) = self.session_frame(session).await?;
        if of_map != *map {
            return Err(Error::field("session", "is one of another map"));
        }
        Ok(Some(frame))
    }

    /// What people drew and closed on the map, by the arcs of a version, and the ids of closed arcs that
    /// it lacks.
    async fn obstacles(
        &self,
        standing: &Standing,
        version: u64,
    ) -> Result<(Vec<Shape>, Vec<u64>), Error> {
        let costs = &standing.costs;
        let mut obstacles: Vec<Shape> = costs.obstacles().cloned().collect();
        let closed: Vec<u64> = closed(costs).collect();
        if closed.is_empty() || version == 0 {
            return Ok((obstacles, closed));
        }
        match self.version_topology(&standing.map.0, version).await {
            Ok(found) => {
                let (bars, missing) = barred(&found.topology, costs);
                obstacles.extend(bars);
                Ok((obstacles, missing))
            }
            Err(Error::NoGraph { .. } | Error::MapTooLarge { .. }) => Ok((obstacles, closed)),
            Err(error) => Err(error),
        }
    }

    /// The grid of a version in the map's frame or a session's, or for 0 the one that grows: its newest
    /// version where it is not in memory.
    async fn explored_ground(
        &self,
        map: &MapId,
        frame: Option<SessionId>,
        version: u64,
    ) -> Result<Ground, Error> {
        if 0 < version {
            let found = self.frame_grid(&map.0, version, frame).await?;
            return Ok(Ground { grid: found.grid, version, is_live: false });
        }
        let live = self.actors.live_grid(map, frame).await;
        let newest = self.store.versions(map, None, 1).await?;
        let newest = newest.first().map_or(0, |version| version.number);
        match live {
            Some(grid) => Ok(Ground { grid: Arc::new(grid), version: newest, is_live: true }),
            None if newest == 0 => Err(Error::NothingObserved),
            None => {
                let grid = self.frame_grid(&map.0, newest, frame).await?.grid;
                Ok(Ground { grid, version: newest, is_live: false })
            }
        }
    }

    /// Those who are asked about, with their poses in a frame, by a version where nothing is newer; all
    /// with an open session if nobody is asked about.
    async fn explorers(
        &self,
        map: &MapId,
        asked: Vec<Asked>,
        seen_in: (Option<SessionId>, u64),
    ) -> Result<Vec<Explorer>, Error> {
        let mut explorers = Vec::new();
        if asked.is_empty() {
            let open = self.store.open_sessions(map, None, N_SESSIONS_MAX).await?;
            let n = open.len();
            if N_EXPLORERS_MAX < n {
                let problem = format!("empty, for {n} robots; at most {N_EXPLORERS_MAX} are taken");
                return Err(Error::field("explorers", problem));
            }
            for session in open {
                explorers.push(self.explorer(session, seen_in).await?);
            }
        }
        for asked in asked {
            explorers.push(match asked {
                Asked::Position(Point2 { coords: at }) => {
                    let map_from_robot = Some(Pose::new(at.x, at.y, 0.0));
                    Explorer { map_from_robot, ..Explorer::default() }
                }
                Asked::Robot(name) => {
                    let robot = RobotId(name.clone());
                    if self.store.robot(&robot).await?.is_none() {
                        return Err(Error::NoSuchRobot(shortened(&name)));
                    }
                    let open = self.store.open_sessions(map, Some(&robot), N_SESSIONS_MAX);
                    match open.await?.pop() {
                        Some(session) => self.explorer(session, seen_in).await?,
                        None => Explorer { robot: name, ..Explorer::default() },
                    }
                }
            });
        }
        Ok(explorers)
    }

    /// Where the robot of a session is in a frame: at its newest pose, or at the last one of a version if
    /// nothing came since the service was started.
    async fn explorer(
        &self,
        session: SessionRecord,
        (frame, version): (Option<SessionId>, u64),
    ) -> Result<Explorer, Error> {
        let explorer = Explorer {
            robot: session.robot.0.clone(),
            session: session.id.0.to_string(),
            ..Explorer::default()
        };
        let progress = self.live.session(session.id);
        if let Some(newest) = progress.and_then(|progress| progress.correction) {
            if newest.frame_session != frame.map(name_of).unwrap_or_default() {
                return Ok(Explorer { elsewhere: Some(newest.frame_session), ..explorer });
            }
            let map_from_robot = newest.map_from_robot;
            let map_from_robot = map_from_robot.map(|wire| pose::pose("map_from_robot", wire));
            let map_from_robot = map_from_robot.transpose()?;
            return Ok(Explorer { map_from_robot, stamp_ns: newest.stamp_ns, ..explorer });
        }
        if session.frame != frame {
            let elsewhere = Some(session.frame.map(name_of).unwrap_or_default());
            return Ok(Explorer { elsewhere, ..explorer });
        }
        let of_map = session.map_from_session.filter(|_| frame.is_none());
        let map_from_session = pose::from_record(of_map.unwrap_or(session.frame_from_session));
        if version == 0 {
            return Ok(explorer);
        }
        let Some(last) = self.last_pose(session.id, version).await? else { return Ok(explorer) };
        let session_from_robot = Pose::new(last.x_m, last.y_m, last.theta_rad);
        let map_from_robot = Some(map_from_session * session_from_robot);
        Ok(Explorer { map_from_robot, stamp_ns: last.stamp_ns, ..explorer })
    }

    /// The last pose of a session's trajectory in a version, in the session's frame.
    async fn last_pose(
        &self,
        session: SessionId,
        version: u64,
    ) -> Result<Option<PoseRecord>, Error> {
        let Some(extent) = self.store.trajectory(session, version, 0, 0).await? else {
            return Ok(None);
        };
        let last = extent.n_poses.saturating_sub(1);
        let page = self.store.trajectory(session, version, last, 1).await?;
        Ok(page.and_then(|mut page| page.poses.pop()))
    }
}

/// A session as the wire names it.
fn name_of(SessionId(id): SessionId) -> String {
    id.to_string()
}

/// Where those are who are somewhere.
fn placed(explorers: &[Explorer]) -> impl Iterator<Item = Point2<f64>> {
    explorers.iter().filter_map(|explorer| Some(explorer.map_from_robot?.position()))
}

/// What is worked on beside the async threads.
struct Question {
    grid: Arc<Grid>,
    obstacles: Vec<Shape>,
    points: Vec<Point2<f64>>,
    radius_m: f64,
    picture: bool,
    n_cells_max: u64,
}

impl Question {
    /// What is to be done, of how many cells, and the values as a picture if one is wanted.
    fn answer(self, exploration: &mut Exploration) -> Result<(Explored, usize, Vec<u8>), Error> {
        let bounds = self.grid.bounds().ok_or(Error::NothingObserved)?;
        let (n_cells, limit_cells) = (bounds.n_cells() as u64, self.n_cells_max);
        if limit_cells < n_cells {
            return Err(Error::MapTooLarge { n_cells, limit_cells });
        }
        let raster = self.grid.raster(Some(exploration_rectangle(bounds, self.radius_m)));
        let info = raster.info;
        let closed: Vec<usize> =
            self.obstacles.iter().flat_map(|shape| shape.touched(info)).collect();
        let known = Known { info, log_odds: &raster.log_odds, closed: &closed };
        let explored = exploration.explore(&known, &self.points).map_err(Error::internal)?;
        let png = if self.picture { value_picture::png(exploration)? } else { Vec::new() };
        Ok((explored, info.n_cells(), png))
    }
}
