//! Times of many runs.

use std::hint::black_box;
use std::time::Instant;

/// Times of single queries, in microseconds.
pub(crate) struct Sample {
    sorted_us: Vec<f64>,
}

impl Sample {
    /// Times `query` on every pair, after a tenth of them untimed.
    pub(crate) fn of<T>(
        pairs: &[(usize, usize)],
        mut query: impl FnMut(usize, usize) -> T,
    ) -> Self {
        for &(from, to) in &pairs[..pairs.len() / 10] {
            black_box(query(from, to));
        }
        let mut sorted_us: Vec<f64> = pairs
            .iter()
            .map(|&(from, to)| {
                let start = Instant::now();
                black_box(query(from, to));
                start.elapsed().as_secs_f64() * 1e6
            })
            .collect();
        sorted_us.sort_by(f64::total_cmp);
        Self { sorted_us }
    }

    pub(crate) fn mean_us(&self) -> f64 {
        self.sorted_us.iter().sum::<f64>() / self.sorted_us.len().max(1) as f64
    }

    pub(crate) fn percentile_us(&self, percent: usize) -> f64 {
        let last = self.sorted_us.len().saturating_sub(1);
        self.sorted_us.get(last * percent / 100).copied().unwrap_or(f64::NAN)
    }

    /// A line of a table.
    pub(crate) fn line(&self, name: &str) -> String {
        let [p50, p99] = [50, 99].map(|percent| self.percentile_us(percent));
        let n = self.sorted_us.len();
        format!("| {name} | {n} | {:.2} | {p50:.2} | {p99:.2} |", self.mean_us())
    }
}
