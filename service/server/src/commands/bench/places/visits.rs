//! A robot with a laser that drives from place to place of a plan, and what it knows at each.

use meetpoint_geometry::{Point2, Pose};
use meetpoint_occupancy::{BeamModel, Raster};
use meetpoint_places::{
    Gateway, LocalParams, LocalPerceptualMap, LocalPlace, ParsedMap, PlaceId, ScrollingMap,
};
use meetpoint_sim::{Building, ChaCha8Rng, Drive, Laser, OdometryError, Robot};
use rand::SeedableRng;

/// A robot with a laser that looks all around, every half degree: with fewer beams cells between them are
/// not seen across a room.
const ROBOT: Robot = Robot {
    radius_m: 0.15,
    n_ticks_per_scan: 4,
    laser: Laser {
        angle_min_rad: -std::f64::consts::PI,
        angle_increment_rad: std::f64::consts::PI / 360.0,
        n_beams: 720,
        range_max_m: 10.0,
        ..Laser::INDOOR
    },
    ..Robot::INDOOR
};

/// Edge of the scrolling map, in metres.
const SIDE_M: f64 = 16.0;

/// A robot this near to the core of a place is there, in metres: ways are smoothed.
const THERE_M: f64 = 0.6;

/// What a robot knows when it comes to a place.
pub(super) struct Visit {
    /// The core of the place, as the plan has it.
    pub(super) core: Point2<f64>,
    local: LocalPerceptualMap,
    local_from_robot: Pose,
    /// Where the frame of the local map truly is at that moment.
    map_from_local: Pose,
}

impl Visit {
    /// The place that the robot finds in its local map, in the frame of the plan.
    pub(super) fn seen(&self, params: &LocalParams) -> Option<LocalPlace> {
        let found = self.local.place_at(self.local_from_robot.position(), params)?;
        Some(found.in_frame(self.map_from_local))
    }
}

/// Those of the places that a robot gets to from the first of them.
fn reachable(
    building: &Building,
    (map_from_building, robot): (Pose, Robot),
    cores: Vec<(PlaceId, Point2<f64>)>,
) -> Vec<(PlaceId, Point2<f64>)> {
    let in_building = |core: Point2<f64>| map_from_building.inverse() * core;
    let Some(&(first, start)) = cores.first() else { return cores };
    let is_reached = |&(id, core): &(PlaceId, Point2<f64>)| {
        let way = [in_building(start), in_building(core)];
        let rng = ChaCha8Rng::seed_from_u64(1);
        id == first || Drive::new(building, robot, &way, 0, rng).is_some()
    };
    cores.into_iter().filter(is_reached).collect()
}

/// The visits of one drive to all places that hang together with the widest and a robot of that size gets to; `None`
/// if it cannot even start.
pub(super) fn visits(
    plan: &Raster,
    parsed: &ParsedMap,
    odometry_error: OdometryError,
) -> Option<Vec<Visit>> {
    let walls = plan.log_odds.iter().map(|&odds| odds.is_nan() || 0.0 <= odds).collect();
    let frame = plan.info.frame;
    let building = Building::from_cells(walls, plan.info.width, frame.resolution_m()).ok()?;
    let corner = plan.info.origin();
    let map_from_building = Pose::new(corner.x, corner.y, 0.0);
    let mut order = in_order(parsed);
    // Where it starts a robot has seen one scan; it comes back at the end.
    order.extend(order.first().copied());
    let core = |id: PlaceId| parsed.places().find(|(other, _)| *other == id).map(|(_, p)| p.core);
    let cores: Vec<(PlaceId, Point2<f64>)> =
        order.into_iter().filter_map(|id| Some((id, core(id)?))).collect();
    let robot = Robot { odometry_error, ..ROBOT };
    let n_asked = cores.len();
    let cores = reachable(&building, (map_from_building, robot), cores);
    if cores.len() < n_asked {
        eprintln!("{} places are too narrow for the robot: left out", n_asked - cores.len());
    }
    let waypoints: Vec<Point2<f64>> =
        cores.iter().map(|(_, core)| map_from_building.inverse() * *core).collect();
    let drive = Drive::new(&building, robot, &waypoints, 0, ChaCha8Rng::seed_from_u64(1))?;
    let geometry = ROBOT.laser.geometry();
    let mut map = ScrollingMap::new(frame, SIDE_M, 0.5);
    let (mut visits, mut next) = (vec![], cores.iter().peekable());
    for tick in drive {
        let Some(ranges_m) = &tick.scan else { continue };
        let scan = (&geometry, ranges_m.as_slice());
        map.insert_scan(tick.odometry, ROBOT.laser.robot_from_laser, scan, &BeamModel::INDOOR);
        let truth = map_from_building * tick.truth;
        let Some((_, core)) = next.peek() else { break };
        if (truth.position() - core).norm() <= THERE_M {
            visits.push(Visit {
                core: *core,
                local: map.local_map(),
                local_from_robot: tick.odometry,
                map_from_local: truth * tick.odometry.inverse(),
            });
            next.next();
        }
    }
    Some(visits)
}

/// The places as one meets them who explores: from the widest on, always the nearest gateway that
/// leads to another one, and back where there is none.
fn in_order(parsed: &ParsedMap) -> Vec<PlaceId> {
    let mut order: Vec<PlaceId> = vec![];
    let mut open: Vec<PlaceId> = parsed.places().take(1).map(|(id, _)| id).collect();
    while let Some(place) = open.pop() {
        if order.contains(&place) {
            continue;
        }
        order.push(place);
        let n_gateways = parsed.map.place(place).map_or(0, |place| place.star.n_gateways());
        let leads = |index| Some(parsed.map.leads_to(Gateway { place, index })?.place);
        open.extend((0..n_gateways).rev().filter_map(leads));
    }
    order
}
