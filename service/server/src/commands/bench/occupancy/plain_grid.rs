//! The definitions of integration, word for word: a table of cells, each beam traced column by column, and
//! each cell in reach asked of the network.

use std::collections::HashMap;

use meetpoint_geometry::{Cell, GridFrame, Point2, Pose};
use meetpoint_occupancy::{BeamModel, LaserGeometry, Network, Reading, SonarModel, SonarScan};

/// Log-odds of the cells observed so far.
pub(super) struct PlainGrid {
    frame: GridFrame,
    cells: HashMap<(i32, i32), f32>,
}

impl PlainGrid {
    pub(super) fn new(resolution_m: f64) -> Self {
        let frame = GridFrame::new(resolution_m).expect("a length");
        Self { frame, cells: HashMap::new() }
    }

    pub(super) fn log_odds(&self, cell: Cell) -> Option<f32> {
        self.cells.get(&(cell.x, cell.y)).copied()
    }

    /// A cell is hit if a beam ends in it, else missed if one crosses it; once a scan.
    pub(super) fn insert_scan(
        &mut self,
        map_from_sensor: Pose,
        geometry: &LaserGeometry,
        ranges_m: &[f32],
        model: &BeamModel,
    ) {
        let mut is_hit: HashMap<(i32, i32), bool> = HashMap::new();
        for (bearing_rad, reading) in geometry.readings(ranges_m) {
            let (range_m, hits) = match reading {
                Reading::Invalid => continue,
                Reading::Nothing => (geometry.range_max_m.min(model.clear_range_max_m), false),
                Reading::Hit(range_m) => (range_m, true),
            };
            let (sin, cos) = (map_from_sensor.theta_rad + bearing_rad).sin_cos();
            let from = map_from_sensor.position();
            let to = Point2::new(from.x + range_m * cos, from.y + range_m * sin);
            let last = self.frame.cell_at(to);
            self.crossed(from, to, |x, y| {
                let ends = hits && (x, y) == (last.x, last.y);
                let hit = is_hit.entry((x, y)).or_insert(false);
                *hit |= ends;
            });
        }
        for (cell, hit) in is_hit {
            let evidence = if hit { model.log_odds_hit } else { model.log_odds_miss };
            self.update(cell, evidence, model);
        }
    }

    /// The cells that a line crosses, column by column.
    fn crossed(&self, from: Point2<f64>, to: Point2<f64>, mut visit: impl FnMut(i32, i32)) {
        let edge_m = self.frame.resolution_m();
        let (west, east) = if from.x <= to.x { (from, to) } else { (to, from) };
        let [first, last] = [west, east].map(|end| self.frame.cell_at(end).x);
        let slope = (east.y - west.y) / (east.x - west.x);
        for x in first..=last {
            let at = |x_m: f64| {
                let x_m = x_m.clamp(west.x, east.x);
                if first == last { None } else { Some(west.y + slope * (x_m - west.x)) }
            };
            let enters_m =
                if x == first { west.y } else { at(f64::from(x) * edge_m).unwrap_or(west.y) };
            let leaves_m =
                if x == last { east.y } else { at(f64::from(x + 1) * edge_m).unwrap_or(east.y) };
            let [low, high] = [enters_m.min(leaves_m), enters_m.max(leaves_m)]
                .map(|y_m| self.frame.cell_at(Point2::new(0.0, y_m)).y);
            for y in low..=high {
                visit(x, y);
            }
        }
    }

    /// Every cell in reach, by what the network says of its middle.
    pub(super) fn insert_sonar(
        &mut self,
        map_from_robot: Pose,
        scan: &SonarScan,
        (network, sonar): (&Network, &SonarModel),
        model: &BeamModel,
    ) {
        let robot_from_map = map_from_robot.inverse();
        let middle = map_from_robot.position();
        let corner = |side_m: f64| self.frame.cell_at(middle.map(|at_m| at_m + side_m));
        let (low, high) = (corner(-sonar.distance_max_m), corner(sonar.distance_max_m));
        for (x, y) in (low.y..=high.y).flat_map(|y| (low.x..=high.x).map(move |x| (x, y))) {
            let place = robot_from_map * self.frame.center_of(Cell { x, y });
            let distance_m = place.coords.norm();
            if !(sonar.distance_min_m..sonar.distance_max_m).contains(&distance_m) {
                continue;
            }
            let Some(view) = scan.view(place) else { continue };
            let said = network.evidence(&view);
            if sonar.evidence_min <= said.abs() {
                let evidence = said.clamp(-sonar.evidence_max, sonar.evidence_max);
                self.update((x, y), evidence, model);
            }
        }
    }

    fn update(&mut self, cell: (i32, i32), evidence: f32, model: &BeamModel) {
        let log_odds = self.cells.entry(cell).or_insert(f32::NAN);
        *log_odds = model.updated(*log_odds, evidence);
    }
}
