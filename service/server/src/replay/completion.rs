//! Waits until all that a session sent is mapped and in a version.

use std::{future::Future, time::Duration};

use meetpoint_client::{
    Backoff, BackoffParams, Client, Error,
    v1::{Session, SessionState},
};
use tokio::time::{Instant, sleep};

/// Between two looks at the session.
const LOOK_INTERVAL: Duration = Duration::from_millis(100);
/// Between two looks while batches are still sent.
const FOLLOW_INTERVAL: Duration = Duration::from_millis(250);
/// A service that is away for longer, or maps nothing for longer, is given up.
pub(crate) const PATIENCE: Duration = Duration::from_mins(5);
/// Between questions to a service that is away: a person waits at the terminal.
const RETRY: BackoffParams = BackoffParams {
    delay_first: Duration::from_millis(500),
    factor: 2.0,
    delay_max: Duration::from_secs(5),
};

/// Tells `look` of the session again and again, until dropped.
pub(crate) async fn follow(client: &Client, session: &str, look: impl Fn(&Session)) {
    loop {
        sleep(FOLLOW_INTERVAL).await;
        // If the service is away, the delivery says so.
        if let Ok(session) = client.session(session).await {
            look(&session);
        }
    }
}

/// Closes the session, to which `n_readings` were sent, and waits until its end is in a map version.
/// The session, and the version; 0 if no reading of it could be mapped.
///
/// # Errors
///
/// What the service refuses, or that it was away or stood still for [`PATIENCE`].
pub(crate) async fn close_and_wait(
    client: &Client,
    session: &Session,
    n_readings: u64,
    look: impl Fn(&Session),
) -> anyhow::Result<(Session, u64)> {
    let Session { id, epoch, .. } = session;
    if session.state() == SessionState::Open {
        patiently(|| client.close_session(id, *epoch)).await?;
    }
    let mut mapped_through = 0;
    let mut last_progress = Instant::now();
    loop {
        let now = patiently(|| client.session(id)).await?;
        look(&now);
        if 0 < now.complete_in_version || is_empty(&now, n_readings) {
            let version = now.complete_in_version;
            return Ok((now, version));
        }
        if mapped_through < now.mapped_through {
            mapped_through = now.mapped_through;
            last_progress = Instant::now();
        }
        anyhow::ensure!(
            last_progress.elapsed() < PATIENCE,
            "the service has mapped batch {mapped_through} of {} and nothing more for {} s; \
             see its log",
            now.acked_through,
            PATIENCE.as_secs()
        );
        sleep(LOOK_INTERVAL).await;
    }
}

/// True if the session ended and has no reading that a version could hold.
fn is_empty(session: &Session, n_readings: u64) -> bool {
    session.state() != SessionState::Open
        && session.scans == 0
        // Sightings are not counted by the service.
        && n_readings <= session.rejected
        && session.mapped_through == session.acked_through
}

/// Asks again while the service is away.
pub(crate) async fn patiently<T, F: Future<Output = Result<T, Error>>>(
    ask: impl Fn() -> F,
) -> Result<T, Error> {
    let start = Instant::now();
    let mut backoff = Backoff::new(RETRY);
    loop {
        match ask().await {
            Err(error) if error.is_retryable() && start.elapsed() < PATIENCE => {
                sleep(backoff.next_delay(error.retry_after())).await;
            }
            answer => return answer,
        }
    }
}
