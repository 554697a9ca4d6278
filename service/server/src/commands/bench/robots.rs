//! Robots that only exist to load the service: their drives are simulated beforehand.

use std::io;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use meetpoint_client::{BatchSource, Outgoing, v1};
use tokio::time::Instant;

use crate::demo::{SimulatedDrive, simulate_office};

/// A robot of the bench: one scan a batch.
pub(super) struct BenchRobot {
    pub(super) open: v1::OpenSessionRequest,
    batches: Arc<[v1::Batch]>,
}

/// How many drives are simulated; more robots share them, each in a session of its own.
const N_SEEDS: u64 = 4;

/// `n` robots with at least some hundred scans each.
pub(super) fn robots(n: usize, map: &str) -> Vec<BenchRobot> {
    let drives: Vec<SimulatedDrive> = (0..N_SEEDS).flat_map(simulate_office).collect();
    let batches: Vec<Arc<[v1::Batch]>> = drives.iter().map(single_scans).collect();
    (0..n)
        .map(|index| {
            let place = index % drives.len();
            let mut open = drives[place].open_request(map, map);
            open.robot = format!("bench-{index}");
            BenchRobot { open, batches: batches[place].clone() }
        })
        .collect()
}

/// The same observations, cut so that each batch has one scan.
fn single_scans(drive: &SimulatedDrive) -> Arc<[v1::Batch]> {
    let mut batches = Vec::new();
    let mut observations = Vec::new();
    for observation in drive.batches.iter().flat_map(|batch| &batch.observations) {
        let is_scan = matches!(observation.kind, Some(v1::observation::Kind::LaserScan(_)));
        observations.push(observation.clone());
        if is_scan {
            let number = batches.len() as u64 + 1;
            batches.push(v1::Batch { number, observations: std::mem::take(&mut observations) });
        }
    }
    batches.into()
}

/// When each batch was ready, for the time until its ack.
#[derive(Clone, Default)]
pub(super) struct ReadyTimes(Arc<Mutex<Vec<Instant>>>);

impl ReadyTimes {
    /// When the batch of that number was ready.
    pub(super) fn of(&self, number: u64) -> Option<Instant> {
        let times = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        times.get(usize::try_from(number).ok()?.checked_sub(1)?).copied()
    }

    fn note(&self, number: u64, ready: Instant) {
        let mut times = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if times.len() as u64 + 1 == number {
            times.push(ready);
        }
    }
}

/// A robot's batches, at a pace or as fast as they are taken, until a time.
pub(super) struct PacedSource {
    batches: Arc<[v1::Batch]>,
    begin: Instant,
    end: Instant,
    /// From one batch to the next; zero for no pace.
    period: Duration,
    ready: ReadyTimes,
}

impl BenchRobot {
    /// What the robot sends from `begin` to `end`.
    pub(super) fn source(
        &self,
        begin: Instant,
        end: Instant,
        period: Duration,
        ready: ReadyTimes,
    ) -> PacedSource {
        PacedSource { batches: self.batches.clone(), begin, end, period, ready }
    }
}

impl BatchSource for PacedSource {
    async fn get(&mut self, number: u64) -> io::Result<Outgoing> {
        let index = usize::try_from(number - 1).unwrap_or(usize::MAX);
        let Some(batch) = self.batches.get(index) else { return Ok(Outgoing::End) };
        let steps = u32::try_from(number).unwrap_or(u32::MAX);
        let due = self.begin + self.period * steps;
        if self.end <= due || self.end <= Instant::now() {
            return Ok(Outgoing::End);
        }
        tokio::time::sleep_until(due).await;
        // A batch that was due counts from then: a robot does not wait for the service to be ready.
        self.ready.note(number, if self.period.is_zero() { Instant::now() } else { due });
        Ok(Outgoing::Batch(batch.clone()))
    }

    async fn forget_through(&mut self, _number: u64) -> io::Result<()> {
        Ok(())
    }
}
