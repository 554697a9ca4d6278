//! What the service does, once; gRPC and REST only carry it.

mod changes;
mod closures;
pub(crate) mod costs;
mod doors;
mod exploration;
pub(crate) mod graphs;
pub(crate) mod grids;
mod hypotheses;
pub(crate) mod imports;
mod job_pictures;
pub(crate) mod jobs;
mod landmarks;
mod mapping_parameters;
pub(crate) mod maps;
mod merges;
pub(crate) mod page;
mod places;
mod plan_tables;
pub(crate) mod plans;
pub(crate) mod profiles;
pub(crate) mod robots;
pub(crate) mod sessions;
pub(crate) mod tiles;
pub(crate) mod trajectories;
pub(crate) mod upload;
pub(crate) mod versions;
mod whereabouts;
