//! What the service does, once; gRPC and REST only carry it.

mod changes;
mod closures;
pub(crate) mod costs;
mod exploration;
pub(crate) mod graphs;
pub(crate) mod grids;
pub(crate) mod imports;
mod job_pictures;
pub(crate) mod jobs;
mod landmarks;
pub(crate) mod maps;
mod merges;
pub(crate) mod page;
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
