//! How far a replay is, for people who wait.

use std::{
    sync::atomic::{AtomicU64, Ordering},
    time::{Duration, Instant},
};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use meetpoint_client::v1::Session;

use super::{account::Reading, log_source::Tally};

/// Redraws a second.
const REDRAWS_HZ: u8 = 8;
/// Refreshes the time on the bar while nothing else happens.
const TICK: Duration = Duration::from_millis(250);

/// How far a replay is, in numbers of batches, and the bar that shows it in scans or sightings.
pub(crate) struct Progress {
    bar: ProgressBar,
    quiet: bool,
    reading: Reading,
    n_readings: u64,
    driving_s: f64,
    tally: Tally,
    start: Instant,
    /// The last batch on its way or further.
    sent: AtomicU64,
    /// The last batch that is durable at the service.
    acked: AtomicU64,
    /// The last batch that was mapped when this replay began.
    mapped_before: AtomicU64,
    /// The last batch that is in the map.
    mapped: AtomicU64,
    /// Scans that the service says it has.
    n_received: AtomicU64,
}

impl Progress {
    /// Nothing done of `n_readings` readings, which took `driving_s` seconds to drive and are counted by
    /// `tally`. Shown on the standard error output if that is a terminal and `quiet` is not set.
    pub(crate) fn new(
        (reading, n_readings): (Reading, u64),
        driving_s: f64,
        tally: Tally,
        quiet: bool,
    ) -> Self {
        let target = if quiet {
            ProgressDrawTarget::hidden()
        } else {
            ProgressDrawTarget::stderr_with_hz(REDRAWS_HZ)
        };
        let bar = ProgressBar::with_draw_target(Some(n_readings), target);
        if let Ok(style) = ProgressStyle::with_template("{elapsed_precise} [{bar:30}] {msg}") {
            bar.set_style(style.progress_chars("=> "));
        }
        bar.enable_steady_tick(TICK);
        Self {
            bar,
            quiet,
            reading,
            n_readings,
            driving_s,
            tally,
            start: Instant::now(),
            sent: AtomicU64::new(0),
            acked: AtomicU64::new(0),
            mapped_before: AtomicU64::new(0),
            mapped: AtomicU64::new(0),
            n_received: AtomicU64::new(0),
        }
    }

    /// The session as it is before anything is sent: an earlier replay came so far.
    pub(crate) fn resume(&self, session: &Session) {
        self.mapped_before.store(session.mapped_through, Ordering::Relaxed);
        self.sent_through(session.acked_through);
        self.look(session);
    }

    /// The session as it is now.
    pub(crate) fn look(&self, session: &Session) {
        self.mapped.fetch_max(session.mapped_through, Ordering::Relaxed);
        self.n_received.fetch_max(session.scans, Ordering::Relaxed);
        self.acked_through(session.acked_through);
    }

    /// All up to this batch are on their way or further.
    pub(crate) fn sent_through(&self, number: u64) {
        self.sent.fetch_max(number, Ordering::Relaxed);
    }

    /// All up to this batch are durable at the service.
    pub(crate) fn acked_through(&self, number: u64) {
        self.acked.fetch_max(number, Ordering::Relaxed);
        self.draw();
    }

    /// A line above the bar; on the standard error output.
    pub(crate) fn say(&self, line: &str) {
        if !self.quiet {
            self.bar.suspend(|| eprintln!("{line}"));
        }
    }

    /// Takes the bar away.
    pub(crate) fn finish(&self) {
        self.bar.finish_and_clear();
    }

    /// Since the beginning.
    pub(crate) fn took(&self) -> Duration {
        self.start.elapsed()
    }

    /// Readings acknowledged. The service's count lags, and ours begins when the file is read.
    pub(crate) fn n_acked(&self) -> u64 {
        self.readings_through(&self.acked).max(self.n_received.load(Ordering::Relaxed))
    }

    /// Driving mapped per time taken, since the beginning. `None` if this replay has read nothing.
    pub(crate) fn times_real_time(&self) -> Option<f64> {
        let before = self.readings_through(&self.mapped_before);
        let mapped = self.readings_through(&self.mapped).saturating_sub(before);
        let share = mapped as f64 / self.n_readings.max(1) as f64;
        let ratio = self.driving_s * share / self.took().as_secs_f64().max(f64::EPSILON);
        (0 < mapped).then_some(ratio)
    }

    fn readings_through(&self, number: &AtomicU64) -> u64 {
        self.tally.readings_through(number.load(Ordering::Relaxed))
    }

    fn draw(&self) {
        if self.bar.is_hidden() {
            return;
        }
        let mapped = self.readings_through(&self.mapped);
        self.bar.set_position(mapped);
        self.bar.set_message(format!(
            "{mapped} of {} {} mapped, {} sent, {} kept, {:.0} x real time",
            self.n_readings,
            self.reading.plural(),
            self.readings_through(&self.sent),
            self.n_acked(),
            self.times_real_time().unwrap_or(0.0),
        ));
    }
}
