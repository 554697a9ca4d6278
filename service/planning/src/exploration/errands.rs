//! Who goes where: the nearest robot first, and no two to what one of them will see.

use meetpoint_geometry::Point2;

use super::chart::Chart;
use crate::nearest::Nearest;
use crate::smooth::{Passage, SmoothScratch, smooth};
use crate::value_iteration::{Ground, ValueIteration};

/// What a robot is to do.
#[derive(Clone, Debug, PartialEq)]
pub enum Errand {
    /// Go there.
    Go(Way),
    /// Nothing: it can reach nothing that is unexplored.
    Explored,
    /// Nothing: all that it can reach will be seen by the others.
    LeftToOthers,
    /// It cannot be where it says that it is: it would touch something, farther than can be put
    /// down to an error of its pose.
    Occupied,
    /// It is outside of the cells asked about, or nowhere.
    Outside,
}

/// A way to what is unexplored.
#[derive(Clone, Debug, PartialEq)]
pub struct Way {
    /// Centre of the nearest unexplored cell, in metres.
    pub goal: Point2<f64>,
    /// Where the way starts, turns and ends, in metres; at least one point, the last the goal.
    pub points: Vec<Point2<f64>>,
    /// Length of the way, in metres.
    pub length_m: f64,
    /// Where to head for now, in radians from +x, counter-clockwise: along the first piece of the
    /// way. `None` if the robot is there.
    pub heading_rad: Option<f64>,
    /// The value of the robot's cell: what the way costs, in costs of cells.
    pub cost: f32,
    /// How far the robot was moved to where it can be, in metres.
    pub moved_m: f64,
}

/// What robots at `points`, which stand in `places`, are to do. The values are left as they were.
pub(super) fn errands(
    chart: &Chart,
    values: &mut ValueIteration,
    points: &[Point2<f64>],
    places: &[Option<Nearest>],
) -> Vec<Errand> {
    let idle = |(&point, place): (&Point2<f64>, &Option<Nearest>)| match place {
        None if chart.is_outside(point) => Errand::Outside,
        None => Errand::Occupied,
        Some(place) if values.value(place.cell).is_finite() => Errand::LeftToOthers,
        Some(_) => Errand::Explored,
    };
    let mut errands: Vec<Errand> = points.iter().zip(places).map(idle).collect();
    let mut waiting: Vec<usize> =
        (0..points.len()).filter(|&robot| errands[robot] == Errand::LeftToOthers).collect();
    let mut taken = vec![];
    while let Some((robot, place)) = nearest(values, &waiting, places) {
        let cells = values.path(place.cell);
        let Some(&goal) = cells.last() else { break };
        errands[robot] = Errand::Go(way(chart, &place, points[robot], &cells, values));
        waiting.retain(|&other| other != robot);
        if waiting.is_empty() {
            break;
        }
        for cell in chart.seen_from(goal) {
            values.set(cell, Ground { cost: f32::INFINITY, is_goal: false });
            taken.push(cell);
        }
        values.settle(u32::MAX);
    }
    for &cell in &taken {
        values.set(cell, chart.ground[cell]);
    }
    if !taken.is_empty() {
        values.settle(u32::MAX);
    }
    errands
}

/// The robot with the cheapest way to a goal, the first of equals; `None` if there is none.
fn nearest(
    values: &ValueIteration,
    waiting: &[usize],
    places: &[Option<Nearest>],
) -> Option<(usize, Nearest)> {
    let placed = waiting.iter().filter_map(|&robot| Some((robot, places[robot]?)));
    let able = placed.filter(|(_, place)| values.value(place.cell).is_finite());
    able.min_by(|(_, a), (_, b)| values.value(a.cell).total_cmp(&values.value(b.cell)))
}

fn way(
    chart: &Chart,
    place: &Nearest,
    robot: Point2<f64>,
    cells: &[usize],
    values: &ValueIteration,
) -> Way {
    let center = |cell: usize| chart.info.frame.center_of(values.cell(cell));
    let goal = center(cells[cells.len() - 1]);
    let passage = Passage {
        obstacles: &chart.obstacles,
        radius_m: chart.params.radius_m,
        weights: None,
        start: place.point,
        goal,
    };
    let path = smooth(&passage, cells.iter().copied(), &mut SmoothScratch::default());
    let ahead = path.points.iter().map(|&point| point - robot);
    // Nearer than a hundredth of a cell there is no direction.
    let here_m = 0.01 * chart.info.frame.resolution_m();
    let ahead = ahead.into_iter().find(|step| here_m < step.norm());
    Way {
        goal,
        points: path.points,
        length_m: path.length_m,
        heading_rad: ahead.map(|step| step.y.atan2(step.x)),
        cost: values.value(place.cell),
        moved_m: place.moved_m,
    }
}
