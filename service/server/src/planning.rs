//! Plans of map versions: what is in force, the fields that robots go about in, plan tables.

mod advice;
mod alternatives;
mod barred;
mod costs;
mod ends;
mod explorations;
mod field;
mod fields;
mod ground;
mod motion;
mod paths;
mod profile;
mod reach;
mod ready;
mod standing;
mod tables_file;
mod trips;

use tokio::sync::Semaphore;

use crate::settings::PlanningSettings;

pub(crate) use advice::{no_route, nowhere};
pub(crate) use barred::{barred, closed};
pub(crate) use costs::{Cost, CostKind, CostOrigin, Costs, Decision, Removal};
pub(crate) use ends::{Located, Nowhere, locate};
pub(crate) use explorations::Explorations;
pub(crate) use field::Field;
pub(crate) use fields::Fields;
pub(crate) use motion::{Motion, next_motion};
pub(crate) use paths::{PathAnswer, PathQuery, Planned, plan};
pub(crate) use profile::{Choice, Profile, RADIUS_MAX_M};
pub(crate) use reach::{matrix, reached};
pub(crate) use ready::keep_ready;
pub(crate) use standing::{Standing, Standings};
pub(crate) use tables_file::file as tables_file;
pub(crate) use trips::{plan_as_paper, plan_by_triplets};

/// What planning keeps in memory.
pub(crate) struct Planner {
    pub(crate) standings: Standings,
    pub(crate) fields: Fields,
    pub(crate) explorations: Explorations,
    /// One permit for each query that computes for long.
    pub(crate) searching: Semaphore,
}

impl Planner {
    pub(crate) fn new(settings: &PlanningSettings) -> Self {
        let n_processors = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
        Self {
            standings: Standings::default(),
            fields: Fields::new(settings),
            explorations: Explorations::default(),
            searching: Semaphore::new(n_processors),
        }
    }
}
