//! Makes Rust types from the .proto files with protox: no protoc on the machine is needed.

use std::{env, fs, path::PathBuf};

const FILES: [&str; 19] = [
    "meetpoint/v1/geometry.proto",
    "meetpoint/v1/sensor.proto",
    "meetpoint/v1/batch.proto",
    "meetpoint/v1/robot.proto",
    "meetpoint/v1/session.proto",
    "meetpoint/v1/trajectory.proto",
    "meetpoint/v1/map.proto",
    "meetpoint/v1/grid.proto",
    "meetpoint/v1/change.proto",
    "meetpoint/v1/graph.proto",
    "meetpoint/v1/cost.proto",
    "meetpoint/v1/plan.proto",
    "meetpoint/v1/exploration.proto",
    "meetpoint/v1/landmark.proto",
    "meetpoint/v1/closure.proto",
    "meetpoint/v1/merge.proto",
    "meetpoint/v1/place.proto",
    "meetpoint/v1/qualitative.proto",
    "meetpoint/v1/job.proto",
];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("cargo:rerun-if-changed=meetpoint");
    let mut compiler = protox::Compiler::new(["."])?;
    compiler.include_imports(true).include_source_info(true);
    compiler.open_files(FILES)?;
    // Bytes straight from protox keep every option and comment, for server reflection.
    let out = PathBuf::from(env::var("OUT_DIR")?).join("descriptor.bin");
    fs::write(&out, compiler.encode_file_descriptor_set())?;
    tonic_prost_build::configure()
        // It is much larger than what else a watcher is told.
        .boxed(".meetpoint.v1.WatchMapResponse.kind.session")
        .compile_fds(compiler.file_descriptor_set())?;
    Ok(())
}
