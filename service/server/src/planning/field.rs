//! Where a robot of one profile can go on one version under one revision of costs.

use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use meetpoint_geometry::{Cell, GridInfo, Point2};
use meetpoint_planning::{
    ArcCost, Cost, Obstacles, Plans, Scratch, SmoothScratch, Space, TolledSearch, Tolls,
    UNREACHABLE, enterable,
};
use meetpoint_topology::{FreeSpace, clearance};

use super::costs::Costs;
use super::ground::Ground;
use super::profile::Profile;
use super::trips::Trips;
use crate::error::Error;

/// Sets of scratch memory that are kept; more queries at once make their own.
const N_SEARCHES_KEPT: usize = 4;

/// A field. Immutable but for the tables, which come later.
pub(crate) struct Field {
    pub(crate) ground: Arc<Ground>,
    pub(crate) costs: Arc<Costs>,
    pub(crate) profile: Profile,
    pub(crate) space: Arc<Space>,
    /// What was observed and what was drawn.
    pub(crate) obstacles: Obstacles,
    pub(crate) tolls: Tolls,
    arcs: Vec<ArcCost>,
    plans: OnceLock<Arc<Plans>>,
    /// Made when they are first asked for.
    pub(super) triplets: OnceLock<Trips>,
    pub(super) paper: OnceLock<Trips>,
    searches: Mutex<Vec<Searches>>,
}

/// What queries write on.
#[derive(Default)]
pub(crate) struct Searches {
    pub(crate) tables: Scratch,
    pub(crate) smooth: SmoothScratch,
    pub(crate) grid: TolledSearch,
}

impl Field {
    /// Without tables. Takes some hundred nanoseconds a cell.
    ///
    /// # Errors
    /// [`Error::Internal`] if a version does not fit together.
    pub(crate) fn new(
        ground: Arc<Ground>,
        costs: Arc<Costs>,
        profile: Profile,
    ) -> Result<Self, Error> {
        let drawn = with_obstacles(&ground.free, &costs);
        let free = drawn.as_ref().unwrap_or(&ground.free);
        let zones = zone_factors(ground.info(), &costs);
        let space = Arc::new(space(&ground, free, &profile, &zones)?);
        let ids = ground.topology.ids().arcs.iter().map(|id| id.0);
        let arcs = costs.arc_costs(ids, ground.side_m());
        let tolls = Tolls::new(&space, &ground.partition, ground.topology.graph(), &arcs);
        let obstacles = drawn.as_ref().map_or_else(|| ground.obstacles(), Obstacles::new);
        Ok(Self {
            ground,
            costs,
            profile,
            space,
            obstacles,
            tolls,
            arcs,
            plans: OnceLock::new(),
            triplets: OnceLock::new(),
            paper: OnceLock::new(),
            searches: Mutex::default(),
        })
    }

    /// Makes the tables: from those of the same profile and version under other costs, if given,
    /// else anew.
    ///
    /// # Errors
    /// [`Error::Internal`] if a version does not fit together.
    pub(crate) fn make_plans(
        &self,
        before: Option<&Plans>,
        pair_bytes_max: usize,
    ) -> Result<(), Error> {
        let plans = match before {
            Some(before) => before.with_costs(self.space.clone(), &self.arcs),
            None => {
                let plain = self.plain_plans(pair_bytes_max)?;
                let is_plain = self.costs.in_force().is_empty();
                if is_plain { plain } else { plain.with_costs(self.space.clone(), &self.arcs) }
            }
        };
        let _ = self.plans.set(Arc::new(plans));
        Ok(())
    }

    /// Tables without costs: later ones may only close what is open in these.
    fn plain_plans(&self, pair_bytes_max: usize) -> Result<Plans, Error> {
        let ground = &self.ground;
        let space = if self.costs.in_force().is_empty() {
            self.space.clone()
        } else {
            Arc::new(space(ground, &ground.free, &self.profile, &[])?)
        };
        let graph = ground.topology.graph();
        let open = vec![ArcCost::Open(0); graph.arcs.len()];
        Ok(Plans::new(space, ground.partition.clone(), graph, &open, pair_bytes_max))
    }

    /// The tables, once they are made.
    pub(crate) fn plans(&self) -> Option<&Arc<Plans>> {
        self.plans.get()
    }

    pub(crate) fn info(&self) -> GridInfo {
        self.ground.info()
    }

    /// Whether what a path costs is its length.
    pub(crate) fn is_by_length(&self) -> bool {
        self.profile.weights.is_length_only()
            && self.tolls.is_empty()
            && self.costs.zones().next().is_none()
    }

    /// What is not free of charge, or closed, of the arcs: by place in the graph.
    pub(crate) fn arcs(&self) -> &[ArcCost] {
        &self.arcs
    }

    /// Runs a query with scratch memory of this field.
    pub(crate) fn with_searches<T>(&self, query: impl FnOnce(&mut Searches) -> T) -> T {
        let kept = || self.searches.lock().unwrap_or_else(PoisonError::into_inner);
        let mut searches = kept().pop().unwrap_or_default();
        let answer = query(&mut searches);
        let mut kept = kept();
        if kept.len() < N_SEARCHES_KEPT {
            kept.push(searches);
        }
        answer
    }

    /// Centre of a cell, in metres.
    pub(crate) fn center(&self, index: usize) -> Point2<f64> {
        center_of(self.info(), index)
    }

    /// Memory, in bytes, about: cells of the field, two bits a cell of obstacles, tables, scratch.
    pub(crate) fn n_bytes(&self) -> usize {
        let n_cells = self.info().n_cells();
        let tables = self.plans().map_or(0, |plans| {
            let size = plans.size();
            size.region_bytes + size.gate_bytes + 12 * n_cells
        });
        let trips =
            [&self.triplets, &self.paper].map(|trips| trips.get().map_or(0, Trips::n_bytes));
        self.ground.n_bytes() + 3 * n_cells + tables + trips.iter().sum::<usize>()
    }
}

/// Centre of a cell, in metres.
pub(super) fn center_of(info: GridInfo, index: usize) -> Point2<f64> {
    let width = info.width as usize;
    let along = |first: i32, n: usize| first + i32::try_from(n).unwrap_or(i32::MAX);
    let cell =
        Cell { x: along(info.first.x, index % width), y: along(info.first.y, index / width) };
    info.frame.center_of(cell)
}

/// The free cells without those that drawn obstacles touch; `None` if none are drawn.
fn with_obstacles(free: &FreeSpace, costs: &Costs) -> Option<FreeSpace> {
    costs.obstacles().next()?;
    let info = free.info();
    let mut is_free = free.is_free().to_vec();
    for shape in costs.obstacles() {
        for cell in shape.touched(info) {
            is_free[cell] = false;
        }
    }
    // A free space puts a rim around what it is given.
    let (width, height) = (info.width as usize, info.height as usize);
    let inner: Vec<bool> = (1..height.saturating_sub(1))
        .flat_map(|y| is_free[y * width + 1..(y + 1) * width - 1].iter().copied())
        .collect();
    let first = Cell { x: info.first.x + 1, y: info.first.y + 1 };
    let info = GridInfo { first, width: info.width - 2, height: info.height - 2, ..info };
    Some(FreeSpace::from_cells(info, &inner))
}

/// Largest factor of the zones of every cell; empty without zones.
fn zone_factors(info: GridInfo, costs: &Costs) -> Vec<f32> {
    if costs.zones().next().is_none() {
        return vec![];
    }
    let mut factors = vec![1.0_f32; info.n_cells()];
    for (polygon, factor) in costs.zones() {
        #[expect(clippy::cast_possible_truncation, reason = "1 to 8")]
        let factor = factor as f32;
        for cell in meetpoint_planning::cells_inside(polygon, info) {
            factors[cell] = factors[cell].max(factor);
        }
    }
    factors
}

fn space(
    ground: &Ground,
    free: &FreeSpace,
    profile: &Profile,
    zones: &[f32],
) -> Result<Space, Error> {
    let is_enterable = enterable(free, profile.radius_m);
    let info = free.info();
    if profile.weights.is_length_only() && zones.is_empty() {
        return Space::uniform(info, &is_enterable).map_err(Error::internal);
    }
    let is_near_dear = 0.0 < profile.weights.clearance_distance_m;
    let clearance = is_near_dear.then(|| clearance(free));
    let weight = |(cell, is_enterable): (usize, bool)| {
        if !is_enterable {
            return 0;
        }
        let clearance_m = clearance.as_ref().map_or(f64::MAX, |clearance| clearance.at_m(cell));
        let zone = zones.get(cell).copied().map_or(1.0, f64::from);
        profile.weights.weight(clearance_m, ground.probability(cell), zone)
    };
    let weights = is_enterable.into_iter().enumerate().map(weight).collect();
    Space::new(info, weights).map_err(Error::internal)
}

/// A cost in metres of free travel through cells of that side.
pub(crate) fn metres(cost: Cost, side_m: f64) -> f64 {
    meetpoint_planning::length_cells(cost) * side_m
}

/// Metres of free travel as a cost, at most what can be reached.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
pub(crate) fn cost_of(metres: f64, side_m: f64) -> Cost {
    let cost = metres / side_m * f64::from(meetpoint_planning::STRAIGHT);
    cost.clamp(0.0, f64::from(UNREACHABLE - 1)) as Cost
}
