//! gRPC: carries operations, decides nothing.

mod changes;
mod closures;
mod costs;
mod exploration;
mod graphs;
mod grids;
mod imports;
mod ingest;
mod jobs;
mod landmarks;
mod maps;
mod merges;
mod places;
mod plans;
mod qualitative;
mod robots;
mod sessions;
mod too_large;

use axum::Router;
use meetpoint_proto::{FILE_DESCRIPTOR_SET, v1};
use tonic::codec::CompressionEncoding::{Gzip, Zstd};
use tonic::service::Routes;
use v1::change_service_server::ChangeServiceServer;
use v1::closure_service_server::ClosureServiceServer;
use v1::cost_service_server::CostServiceServer;
use v1::exploration_service_server::ExplorationServiceServer;
use v1::graph_service_server::GraphServiceServer;
use v1::grid_service_server::GridServiceServer;
use v1::job_service_server::JobServiceServer;
use v1::landmark_service_server::LandmarkServiceServer;
use v1::map_service_server::MapServiceServer;
use v1::merge_service_server::MergeServiceServer;
use v1::place_service_server::PlaceServiceServer;
use v1::plan_service_server::PlanServiceServer;
use v1::qualitative_service_server::QualitativeServiceServer;
use v1::robot_service_server::RobotServiceServer;
use v1::session_service_server::SessionServiceServer;

use crate::service::Service;

/// Encoded size of a reply: a grid of the largest size and its envelope.
const REPLY_BYTES_MAX: usize = 64 * 1024 * 1024;

/// Sets size limits and compression on a generated server.
macro_rules! carried {
    ($server:ident, $service:expr) => {
        $server::new($service.clone())
            .max_decoding_message_size($service.settings.limits.request_bytes_max)
            .max_encoding_message_size(REPLY_BYTES_MAX)
            .accept_compressed(Gzip)
            .accept_compressed(Zstd)
            .send_compressed(Gzip)
            .send_compressed(Zstd)
    };
}

/// All services, with health and reflection.
///
/// # Errors
/// If the compiled-in descriptors cannot be read.
pub(crate) async fn router(service: &Service) -> anyhow::Result<Router> {
    let (health, health_service) = tonic_health::server::health_reporter();
    health.set_serving::<MapServiceServer<Service>>().await;
    health.set_serving::<RobotServiceServer<Service>>().await;
    health.set_serving::<SessionServiceServer<Service>>().await;
    health.set_serving::<GridServiceServer<Service>>().await;
    health.set_serving::<ChangeServiceServer<Service>>().await;
    health.set_serving::<GraphServiceServer<Service>>().await;
    health.set_serving::<LandmarkServiceServer<Service>>().await;
    health.set_serving::<ClosureServiceServer<Service>>().await;
    health.set_serving::<MergeServiceServer<Service>>().await;
    health.set_serving::<JobServiceServer<Service>>().await;
    health.set_serving::<PlaceServiceServer<Service>>().await;
    health.set_serving::<PlanServiceServer<Service>>().await;
    health.set_serving::<QualitativeServiceServer<Service>>().await;
    health.set_serving::<CostServiceServer<Service>>().await;
    health.set_serving::<ExplorationServiceServer<Service>>().await;
    let reflection = || {
        tonic_reflection::server::Builder::configure()
            .register_encoded_file_descriptor_set(FILE_DESCRIPTOR_SET)
            .register_encoded_file_descriptor_set(tonic_health::pb::FILE_DESCRIPTOR_SET)
    };
    let routes = Routes::new(health_service)
        .add_service(reflection().build_v1()?)
        .add_service(reflection().build_v1alpha()?)
        .add_service(carried!(MapServiceServer, service))
        .add_service(carried!(RobotServiceServer, service))
        .add_service(carried!(SessionServiceServer, service))
        .add_service(carried!(GridServiceServer, service))
        .add_service(carried!(ChangeServiceServer, service))
        .add_service(carried!(GraphServiceServer, service))
        .add_service(carried!(LandmarkServiceServer, service))
        .add_service(carried!(ClosureServiceServer, service))
        .add_service(carried!(MergeServiceServer, service))
        .add_service(carried!(JobServiceServer, service))
        .add_service(carried!(PlaceServiceServer, service))
        .add_service(carried!(PlanServiceServer, service))
        .add_service(carried!(QualitativeServiceServer, service))
        .add_service(carried!(ExplorationServiceServer, service))
        .add_service(carried!(CostServiceServer, service));
    let limit_bytes = service.settings.limits.request_bytes_max;
    let named = axum::middleware::map_response(move |response| async move {
        too_large::named(response, limit_bytes)
    });
    Ok(routes.into_axum_router().layer(named))
}
