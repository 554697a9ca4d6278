//! The service `meetpoint`: gRPC and REST over a journal, mapping actors and jobs.

mod activity;
pub mod clock;
pub mod commands;
mod convert;
pub mod demo;
pub mod error;
mod grpc;
mod hypotheses;
mod ingest;
mod jobs;
mod listener;
mod live;
mod mapping;
mod merging;
mod operations;
mod planning;
mod qualitative;
pub mod replay;
pub mod rest;
pub mod serve;
pub mod service;
mod session_cache;
pub mod settings;
pub mod sonar_weights;
pub mod telemetry;
mod training;
