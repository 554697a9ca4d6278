//! Time that this thread ran on a processor.

/// Seconds so far, as Linux counts them; 0 elsewhere.
pub(crate) fn cpu_s() -> f64 {
    let stat = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let ran_ns = stat.split_whitespace().next().and_then(|word| word.parse::<f64>().ok());
    ran_ns.unwrap_or(0.0) * 1e-9
}
