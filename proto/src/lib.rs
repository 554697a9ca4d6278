//! The wire: Meetpoint's `.proto` files and the types made from them, nothing else.

/// Package `meetpoint.v1`. The documentation of each item is its comment in the `.proto` file.
#[expect(clippy::pedantic, missing_docs, reason = "generated code")]
pub mod v1 {
    tonic::include_proto!("meetpoint.v1");
}

/// The encoded `FileDescriptorSet` of all files, for server reflection.
pub const FILE_DESCRIPTOR_SET: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/descriptor.bin"));
