//! Observations, cut into numbered batches.
//!
//! The same recording and section always give the same batches, so that a replay can go on where
//! an earlier one stopped. Whoever changes what comes out here raises [`CUT_VERSION`].

use meetpoint_client::v1::{Batch, Observation};

/// Names the way in which recordings become batches; part of the client's key of a session.
pub(crate) const CUT_VERSION: u32 = 1;
/// Scans or sightings a batch: a few hundred batches for an hour's drive, and well below a mebibyte.
pub(crate) const READINGS_MAX: usize = 20;
/// Driving a batch, by stamps: what a robot would send once a second.
const SPAN_MAX_NS: u64 = 1_000_000_000;
/// Observations a batch, half of what the service takes.
const OBSERVATIONS_MAX: usize = 2048;
/// Numbers in the readings of a batch, half of a mebibyte.
const VALUES_MAX: usize = 1 << 17;

/// A batch and what it holds.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CutBatch {
    /// As it is sent.
    pub(crate) batch: Batch,
    /// Readings among its observations: scans, or sightings.
    pub(crate) n_readings: u64,
    /// Stamp of its last observation.
    pub(crate) stamp_ns: i64,
}

/// Makes batches of observations.
#[derive(Debug, Default)]
pub(crate) struct Cutter {
    /// Observations of the batch in the making.
    open: Vec<Observation>,
    n_readings: usize,
    n_values: usize,
    /// Stamp from which the span of the batch in the making counts.
    span_from_ns: Option<i64>,
    number: u64,
}

impl Cutter {
    /// Takes in an observation that is no reading.
    pub(crate) fn push(&mut self, observation: Observation) {
        self.open.push(observation);
    }

    /// Takes in a reading of `n_values` numbers.
    pub(crate) fn push_reading(&mut self, observation: Observation, n_values: usize) {
        self.n_readings += 1;
        self.n_values += n_values;
        self.begin_span(observation.stamp_ns);
        self.open.push(observation);
    }

    /// The span of the batch in the making counts from this stamp, if it does not yet from another.
    /// A reading does so by itself.
    pub(crate) fn begin_span(&mut self, stamp_ns: i64) {
        self.span_from_ns.get_or_insert(stamp_ns);
    }

    /// The batch in the making, if it must not take another observation after one of that stamp.
    pub(crate) fn cut_if_full(&mut self, stamp_ns: i64) -> Option<CutBatch> {
        let long = self.span_from_ns.is_some_and(|first| SPAN_MAX_NS <= first.abs_diff(stamp_ns));
        let full = long
            || READINGS_MAX <= self.n_readings
            || OBSERVATIONS_MAX <= self.open.len()
            || VALUES_MAX <= self.n_values;
        if full { self.cut() } else { None }
    }

    /// Takes the batch in the making, if there is anything in it.
    pub(crate) fn cut(&mut self) -> Option<CutBatch> {
        let stamp_ns = self.open.last()?.stamp_ns;
        self.number += 1;
        let observations = std::mem::take(&mut self.open);
        let n_readings = std::mem::take(&mut self.n_readings) as u64;
        self.n_values = 0;
        self.span_from_ns = None;
        let batch = Batch { number: self.number, observations };
        Some(CutBatch { batch, n_readings, stamp_ns })
    }
}
