//! Keeps tables ready: of versions that were published, and of costs that were changed.

use std::collections::HashMap;
use std::time::Duration;

use meetpoint_storage::MapId;
use tokio::sync::broadcast::error::RecvError;
use tokio::time::Instant;

use crate::error::Error;
use crate::live::Event;
use crate::service::Service;

/// Has tables made before anybody asks, until the service stops.
pub(crate) async fn keep_ready(service: Service) {
    let settle = Duration::from_millis(service.settings.planning.settle_ms);
    let mut events = service.live.watch();
    // Maps that changed, and when their tables are due.
    let mut due: HashMap<MapId, Instant> = HashMap::new();
    loop {
        let next = due.iter().min_by_key(|(_, at)| **at).map(|(map, at)| (map.clone(), *at));
        let settled = async {
            match &next {
                Some((_, at)) => tokio::time::sleep_until(*at).await,
                None => std::future::pending().await,
            }
        };
        tokio::select! {
            event = events.recv() => match event {
                Ok((map, Event::Version(version))) if version.published => {
                    due.insert(map, Instant::now() + settle);
                }
                // Only where somebody plans.
                Ok((map, Event::Costs(_))) if service.planner.fields.holds(&map) => {
                    due.insert(map, Instant::now());
                }
                Ok(_) | Err(RecvError::Lagged(_)) => {}
                Err(RecvError::Closed) => return,
            },
            () = settled => {
                if let Some((map, _)) = next {
                    due.remove(&map);
                    if let Err(error) = ask_all(&service, &map).await {
                        tracing::debug!(map = map.as_str(), %error, "no tables");
                    }
                }
            }
            () = service.stop.cancelled() => return,
        }
    }
}

/// Asks for the fields of all profiles of a map, which has their tables made.
async fn ask_all(service: &Service, map: &MapId) -> Result<(), Error> {
    let standing = service.standing(&map.0).await?;
    for profile in standing.profiles(&service.settings.planning) {
        service.field(&standing, 0, &profile).await?;
    }
    Ok(())
}
