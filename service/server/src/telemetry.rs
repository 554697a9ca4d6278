//! Logs to standard error, metrics for Prometheus.

use std::sync::OnceLock;

use metrics_exporter_prometheus::{Matcher, PrometheusBuilder, PrometheusHandle};
use tracing_subscriber::EnvFilter;

/// Bounds of time histograms, seconds: from one fsync of a good disk to a robot that gave up.
const SECONDS: [f64; 12] = [0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 5.0];
/// Bounds of the histogram of batches a commit.
const BATCHES: [f64; 9] = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0, 256.0];

static METRICS: OnceLock<PrometheusHandle> = OnceLock::new();

/// Starts logging, by `RUST_LOG` or at `info`; as JSON lines for machines if asked.
pub fn start_logging(json: bool) {
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new("info"));
    let builder = tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr);
    // A second call (two services in one process) finds the first subscriber in place: fine.
    let started = if json { builder.json().try_init() } else { builder.try_init() };
    drop(started);
}

/// Installs the metrics recorder; later calls change nothing.
///
/// # Errors
/// If another recorder was installed by someone else.
pub fn start_metrics() -> anyhow::Result<()> {
    if METRICS.get().is_some() {
        return Ok(());
    }
    let recorder = PrometheusBuilder::new()
        .set_buckets_for_metric(Matcher::Suffix("_seconds".into()), &SECONDS)?
        .set_buckets_for_metric(Matcher::Suffix("_batches".into()), &BATCHES)?
        .build_recorder();
    let handle = recorder.handle();
    if METRICS.set(handle).is_ok() {
        metrics::set_global_recorder(recorder)?;
        describe();
    }
    Ok(())
}

/// All metrics in Prometheus' text format.
#[must_use]
pub fn render_metrics() -> String {
    METRICS.get().map(PrometheusHandle::render).unwrap_or_default()
}

/// Lets histograms drain, as the recorder asks for now and then.
pub(crate) fn upkeep() {
    if let Some(handle) = METRICS.get() {
        handle.run_upkeep();
    }
}

fn describe() {
    use metrics::{describe_counter, describe_gauge, describe_histogram};
    describe_counter!("meetpoint_batches_received", "Batches checked, duplicates included");
    describe_counter!("meetpoint_scans_received", "Laser scans in those batches, usable ones");
    describe_counter!("meetpoint_observations_rejected", "Observations that cannot be used");
    describe_counter!("meetpoint_scans_mapped", "Laser scans that have a pose");
    describe_counter!("meetpoint_mapping_failures", "Times that a map's actor had to start again");
    describe_counter!("meetpoint_snapshot_failures", "Attempts to save a version that failed");
    describe_gauge!("meetpoint_journal_queue_depth", "Batches that wait for a commit");
    describe_gauge!("meetpoint_mapping_queue_depth", "Journal entries read ahead, by map");
    describe_gauge!("meetpoint_mapping_queue_age_seconds", "Age of the entry mapped last, by map");
    describe_gauge!("meetpoint_real_time_ratio", "Seconds driven for each computed, by map");
    describe_histogram!("meetpoint_ack_seconds", "From reading a batch to its durable ack");
    describe_histogram!("meetpoint_database_seconds", "Time in the database, by what");
    describe_histogram!("meetpoint_group_commit_batches", "Batches that one commit took");
}
