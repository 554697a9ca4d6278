//! Sends the drives of the demo to the service, as robots would.

use std::{io, sync::Arc, time::Duration};

use anyhow::Context;
use meetpoint_client::{BatchSource, Client, DeliveryParams, Outgoing, SessionName, deliver, v1};
use tokio::{sync::watch, task::JoinSet, time::sleep};

use super::drives::SimulatedDrive;

/// The robots' name for their run.
const KEY: &str = "demo";
/// Between two looks at whether a session is mapped.
pub(super) const LOOK_INTERVAL: Duration = Duration::from_millis(100);
/// As robots deliver, but a demo gives up where a robot would go on trying.
const PARAMS: DeliveryParams =
    DeliveryParams { give_up_after: Some(Duration::from_secs(30)), ..DeliveryParams::ROBOT };

/// Sends all drives at once, and waits until all is mapped and published. The sessions, in the
/// drives' order.
pub(super) async fn deliver_all(
    client: &Client,
    map: &str,
    drives: &[SimulatedDrive],
) -> anyhow::Result<Vec<v1::Session>> {
    let mut sessions = Vec::new();
    for drive in drives {
        let (session, _) = client
            .open_session(drive.open_request(map, KEY))
            .await
            .with_context(|| format!("cannot open a session for {}", drive.robot))?;
        sessions.push(session);
    }
    let mut deliveries = JoinSet::new();
    for ((drive, session), mut source) in drives.iter().zip(&sessions).zip(in_turn(drives)) {
        let (client, robot, name) =
            (client.clone(), drive.robot.clone(), SessionName::from(session));
        deliveries.spawn(async move {
            let delivered = deliver(&client, &name, &mut source, &PARAMS, |_| ()).await;
            delivered.with_context(|| format!("{robot} could not deliver"))
        });
    }
    while let Some(delivered) = deliveries.join_next().await {
        delivered.context("a delivery failed")??;
    }
    for session in &sessions {
        client.close_session(&session.id, session.epoch).await?;
    }
    for session in &mut sessions {
        *session = published(client, &session.id).await?;
    }
    Ok(sessions)
}

/// The session once a version of the map holds all of it.
async fn published(client: &Client, session: &str) -> anyhow::Result<v1::Session> {
    loop {
        let now = client.session(session).await?;
        if 0 < now.complete_in_version {
            return Ok(now);
        }
        sleep(LOOK_INTERVAL).await;
    }
}

/// A drive as a source of batches that waits for its turn.
struct TurnSource {
    batches: Arc<[v1::Batch]>,
    /// Batches that the service keeps of this robot.
    acked: watch::Sender<u64>,
    /// Batches that it keeps of the robot whose turn is before this one's.
    acked_before: watch::Receiver<u64>,
    /// True for the robot that begins each round.
    begins: bool,
}

/// The drives as sources that take turns, a batch each: maps are drawn in the order in which
/// batches were committed, and so the same seed gives the same map.
fn in_turn(drives: &[SimulatedDrive]) -> Vec<TurnSource> {
    let (senders, mut receivers): (Vec<_>, Vec<_>) =
        drives.iter().map(|_| watch::channel(0)).unzip();
    receivers.rotate_right(1.min(drives.len()));
    let turns = drives.iter().zip(senders).zip(receivers).enumerate();
    turns
        .map(|(index, ((drive, acked), acked_before))| TurnSource {
            batches: Arc::clone(&drive.batches),
            acked,
            acked_before,
            begins: index == 0,
        })
        .collect()
}

impl BatchSource for TurnSource {
    async fn get(&mut self, number: u64) -> io::Result<Outgoing> {
        let index = usize::try_from(number - 1).unwrap_or(usize::MAX);
        let Some(batch) = self.batches.get(index) else { return Ok(Outgoing::End) };
        let needed = if self.begins { number - 1 } else { number };
        // An error says that the other robot is gone, which its own delivery tells: go on.
        let _ = self.acked_before.wait_for(|&acked| needed <= acked).await;
        Ok(Outgoing::Batch(batch.clone()))
    }

    async fn forget_through(&mut self, number: u64) -> io::Result<()> {
        // Who has nothing left to say keeps nobody waiting.
        let is_all = self.batches.len() as u64 <= number;
        self.acked.send_replace(if is_all { u64::MAX } else { number });
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn source(begins: bool, n_batches: u64) -> (TurnSource, watch::Sender<u64>) {
        let batch = |number| v1::Batch { number, observations: Vec::new() };
        let (before, acked_before) = watch::channel(0);
        let (acked, _) = watch::channel(0);
        let batches = (1..=n_batches).map(batch).collect();
        (TurnSource { batches, acked, acked_before, begins }, before)
    }

    /// True if the source gives that batch at once.
    async fn gives(source: &mut TurnSource, number: u64) -> bool {
        tokio::select! {
            biased;
            outgoing = source.get(number) => outgoing.is_ok(),
            () = std::future::ready(()) => false,
        }
    }

    #[tokio::test]
    async fn one_batch_each_in_turn() {
        let (mut first, last_acked) = source(true, 3);
        assert!(gives(&mut first, 1).await, "the first begins");
        assert!(!gives(&mut first, 2).await, "the last is not done with the round");
        last_acked.send_replace(1);
        assert!(gives(&mut first, 2).await, "the next round");
        let (mut second, first_acked) = source(false, 3);
        assert!(!gives(&mut second, 1).await, "after the first");
        first_acked.send_replace(1);
        assert!(gives(&mut second, 1).await, "its turn");
    }

    #[tokio::test]
    async fn who_is_done_keeps_nobody_waiting() {
        let (mut short, _before) = source(true, 2);
        short.forget_through(1).await.expect("nothing to remove");
        assert_eq!(*short.acked.borrow(), 1, "one of two");
        short.forget_through(2).await.expect("nothing to remove");
        assert_eq!(*short.acked.borrow(), u64::MAX, "all");
        assert!(matches!(short.get(3).await, Ok(Outgoing::End)), "nothing more");
    }
}
