//! The cells of a best path, step by step by look-up.

use crate::cost::{Cost, UNREACHABLE};
use crate::gate_costs::{Leg, NodeName};
use crate::inside::Scratch;
use crate::plans::Plans;
use crate::region_table::{Door, RegionTable};
use crate::route::{Route, route_of};
use crate::space::{FORWARD_FIRST, toward};

/// A shortest path in the grid.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct GridPath {
    /// Its regions and what it costs.
    pub route: Route,
    /// Its cells, by index, start and goal included.
    pub cells: Vec<u32>,
}

/// Where a walk through a region leads: a node, by its place in the region's table.
struct Goal<'a> {
    region: usize,
    table: &'a RegionTable,
    /// Place of the door among the region's.
    at: usize,
    door: &'a Door,
    /// Place of the node in the table's rows.
    node: usize,
    cell: usize,
    /// Steps from the node's cell into the region; none if it lies inside.
    across: &'a [(usize, usize)],
}

impl Plans {
    /// The best path between two cells, by index; `None` if there is none.
    pub fn path(&self, from: usize, to: usize, scratch: &mut Scratch) -> Option<GridPath> {
        let path = self.waypoints(from, to, scratch, |_, _| false)?;
        let mut cells = vec![];
        for &corner in &path.cells {
            self.steps_to(corner as usize, &mut cells);
        }
        Some(GridPath { cells, ..path })
    }

    /// The row of cells from the last one to another, straight or diagonal, appended.
    fn steps_to(&self, to: usize, cells: &mut Vec<u32>) {
        let width = self.space.info().width as usize;
        let Some(&from) = cells.last() else { return cells.push(name(to)) };
        let mut cell = from as usize;
        let towards =
            |from: usize, to: usize| from + usize::from(from < to) - usize::from(to < from);
        while cell != to {
            let [x, y] = [cell % width, cell / width];
            cell = towards(y, to / width) * width + towards(x, to % width);
            cells.push(name(cell));
        }
    }

    /// Some cells along the best path, start and goal included: what [`crate::smooth`] pulls
    /// tight. From one to the next lead a straight or diagonal row of steps, or, between gates, a
    /// straight line that `is_clear`, which is asked with two cells.
    pub fn waypoints(
        &self,
        from: usize,
        to: usize,
        scratch: &mut Scratch,
        is_clear: impl Fn(usize, usize) -> bool,
    ) -> Option<GridPath> {
        let region = self.place(from)?.region();
        let pieces = self.pieces(from, to, scratch)?;
        let route = route_of(region, &pieces);
        let mut cells = vec![];
        let (Some((start_region, first)), Some((goal_region, last))) = (pieces.first, pieces.last)
        else {
            scratch.corners(self, to, &mut cells);
            return Some(GridPath { route, cells });
        };
        cells.push(name(from));
        let ends = [first, last].map(|node| self.cell_of(node));
        if is_clear(from, ends[0]) {
            cells.push(name(ends[0]));
        } else {
            self.walk(start_region, from, first, &mut cells);
        }
        for leg in &pieces.legs {
            let to = self.cell_of(leg.to);
            if is_clear(self.cell_of(leg.from), to) {
                cells.push(name(to));
            } else {
                self.walk_leg(leg, &mut cells);
            }
        }
        if is_clear(ends[1], to) {
            cells.push(name(to));
        } else {
            // The last piece is walked from the goal.
            let mut back = vec![name(to)];
            self.walk(goal_region, to, last, &mut back);
            back.pop();
            cells.extend(back.into_iter().rev());
        }
        Some(GridPath { route, cells })
    }

    /// The cell that a best path from one cell to another goes to next: a look-up, as every motion
    /// of a robot that follows it. `None` at the goal, and where there is no way.
    pub fn next_cell(&self, from: usize, to: usize, scratch: &mut Scratch) -> Option<usize> {
        let (start, goal) = (self.place(from)?, self.place(to)?);
        if from == to {
            return None;
        }
        if start.region() == goal.region() {
            let path = self.path(from, to, scratch)?;
            return path.cells.get(1).map(|&cell| cell as usize);
        }
        let first = self.meeting(start, goal)?.first;
        self.next_cell_by(from, to, first, scratch)
    }

    /// The same where a best path leaves the region by that node.
    pub(crate) fn next_cell_by(
        &self,
        from: usize,
        to: usize,
        first: NodeName,
        scratch: &mut Scratch,
    ) -> Option<usize> {
        let towards = self.goal(self.place(from)?.region(), first)?;
        if from == towards.cell {
            // On the gate already: its own gate's cells are next, or those of the leg beyond.
            let path = self.path(from, to, scratch)?;
            return path.cells.get(1).map(|&cell| cell as usize);
        }
        let ahead = self.toward(from, towards.cell);
        let step = self.best_step(&towards, from, self.onward(&towards, from), ahead)?;
        Some(self.space.neighbor(from, step))
    }

    /// The step that leads most nearly from one cell towards another.
    fn toward(&self, from: usize, to: usize) -> usize {
        let width = self.space.info().width as usize;
        toward([from % width, from / width], [to % width, to / width])
    }

    /// The cells of a leg but its first, appended.
    fn walk_leg(&self, leg: &Leg, cells: &mut Vec<u32>) {
        let region = leg.region as usize;
        let node = &self.layout.gates[leg.from.gate].nodes[leg.from.node];
        if self.is_in(region, node.cell) {
            return self.walk(region, node.cell, leg.to, cells);
        }
        if self.cell_of(leg.to) == node.cell {
            return;
        }
        // From across: the best of the steps that lead in.
        let Some(goal) = self.goal(region, leg.to) else { return };
        let open =
            node.across.iter().filter(|(step, _)| self.space.moves(node.cell) >> step & 1 == 1);
        let onward = |&&(step, cell): &&(usize, usize)| {
            let cost = self.space.step_cost(node.cell, step);
            cost.saturating_add(self.onward(&goal, cell))
        };
        if let Some(&(_, cell)) = open.min_by_key(onward) {
            cells.push(name(cell));
            self.walk_to(&goal, cell, cells);
        }
    }

    /// The cells but the first from a cell of a region to a node of one of its gates, appended.
    fn walk(&self, region: usize, from: usize, to: NodeName, cells: &mut Vec<u32>) {
        if let Some(goal) = self.goal(region, to) {
            self.walk_to(&goal, from, cells);
        }
    }

    /// The same from a cell inside; only the last of every row of equal steps.
    fn walk_to(&self, goal: &Goal, from: usize, cells: &mut Vec<u32>) {
        let mut cell = from;
        let mut last_step = self.toward(from, goal.cell);
        while cell != goal.cell {
            let left = self.onward(goal, cell);
            let Some(step) = self.best_step(goal, cell, left, last_step) else { return };
            cell = self.last_of_row(goal, cell, step, left);
            cells.push(name(cell));
            last_step = step;
        }
    }

    /// The last cell of a row of equal steps, the first of which is on a best way.
    ///
    /// If a cell down the row is nearer to the goal by all the steps to it, so is every one before:
    /// the last is found by doubling and halving, at a look-up each.
    fn last_of_row(&self, goal: &Goal, from: usize, step: usize, left: Cost) -> usize {
        let first = self.space.neighbor(from, step);
        let Some(n_open) = self.patches[goal.region].n_open(from, step) else { return first };
        let cost = self.space.step_cost(from, step);
        let cell = |n: usize| {
            let offset = first.wrapping_sub(from).wrapping_mul(n);
            from.wrapping_add(offset)
        };
        let is_on_way = |n: usize| {
            let passed = Cost::try_from(n).unwrap_or(UNREACHABLE).saturating_mul(cost);
            passed <= left && passed + self.onward(goal, cell(n)) == left
        };
        let mut reached = 1;
        let mut failed = n_open + 1;
        while reached + 1 < failed {
            let tried = if failed == n_open + 1 { 2 * reached } else { reached.midpoint(failed) };
            let tried = tried.min(failed - 1);
            if is_on_way(tried) {
                reached = tried;
            } else {
                failed = tried;
            }
        }
        if n_open == 0 { first } else { cell(reached) }
    }

    fn goal(&self, region: usize, to: NodeName) -> Option<Goal<'_>> {
        let doors = &self.layout.doors[region];
        let (at, door) = doors.iter().enumerate().find(|(_, door)| door.gate == to.gate)?;
        let node = &self.layout.gates[to.gate].nodes[to.node];
        Some(Goal {
            region,
            table: &self.tables[region],
            at,
            door,
            node: door.first + to.node,
            cell: node.cell,
            across: if door.is_inner { &[] } else { &node.across },
        })
    }

    pub(crate) fn cell_of(&self, name: NodeName) -> usize {
        self.layout.gates[name.gate].nodes[name.node].cell
    }

    /// Cost from a cell of the goal's region to the goal.
    fn onward(&self, goal: &Goal, cell: usize) -> Cost {
        goal.table.cost(self.layout.places[cell].slot(), goal.at, goal.door, goal.node)
    }

    /// A step on a best way, `left` being what is left: the one tried first if it is one, else of
    /// those that turn least from it.
    fn best_step(&self, goal: &Goal, cell: usize, left: Cost, tried_first: usize) -> Option<usize> {
        if UNREACHABLE <= left {
            return None;
        }
        let moves = self.space.moves(cell);
        let mut steps = FORWARD_FIRST.map(|turn| (tried_first + turn) % 8).into_iter();
        steps.find(|&step| {
            if moves >> step & 1 == 0 {
                return false;
            }
            let next = self.space.neighbor(cell, step);
            let cost = self.space.step_cost(cell, step);
            let arrives = goal.across.contains(&((step + 4) % 8, cell)) && next == goal.cell;
            arrives && cost == left
                || self.is_in(goal.region, next) && cost + self.onward(goal, next) == left
        })
    }
}

fn name(cell: usize) -> u32 {
    u32::try_from(cell).unwrap_or(u32::MAX)
}
