//! What a replay did, in words and for machines.

use std::{collections::BTreeMap, fmt};

use meetpoint_client::v1::TrajectoryPose;
use serde_json::{Value, json};

use super::account::{Account, BadLine, Reading};

/// Nanoseconds in a second.
const SECOND_NS: f64 = 1e9;

/// What a replay of one recording did.
#[derive(Clone, Debug)]
pub(crate) struct Report {
    /// The recording.
    pub(crate) file: String,
    /// Where it went.
    pub(crate) map: String,
    /// As whom.
    pub(crate) robot: String,
    /// The service's id of the session.
    pub(crate) session: String,
    /// What the recording consists of.
    pub(crate) reading: Reading,
    /// Readings sent by this replay, without those of earlier ones.
    pub(crate) n_sent: u64,
    /// Readings that the session holds.
    pub(crate) n_readings: u64,
    /// Observations that the service rejected, in all.
    pub(crate) n_rejected: u64,
    /// Rejections that this replay heard of, by code.
    pub(crate) rejected: BTreeMap<String, u64>,
    /// Connections that were made anew.
    pub(crate) n_reconnects: u64,
    /// Seconds taken.
    pub(crate) took_s: f64,
    /// Driving mapped per time taken; `None` if an earlier replay had sent it all.
    pub(crate) times_real_time: Option<f64>,
    /// Stretches in which the tracker was lost.
    pub(crate) lost: Vec<LostSpan>,
    /// The map version that holds all; 0 if nothing was there to map.
    pub(crate) map_version: u64,
    /// True if that version is the one that queries are answered from.
    pub(crate) published: bool,
    /// True if nothing was left to do.
    pub(crate) was_done: bool,
}

/// A stretch in which the tracker did not know where the robot is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LostSpan {
    /// First stamp.
    pub(crate) from_ns: i64,
    /// Last stamp.
    pub(crate) through_ns: i64,
    /// Poses in it: of scans, or of sightings.
    pub(crate) n_poses: u64,
}

/// The stretches of a trajectory in which the tracker was lost.
pub(crate) fn lost_spans(poses: &[TrajectoryPose]) -> Vec<LostSpan> {
    poses
        .chunk_by(|one, next| one.lost == next.lost)
        .filter(|run| run.iter().any(|pose| pose.lost))
        .map(|run| {
            let stamps_ns = || run.iter().map(|pose| pose.stamp_ns);
            LostSpan {
                from_ns: stamps_ns().min().unwrap_or_default(),
                through_ns: stamps_ns().max().unwrap_or_default(),
                n_poses: run.len() as u64,
            }
        })
        .collect()
}

impl Report {
    /// One object for machines.
    pub(crate) fn to_json(&self, account: &Account) -> Value {
        let lost: Vec<_> = self
            .lost
            .iter()
            .map(|&LostSpan { from_ns, through_ns, n_poses }| {
                json!({
                    "from_ns": integer(from_ns),
                    "through_ns": integer(through_ns),
                    "scans": n_poses,
                })
            })
            .collect();
        let bad: Vec<_> = account
            .bad
            .first
            .iter()
            .map(|BadLine { file, line, reason }| {
                let mut told = json!({"line": line, "reason": reason});
                if let Some(file) = file {
                    told["file"] = json!(file);
                }
                told
            })
            .collect();
        let readings = self.reading.plural();
        let mut told = json!({
            "file": self.file,
            "map": self.map,
            "robot": self.robot,
            "session": self.session,
            "rejected": self.n_rejected,
            "rejected_by_code": self.rejected,
            "reconnects": self.n_reconnects,
            "lines": account.n_lines,
            "lines_skipped": account.skipped,
            "lines_bad": account.bad.n,
            "bad": bad,
            "broken_off": account.broken_off,
            "took_s": self.took_s,
            "times_real_time": self.times_real_time,
            "lost": lost,
            "map_version": self.map_version,
            "published": self.published,
            "was_done": self.was_done,
        });
        told[format!("{readings}_sent")] = json!(self.n_sent);
        told[readings] = json!(self.n_readings);
        told
    }

    /// What a person would want to do now.
    pub(crate) fn next_step(&self) -> String {
        let Self { map, session, .. } = self;
        match self.reading {
            Reading::Scan => format!("next: meetpoint map {map}; meetpoint trajectory {session}"),
            Reading::Sighting => format!("next: meetpoint trajectory {session}"),
        }
    }

    fn version_in_words(&self) -> String {
        match (self.map_version, self.published) {
            (0, _) => "no map version: there was nothing to map".to_owned(),
            (n, true) => format!("map `{}` version {n}, published", self.map),
            (n, false) => format!(
                "map `{}` version {n}, not published: its pointer was moved by a person",
                self.map
            ),
        }
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { file, robot, session, .. } = self;
        let readings = self.reading.plural();
        writeln!(f, "{file}: robot `{robot}`, session {session}")?;
        if self.was_done {
            writeln!(f, "  was replayed before, to the end: nothing to do")?;
        } else {
            let (sent, all, took_s) = (self.n_sent, self.n_readings, self.took_s);
            write!(f, "  {sent} {readings} sent, {all} in the session; {took_s:.1} s")?;
            match self.times_real_time {
                Some(ratio) => writeln!(f, ", {ratio:.0} times real time")?,
                None => writeln!(f)?,
            }
        }
        if 0 < self.n_reconnects {
            writeln!(f, "  connected anew {} times", self.n_reconnects)?;
        }
        write!(f, "  {} observations rejected", self.n_rejected)?;
        writeln!(f, "{}", counts(&self.rejected))?;
        let n_lost: u64 = self.lost.iter().map(|span| span.n_poses).sum();
        if n_lost == 0 {
            writeln!(f, "  the robot was never lost")?;
        } else {
            writeln!(
                f,
                "  the robot was lost {} times, {n_lost} {readings} in all:",
                self.lost.len()
            )?;
            for span in &self.lost {
                let LostSpan { from_ns, through_ns, n_poses } = span;
                let seconds = through_ns.abs_diff(*from_ns) as f64 / SECOND_NS;
                writeln!(f, "    {n_poses} {readings} in {seconds:.1} s from stamp {from_ns} ns")?;
            }
        }
        write!(f, "  {}", self.version_in_words())
    }
}

/// A number, as a string where a double cannot hold it.
fn integer(number: i64) -> Value {
    if number.unsigned_abs() < 1 << 53 { json!(number) } else { json!(number.to_string()) }
}

/// What the first pass had to leave out, in words; empty if nothing.
pub(crate) fn left_out(account: &Account) -> Vec<String> {
    let mut lines = Vec::new();
    if !account.skipped.is_empty() {
        let n: u64 = account.skipped.values().sum();
        lines.push(format!("  {n} lines not sent{}", counts(&account.skipped)));
    }
    if 0 < account.bad.n {
        lines.push(format!("  {} bad lines left out, the first of them:", account.bad.n));
        let shown = account.bad.first.iter();
        lines.extend(shown.map(|BadLine { file, line, reason }| match file {
            Some(file) => format!("    {file}, line {line}: {reason}"),
            None => format!("    line {line}: {reason}"),
        }));
    }
    if let Some(reason) = &account.broken_off {
        lines.push(format!("  {reason}; what stands before is used"));
    }
    lines
}

/// `: NAME 3, OTHER 1`, or nothing.
fn counts(counts: &BTreeMap<String, u64>) -> String {
    let parts: Vec<_> = counts.iter().map(|(name, n)| format!("{name} {n}")).collect();
    if parts.is_empty() { String::new() } else { format!(": {}", parts.join(", ")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stamps_of_today_are_strings_in_json() {
        assert_eq!(integer(-5), json!(-5), "a double holds it");
        assert_eq!(integer(976_052_857_337_530_001), json!("976052857337530001"), "not this one");
    }

    #[test]
    fn lost_scans_in_a_row_are_one_span() {
        let pose = |stamp_ns, lost| TrajectoryPose { stamp_ns, lost, ..TrajectoryPose::default() };
        let drawn = "..###.#";
        let poses: Vec<_> = drawn
            .chars()
            .zip(0..)
            .map(|(letter, stamp_ns)| pose(stamp_ns, letter == '#'))
            .collect();
        let expected = [
            LostSpan { from_ns: 2, through_ns: 4, n_poses: 3 },
            LostSpan { from_ns: 6, through_ns: 6, n_poses: 1 },
        ];
        assert_eq!(lost_spans(&poses), expected, "{drawn}");
    }
}
