//! Whether robots send or queries come: what work in the background makes room for.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// After the last request or batch the service is busy for so long.
const BUSY_FOR: Duration = Duration::from_secs(2);
/// Requests that do not count: those who wait for a job ask for it, and those who watch over the
/// service ask all the time.
const NOT_COUNTED: [&str; 6] =
    ["/v1/jobs", "/meetpoint.v1.JobService/", "/healthz", "/readyz", "/metrics", "/grpc.health."];
/// Nothing has come yet.
const NEVER: u64 = u64::MAX;

/// When somebody last asked something of the service.
#[derive(Clone, Debug)]
pub(crate) struct Activity(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    begun: Instant,
    /// Milliseconds since `begun`, or [`NEVER`].
    last_ms: AtomicU64,
}

impl Activity {
    /// Nothing has come yet.
    pub(crate) fn new() -> Self {
        Self(Arc::new(Inner { begun: Instant::now(), last_ms: AtomicU64::new(NEVER) }))
    }

    /// A batch came.
    pub(crate) fn touch(&self) {
        self.0.last_ms.store(self.now_ms(), Ordering::Relaxed);
    }

    /// A request came.
    pub(crate) fn touch_by_request(&self, path: &str) {
        if !NOT_COUNTED.iter().any(|prefix| path.starts_with(prefix)) {
            self.touch();
        }
    }

    /// True if something came a moment ago.
    pub(crate) fn is_busy(&self) -> bool {
        let last_ms = self.0.last_ms.load(Ordering::Relaxed);
        let busy_for_ms = u64::try_from(BUSY_FOR.as_millis()).unwrap_or(u64::MAX);
        last_ms != NEVER && self.now_ms().saturating_sub(last_ms) < busy_for_ms
    }

    fn now_ms(&self) -> u64 {
        u64::try_from(self.0.begun.elapsed().as_millis()).unwrap_or(NEVER - 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jobs_do_not_make_room_for_those_who_wait_for_them() {
        let activity = Activity::new();
        assert!(!activity.is_busy(), "nothing came yet");
        activity.touch_by_request("/v1/jobs/0199d3a6");
        activity.touch_by_request("/meetpoint.v1.JobService/GetJob");
        activity.touch_by_request("/metrics");
        assert!(!activity.is_busy(), "none of these counts");
        activity.touch_by_request("/v1/maps/hall/paths");
        assert!(activity.is_busy(), "a query came");
    }
}
