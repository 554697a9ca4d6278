//! Settings: `settings.toml` compiled in, then a file, the environment and flags; later wins.

mod merging;

use std::path::{Path, PathBuf};

use serde::Deserialize;

pub use merging::MergingSettings;

/// The defaults, each with its unit and reason.
pub const DEFAULTS: &str = include_str!("../settings.toml");

/// Prefix of environment variables that override a setting.
const ENVIRONMENT_PREFIX: &str = "MEETPOINT_";

/// All settings. The meaning of each stands in `settings.toml`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "each field is explained in settings.toml, once")]
pub struct Settings {
    pub server: ServerSettings,
    pub limits: Limits,
    pub journal: JournalSettings,
    pub mapping: MappingSettings,
    pub planning: PlanningSettings,
    pub hypotheses: HypothesisSettings,
    pub qualitative: QualitativeSettings,
    pub jobs: JobSettings,
    pub merging: MergingSettings,
}

/// Where and how to listen.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "each field is explained in settings.toml, once")]
pub struct ServerSettings {
    pub host: std::net::IpAddr,
    pub port: u16,
    pub data: PathBuf,
    pub n_connections_max: usize,
    pub header_timeout_ms: u64,
    pub drain_ms: u64,
}

/// What is taken from outside, at most.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "each field is explained in settings.toml, once")]
pub struct Limits {
    pub batch_bytes_max: u32,
    pub observations_max: u32,
    pub n_in_flight_max: u32,
    pub request_bytes_max: usize,
    pub grid_cells_max: u64,
    pub import_bytes_max: usize,
    pub import_cells_max: u64,
    pub page_size_max: u32,
    pub page_size_default: u32,
    pub stamp_back_max_s: f64,
    pub stamp_ahead_max_s: f64,
    pub n_stamps_remembered: usize,
}

/// How batches become durable.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "each field is explained in settings.toml, once")]
pub struct JournalSettings {
    pub group_n_max: usize,
    pub group_bytes_max: usize,
    pub queue_n_max: usize,
    pub busy_timeout_ms: u64,
    pub n_readers: u32,
}

/// How maps grow.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "each field is explained in settings.toml, once")]
pub struct MappingSettings {
    pub n_maps_at_once: usize,
    pub snapshot_scans: u64,
    pub idle_snapshot_ms: u64,
    pub moved_snapshot_ms: u64,
    pub idle_stop_s: u64,
    pub read_ahead_n_max: u32,
    pub read_ahead_bytes_max: usize,
    pub lease_ttl_s: u32,
    pub topology_cells_max: u64,
    pub sonar_weights: PathBuf,
    pub sonar_following_weights: PathBuf,
}

/// How paths are planned.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "each field is explained in settings.toml, once")]
pub struct PlanningSettings {
    pub robot_radius_m: f64,
    pub clearance_distance_m: f64,
    pub clearance_factor: f64,
    pub occupancy_factor: f64,
    pub snap_tolerance_m: f64,
    pub memory_bytes_max: usize,
    pub pair_bytes_max: usize,
    pub n_builds_at_once: usize,
    pub settle_ms: u64,
    pub matrix_pairs_max: u64,
    pub n_costs_max: usize,
    pub n_profiles_max: usize,
}

/// How many maps of places are kept.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "each field is explained in settings.toml, once")]
pub struct HypothesisSettings {
    pub n_kept_max: usize,
    pub n_visits_max: usize,
}

/// How far robots explore that are told step by step.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "each field is explained in settings.toml, once")]
pub struct QualitativeSettings {
    pub n_places_max: usize,
    pub n_firings_max: u64,
    pub n_kept_max: usize,
}

/// How work in the background is done.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "each field is explained in settings.toml, once")]
pub struct JobSettings {
    pub n_at_once: usize,
    pub cpu_share: f64,
    pub n_threads: usize,
    pub closing_way_m: f64,
    pub closing_pace_max: f64,
    pub closing_cpu_share: f64,
    pub scans_bytes_max: usize,
}

/// Why settings could not be used.
#[derive(Debug, thiserror::Error)]
pub enum InvalidSettings {
    /// The file could not be read.
    #[error("cannot read {path}: {source}")]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A key is unknown, missing or has a value of another type.
    #[error("{origin}: {problem}")]
    Malformed {
        /// The file, or the environment variable.
        origin: String,
        /// What is wrong.
        problem: String,
    },
    /// A value lies outside of what makes sense.
    #[error("{key} = {value}: must be at least {least}")]
    TooSmall {
        /// The setting.
        key: &'static str,
        /// What was given.
        value: u64,
        /// The least that works.
        least: u64,
    },
    /// A value is no share.
    #[error("{key} = {value}: must lie in (0, 1]")]
    NoShare {
        /// The setting.
        key: &'static str,
        /// What was given.
        value: f64,
    },
}

/// Reads the settings: defaults, then `file`, then the variables of `environment`.
///
/// # Errors
/// [`InvalidSettings`], naming the place.
pub fn read(
    file: Option<&Path>,
    environment: impl Iterator<Item = (String, String)>,
) -> Result<Settings, InvalidSettings> {
    let mut table = parse("the compiled-in settings.toml", DEFAULTS)?;
    if let Some(path) = file {
        let text = std::fs::read_to_string(path)
            .map_err(|source| InvalidSettings::Unreadable { path: path.to_owned(), source })?;
        lay_over(&mut table, parse(&path.display().to_string(), &text)?);
    }
    for (name, value) in environment {
        set_from_environment(&mut table, &name, &value)?;
    }
    let settings: Settings = table.try_into().map_err(|error: toml::de::Error| {
        InvalidSettings::Malformed { origin: "settings".into(), problem: error.to_string() }
    })?;
    check(&settings)?;
    Ok(settings)
}

fn parse(origin: &str, text: &str) -> Result<toml::Table, InvalidSettings> {
    text.parse().map_err(|error: toml::de::Error| InvalidSettings::Malformed {
        origin: origin.to_owned(),
        problem: error.to_string(),
    })
}

fn lay_over(below: &mut toml::Table, above: toml::Table) {
    for (key, value) in above {
        match (below.get_mut(&key), value) {
            (Some(toml::Value::Table(inner)), toml::Value::Table(upper)) => lay_over(inner, upper),
            (_, value) => {
                below.insert(key, value);
            }
        }
    }
}

/// `MEETPOINT_SERVER__PORT=8080`; names that do not have that shape are not ours.
fn set_from_environment(
    table: &mut toml::Table,
    name: &str,
    value: &str,
) -> Result<(), InvalidSettings> {
    let Some((section, key)) =
        name.strip_prefix(ENVIRONMENT_PREFIX).and_then(|rest| rest.split_once("__"))
    else {
        return Ok(());
    };
    let malformed = |problem: &str| InvalidSettings::Malformed {
        origin: name.to_owned(),
        problem: problem.to_owned(),
    };
    let (section, key) = (section.to_lowercase(), key.to_lowercase());
    let slot = table
        .get_mut(&section)
        .and_then(toml::Value::as_table_mut)
        .and_then(|section| section.get_mut(&key))
        .ok_or_else(|| malformed("no such setting"))?;
    *slot = match slot {
        toml::Value::Integer(_) => {
            toml::Value::Integer(value.parse().map_err(|_| malformed("not a whole number"))?)
        }
        toml::Value::Float(_) => {
            toml::Value::Float(value.parse().map_err(|_| malformed("not a number"))?)
        }
        toml::Value::Boolean(_) => {
            toml::Value::Boolean(value.parse().map_err(|_| malformed("not true or false"))?)
        }
        _ => toml::Value::String(value.to_owned()),
    };
    Ok(())
}

fn check(settings: &Settings) -> Result<(), InvalidSettings> {
    let Settings {
        server,
        limits,
        journal,
        mapping,
        planning,
        hypotheses,
        qualitative,
        jobs,
        merging,
    } = settings;
    let least = [
        ("server.n_connections_max", server.n_connections_max as u64, 1),
        ("limits.batch_bytes_max", u64::from(limits.batch_bytes_max), 1024),
        ("limits.observations_max", u64::from(limits.observations_max), 1),
        ("limits.n_in_flight_max", u64::from(limits.n_in_flight_max), 1),
        ("limits.request_bytes_max", limits.request_bytes_max as u64, 65536),
        ("limits.import_bytes_max", limits.import_bytes_max as u64, 1024),
        ("limits.import_cells_max", limits.import_cells_max, 1),
        ("limits.page_size_max", u64::from(limits.page_size_max), 1),
        ("limits.page_size_default", u64::from(limits.page_size_default), 1),
        ("journal.group_n_max", journal.group_n_max as u64, 1),
        ("journal.group_bytes_max", journal.group_bytes_max as u64, 1),
        ("journal.queue_n_max", journal.queue_n_max as u64, 1),
        ("journal.n_readers", u64::from(journal.n_readers), 1),
        ("mapping.snapshot_scans", mapping.snapshot_scans, 1),
        ("mapping.idle_snapshot_ms", mapping.idle_snapshot_ms, 1),
        ("mapping.moved_snapshot_ms", mapping.moved_snapshot_ms, 1),
        ("mapping.idle_stop_s", mapping.idle_stop_s, 1),
        ("mapping.read_ahead_n_max", u64::from(mapping.read_ahead_n_max), 1),
        ("mapping.read_ahead_bytes_max", mapping.read_ahead_bytes_max as u64, 1),
        ("mapping.lease_ttl_s", u64::from(mapping.lease_ttl_s), 3),
        ("planning.n_builds_at_once", planning.n_builds_at_once as u64, 1),
        ("planning.matrix_pairs_max", planning.matrix_pairs_max, 1),
        ("hypotheses.n_kept_max", hypotheses.n_kept_max as u64, 1),
        ("hypotheses.n_visits_max", hypotheses.n_visits_max as u64, 1),
        ("qualitative.n_places_max", qualitative.n_places_max as u64, 1),
        ("qualitative.n_firings_max", qualitative.n_firings_max, 1),
        ("qualitative.n_kept_max", qualitative.n_kept_max as u64, 1),
        ("jobs.n_at_once", jobs.n_at_once as u64, 1),
        ("jobs.scans_bytes_max", jobs.scans_bytes_max as u64, 1),
        ("merging.n_scans_again", merging.n_scans_again, 1),
    ];
    let shares = [
        ("jobs.cpu_share", jobs.cpu_share),
        ("jobs.closing_cpu_share", jobs.closing_cpu_share),
        ("merging.agreement_min", merging.agreement_min),
        ("merging.contradiction_max", merging.contradiction_max),
        ("merging.landmarks_contradiction_max", merging.landmarks_contradiction_max),
    ];
    let is_share = |value: f64| 0.0 < value && value <= 1.0;
    if let Some((key, value)) = shares.into_iter().find(|&(_, value)| !is_share(value)) {
        return Err(InvalidSettings::NoShare { key, value });
    }
    match least.into_iter().find(|&(_, value, least)| value < least) {
        Some((key, value, least)) => Err(InvalidSettings::TooSmall { key, value, least }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn environment(pairs: &[(&str, &str)]) -> impl Iterator<Item = (String, String)> {
        pairs
            .iter()
            .map(|(name, value)| ((*name).to_owned(), (*value).to_owned()))
            .collect::<Vec<_>>()
            .into_iter()
    }

    #[test]
    fn the_defaults_are_complete() {
        let settings = read(None, environment(&[])).expect("compiled in");
        assert_eq!(settings.server.port, 7373, "the documented port");
    }

    #[test]
    fn the_environment_wins() {
        let settings =
            read(None, environment(&[("MEETPOINT_SERVER__PORT", "0"), ("PATH", "/bin")]));
        assert_eq!(settings.expect("valid").server.port, 0, "as the environment says");
    }

    #[test]
    fn says_where_it_is_wrong() {
        let typed = read(None, environment(&[("MEETPOINT_SERVER__PORT", "many")]));
        assert_eq!(
            typed.expect_err("not a number").to_string(),
            "MEETPOINT_SERVER__PORT: not a whole number",
            "the variable is named"
        );
        let small = read(None, environment(&[("MEETPOINT_JOURNAL__QUEUE_N_MAX", "0")]));
        assert_eq!(
            small.expect_err("nothing would get through").to_string(),
            "journal.queue_n_max = 0: must be at least 1",
            "value and limit"
        );
        let idle = read(None, environment(&[("MEETPOINT_JOBS__CPU_SHARE", "0")]));
        assert_eq!(
            idle.expect_err("it would never end").to_string(),
            "jobs.cpu_share = 0: must lie in (0, 1]",
            "value and limits"
        );
    }
}
