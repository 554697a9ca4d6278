//! The client against a session service on loopback that misbehaves.

mod delivery;
mod fake;
mod robot_session;

use std::time::Duration;

use meetpoint_client::{BackoffParams, DeliveryParams};

/// Fast enough for a test, and still a wait.
pub(crate) const FAST: DeliveryParams = DeliveryParams {
    backoff: BackoffParams {
        delay_first: Duration::from_millis(1),
        factor: 2.0,
        delay_max: Duration::from_millis(4),
    },
    attach_timeout: Duration::from_secs(5),
    ack_timeout: Duration::from_secs(5),
    give_up_after: None,
};
