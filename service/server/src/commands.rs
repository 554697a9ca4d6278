//! The commands that ask a running service, and the one that is it.

pub mod bench;
pub mod changes;
pub mod closures;
pub mod doors;
pub mod explore;
pub mod graph;
pub mod hypotheses;
pub mod import;
pub mod map;
pub mod merge;
pub mod merges;
pub mod parameters;
pub mod places;
pub mod plan;
pub mod rebuild;
pub mod relax;
pub mod serve;
pub mod train;
pub mod trajectory;

mod asked;
mod canvas;
mod graph_picture;
mod likelihood_curve;
mod map_hypotheses;
mod place_picture;
mod plan_picture;
mod schemas;
mod seen_place;
mod session_places;
mod watched_job;

pub use asked::ServerArgs;
