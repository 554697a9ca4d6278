//! The store through its real SQL, each test on a database of its own.

mod append;
mod append_model;
mod closures;
mod costs;
mod explorations;
mod failures;
mod fixture;
mod imports;
mod jobs;
mod journal;
mod leases;
mod mapping_parameters;
mod maps;
mod merges;
mod migrations;
mod relaxations;
mod replies;
mod sessions;
mod topologies;
mod trajectories;
mod travels;
mod versions;
