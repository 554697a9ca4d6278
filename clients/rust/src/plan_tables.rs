//! Plan tables that a robot takes along, to go on without the network.
//!
//! A file of `DownloadPlanTables`, or of `GET /v1/maps/{map}/plan-tables`:
//!
//! ```text
//! 8 bytes       "MPPLANS" and the number of the format, 1
//! 4 bytes       length of the header, little-endian
//! header        a PlanTablesHeader: version, cost revision, profile, cells, regions, gates
//! weights       a byte a cell: 0 where the robot's centre cannot be, else its weight in 16ths
//! regions       runs of cells in one region: its place among the regions plus 1 (0 for none), and
//!               how many cells, both varints, until all cells are told
//! costs         for every region, every gate of it (in the gates' order) and every node of the gate:
//!               the cost from each of the region's cells of weight above 0 (in their order) to the
//!               node by ways inside the region, as zigzag varints of the difference to the cell
//!               before, the first to 0; 2^30 if there is no way
//! ```
//!
//! Cells are told row by row, the lowest first, each along +x. Varints are those of protobuf. A step
//! along an axis costs 985, a diagonal one 1393, each times the mean weight of its two cells over 16,
//! rounded down; a diagonal step needs both cells beside it. Where a gate's nodes lie in the region,
//! costs are to the node's cell; where they lie across, the last step crosses the gate. Whoever
//! crosses a gate pays its toll.
//!
//! From these the best way from anywhere to anywhere is put together: S. Thrun, Artificial
//! Intelligence 99 (1998), section 3.2, has motions towards the next region in the same manner. For a
//! goal, costs of all gates' nodes are computed once (Dijkstra's algorithm between gates); then each
//! motion is a look-up of the costs of the neighbours.

mod goal_plan;
mod left;

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};

use meetpoint_proto::v1::{PlanBasis, PlanGate, PlanTablesHeader, Point};
use prost::Message;

pub use goal_plan::{GoalPlan, PlannedMotion};
use left::Left;

/// What a file begins with.
const MAGIC: &[u8; 8] = b"MPPLANS\x01";
/// No way.
const UNREACHABLE: u32 = 1 << 30;
const STRAIGHT: u32 = 985;
const DIAGONAL: u32 = 1393;
/// Columns and rows that a step leads on, counter-clockwise from +x.
const STEPS: [(i32, i32); 8] =
    [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)];

/// Why bytes are no plan tables.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InvalidPlanTables {
    /// They begin with something else.
    #[error("the bytes are no plan tables of format 1")]
    NotPlanTables,
    /// They end early.
    #[error("the plan tables end early")]
    Truncated,
    /// Something in them cannot be.
    #[error("the plan tables are damaged: {0}")]
    Damaged(&'static str),
}

/// Plan tables of one profile on one map version under one revision of costs.
#[derive(Clone, Debug)]
pub struct PlanTables {
    header: PlanTablesHeader,
    basis: PlanBasis,
    weights: Vec<u8>,
    /// Place of every cell's region plus 1; 0 for none.
    regions: Vec<u32>,
    /// Place of every cell among those of its region.
    slots: Vec<u32>,
    of_region: Vec<RegionTables>,
    /// Tolls of the steps that cross a gate.
    tolls: HashMap<(usize, usize), u32>,
}

#[derive(Clone, Debug, Default)]
struct RegionTables {
    /// Of weight above 0.
    cells: Vec<u32>,
    /// Places of its gates.
    gates: Vec<usize>,
    /// One row a node, gate by gate; one cost a cell.
    costs: Vec<Vec<u32>>,
}

impl PlanTables {
    /// Reads a file.
    ///
    /// # Errors
    /// [`InvalidPlanTables`] if it is none, or not whole.
    pub fn read(bytes: &[u8]) -> Result<Self, InvalidPlanTables> {
        let mut left = Left(bytes);
        if left.take(MAGIC.len())? != MAGIC {
            return Err(InvalidPlanTables::NotPlanTables);
        }
        let length = left.take(4)?.try_into().map_err(|_| InvalidPlanTables::Truncated)?;
        let header = left.take(u32::from_le_bytes(length) as usize)?;
        let mut header = PlanTablesHeader::decode(header)
            .map_err(|_| InvalidPlanTables::Damaged("its header cannot be read"))?;
        let basis = header.basis.take().ok_or(InvalidPlanTables::Damaged("no basis"))?;
        let n_cells = header.width as usize * header.height as usize;
        let weights = left.take(n_cells)?.to_vec();
        let regions = runs(&mut left, n_cells, header.regions.len())?;
        check_gates(&header, n_cells)?;
        let slots = vec![u32::MAX; n_cells];
        let of_region = vec![RegionTables::default(); header.regions.len()];
        let tolls = HashMap::new();
        let mut tables = Self { header, basis, weights, regions, slots, of_region, tolls };
        tables.sort_cells();
        tables.sort_gates();
        tables.read_costs(&mut left)?;
        Ok(tables)
    }

    /// What the tables were made from.
    pub fn basis(&self) -> &PlanBasis {
        &self.basis
    }

    /// Edge of a cell, in metres.
    pub fn resolution_m(&self) -> f64 {
        self.header.resolution_m
    }

    /// The next motion of a robot on its way to a goal, both in metres in the map's frame; `None` if
    /// the robot cannot be at one of the two, or there is no way. For many motions to one goal use
    /// [`Self::towards`].
    pub fn next_motion(&self, position: Point, goal: Point) -> Option<PlannedMotion> {
        self.towards(goal)?.next_motion(position)
    }

    /// Costs to a goal in metres in the map's frame; `None` if the robot cannot be there.
    pub fn towards(&self, goal: Point) -> Option<GoalPlan<'_>> {
        let goal = self.cell_at(goal)?;
        let nodes = self.header.gates.iter().map(|gate| vec![UNREACHABLE; gate.nodes.len()]);
        let nodes = nodes.collect();
        let mut plan = GoalPlan { tables: self, goal, nodes, inside: self.inside(goal) };
        plan.spread();
        Some(plan)
    }

    /// The cell that holds a point, if the robot can be there.
    fn cell_at(&self, point: Point) -> Option<usize> {
        let along = |metres: f64, first: i32, n: u32| {
            let column = (metres / self.header.resolution_m).floor() - f64::from(first);
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "in 0..n")]
            (0.0 <= column && column < f64::from(n)).then_some(column as usize)
        };
        let x = along(point.x_m, self.header.first_x, self.header.width)?;
        let y = along(point.y_m, self.header.first_y, self.header.height)?;
        let cell = y * self.header.width as usize + x;
        (0 < self.weights[cell] && self.region(cell).is_some()).then_some(cell)
    }

    fn center(&self, cell: usize) -> Point {
        let width = self.header.width as usize;
        let along =
            |n: usize, first: i32| (n as f64 + f64::from(first) + 0.5) * self.header.resolution_m;
        Point {
            x_m: along(cell % width, self.header.first_x),
            y_m: along(cell / width, self.header.first_y),
        }
    }

    /// Place of a cell's region.
    fn region(&self, cell: usize) -> Option<usize> {
        (self.regions[cell] as usize).checked_sub(1)
    }

    /// The cell that a step leads to; `None` if it may not be taken.
    fn step(&self, cell: usize, step: usize) -> Option<usize> {
        let to = self.neighbor(cell, step)?;
        let is_open = |cell: Option<usize>| cell.is_some_and(|cell| 0 < self.weights[cell]);
        let beside = [(step + 7) % 8, (step + 1) % 8].map(|step| self.neighbor(cell, step));
        let is_clear = step.is_multiple_of(2) || beside.into_iter().all(is_open);
        (is_clear && is_open(Some(to))).then_some(to)
    }

    fn neighbor(&self, cell: usize, step: usize) -> Option<usize> {
        let (width, (dx, dy)) = (self.header.width, STEPS[step]);
        let column = u32::try_from(cell % width as usize).ok()?.checked_add_signed(dx)?;
        let row = u32::try_from(cell / width as usize).ok()?.checked_add_signed(dy)?;
        let is_inside = column < width && row < self.header.height;
        is_inside.then_some(row as usize * width as usize + column as usize)
    }

    fn step_cost(&self, from: usize, to: usize, step: usize) -> u32 {
        let length = if step.is_multiple_of(2) { STRAIGHT } else { DIAGONAL };
        length * (u32::from(self.weights[from]) + u32::from(self.weights[to])) / 32
    }

    fn slot(&self, region: usize, cell: usize) -> Option<usize> {
        let is_of = self.region(cell) == Some(region) && self.slots[cell] != u32::MAX;
        is_of.then_some(self.slots[cell] as usize)
    }

    fn sort_cells(&mut self) {
        for (cell, &region) in self.regions.iter().enumerate() {
            if let Some(region) = (region as usize).checked_sub(1)
                && 0 < self.weights[cell]
            {
                let cells = &mut self.of_region[region].cells;
                self.slots[cell] = u32::try_from(cells.len()).unwrap_or(u32::MAX);
                cells.push(u32::try_from(cell).unwrap_or(u32::MAX));
            }
        }
    }

    fn sort_gates(&mut self) {
        for (place, gate) in self.header.gates.iter().enumerate() {
            for region in [gate.inner, gate.outer] {
                self.of_region[region as usize].gates.push(place);
            }
            for (&node, &across) in gate.nodes.iter().zip(&gate.across) {
                let node = usize::try_from(node).unwrap_or(usize::MAX);
                for step in (0..8).filter(|step| across >> step & 1 == 1) {
                    if let Some(to) = self.neighbor(node, step) {
                        self.tolls.insert((node, step), gate.toll);
                        self.tolls.insert((to, (step + 4) % 8), gate.toll);
                    }
                }
            }
        }
    }

    fn read_costs(&mut self, left: &mut Left<'_>) -> Result<(), InvalidPlanTables> {
        let gates = &self.header.gates;
        for region in &mut self.of_region {
            let n_nodes: usize = region.gates.iter().map(|&gate| gates[gate].nodes.len()).sum();
            for _ in 0..n_nodes {
                let mut cost = 0_i64;
                let mut column = Vec::with_capacity(region.cells.len().min(left.0.len()));
                for _ in &region.cells {
                    cost = cost.wrapping_add(left.signed()?);
                    let checked = u32::try_from(cost).ok().filter(|&cost| cost <= UNREACHABLE);
                    column.push(checked.ok_or(InvalidPlanTables::Damaged("a cost"))?);
                }
                region.costs.push(column);
            }
        }
        Ok(())
    }

    /// Costs inside the region of `goal` from its cells.
    fn inside(&self, goal: usize) -> Vec<u32> {
        let Some(region) = self.region(goal) else { return vec![] };
        let mut costs = vec![UNREACHABLE; self.of_region[region].cells.len()];
        let mut waiting = BinaryHeap::from([Reverse((0, goal))]);
        while let Some(Reverse((cost, cell))) = waiting.pop() {
            let Some(slot) = self.slot(region, cell) else { continue };
            if costs[slot] <= cost {
                continue;
            }
            costs[slot] = cost;
            for step in 0..8 {
                if let Some(to) = self.step(cell, step)
                    && self.slot(region, to).is_some_and(|slot| cost < costs[slot])
                {
                    let cost = cost.saturating_add(self.step_cost(cell, to, step));
                    waiting.push(Reverse((cost, to)));
                }
            }
        }
        costs
    }

    /// Costs from a cell to all nodes of its region's gates by ways inside, what is paid on the way
    /// included: the gate and the node by their places.
    fn to_nodes(&self, cell: usize) -> impl Iterator<Item = (usize, usize, u32)> + '_ {
        let place = self.region(cell).and_then(|region| Some((region, self.slot(region, cell)?)));
        place.into_iter().flat_map(move |(region, slot)| {
            let tables = &self.of_region[region];
            let nodes = tables.gates.iter().flat_map(move |&gate| {
                let of_gate = &self.header.gates[gate];
                let toll = match of_gate.toll {
                    toll if toll < UNREACHABLE && of_gate.inner as usize == region => 0,
                    toll => toll,
                };
                (0..of_gate.nodes.len()).map(move |node| (gate, node, toll))
            });
            nodes.zip(&tables.costs).map(move |((gate, node, toll), costs)| {
                (gate, node, costs[slot].saturating_add(toll).min(UNREACHABLE))
            })
        })
    }
}

/// Runs of regions, each at most `n_regions`.
fn runs(
    left: &mut Left<'_>,
    n_cells: usize,
    n_regions: usize,
) -> Result<Vec<u32>, InvalidPlanTables> {
    let mut regions = Vec::with_capacity(n_cells);
    while regions.len() < n_cells {
        let [region, length] = [left.unsigned()?, left.unsigned()?];
        let region = u32::try_from(region).ok().filter(|&region| region as usize <= n_regions);
        let region = region.ok_or(InvalidPlanTables::Damaged("a region"))?;
        let room = n_cells - regions.len();
        let length = usize::try_from(length).ok().filter(|length| (1..=room).contains(length));
        let length = length.ok_or(InvalidPlanTables::Damaged("a run of cells"))?;
        regions.resize(regions.len() + length, region);
    }
    Ok(regions)
}

fn check_gates(header: &PlanTablesHeader, n_cells: usize) -> Result<(), InvalidPlanTables> {
    let n_regions = header.regions.len();
    for PlanGate { inner, outer, nodes, across, toll, arc: _ } in &header.gates {
        let are_regions = [inner, outer].into_iter().all(|&region| (region as usize) < n_regions);
        let are_cells = nodes.iter().all(|&node| node < n_cells as u64);
        if !are_regions || inner == outer || !are_cells {
            return Err(InvalidPlanTables::Damaged("a gate"));
        }
        if nodes.len() != across.len() || UNREACHABLE < *toll {
            return Err(InvalidPlanTables::Damaged("a node"));
        }
    }
    let is_length = 0.0 < header.resolution_m && header.resolution_m.is_finite();
    if is_length { Ok(()) } else { Err(InvalidPlanTables::Damaged("the resolution")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two cells beside each other, one region, no gates.
    fn small() -> Vec<u8> {
        let header = PlanTablesHeader {
            basis: Some(PlanBasis { map: "m".into(), ..PlanBasis::default() }),
            resolution_m: 0.5,
            first_x: -1,
            first_y: 0,
            width: 4,
            height: 3,
            regions: vec![7],
            gates: vec![],
        };
        let header = header.encode_to_vec();
        let length = u32::try_from(header.len()).expect("short").to_le_bytes();
        let weights = [0, 0, 0, 0, 0, 16, 16, 0, 0, 0, 0, 0];
        let runs = [0, 5, 1, 2, 0, 5];
        [&MAGIC[..], &length, &header, &weights, &runs].concat()
    }

    #[test]
    fn a_step_to_the_goal() {
        let tables = PlanTables::read(&small()).expect("whole");
        let (left, right) = (Point { x_m: 0.2, y_m: 0.7 }, Point { x_m: 0.9, y_m: 0.6 });
        let motion = tables.next_motion(left, right).expect("a way");
        assert_eq!(motion.heading_rad, Some(0.0), "to the right");
        assert_eq!((motion.distance_left_m, motion.region), (0.5, 7), "one cell");
        assert_eq!(motion.next, Point { x_m: 0.75, y_m: 0.75 }, "its centre");
        let there = tables.next_motion(right, right).expect("a way");
        assert_eq!((there.heading_rad, there.distance_left_m), (None, 0.0), "there");
        let nowhere = Point { x_m: f64::NAN, y_m: 0.0 };
        assert_eq!(tables.next_motion(nowhere, right), None, "nowhere");
        assert!(tables.towards(Point { x_m: 5.0, y_m: 0.7 }).is_none(), "outside");
    }

    #[test]
    fn what_is_damaged_is_refused() {
        let good = small();
        for n in 0..good.len() {
            assert!(PlanTables::read(&good[..n]).is_err(), "{n} bytes of {}", good.len());
        }
        for at in 0..good.len() {
            for bit in 0..8 {
                let mut bad = good.clone();
                bad[at] ^= 1 << bit;
                // Whatever it says, it neither panics nor asks for the moon.
                if let Ok(tables) = PlanTables::read(&bad) {
                    let point = Point { x_m: 0.2, y_m: 0.7 };
                    let _ = tables.next_motion(point, point);
                }
            }
        }
    }
}
