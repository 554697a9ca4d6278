//! Maps, versions and robots on the wire and in records.

use meetpoint_proto::v1;
use meetpoint_storage::{MapRecord, RobotRecord, VersionRecord};

use crate::error::Error;

/// Edge of a cell where nothing else is asked for, in metres: half a door's frame, as most maps have.
const RESOLUTION_DEFAULT_M: f64 = 0.05;
/// Finest and coarsest cells, in metres: lasers do not see finer, doors vanish beyond.
const RESOLUTION_RANGE_M: std::ops::RangeInclusive<f64> = 0.01..=0.5;

/// The edge of a cell that a request asks for, in metres; 0 for the default.
pub(crate) fn resolution_or_default_m(asked_m: f64) -> Result<f64, Error> {
    if asked_m == 0.0 {
        return Ok(RESOLUTION_DEFAULT_M);
    }
    resolution_m("map.resolution_m", asked_m)
}

/// The edge of a cell in metres, if a map can have it.
pub(crate) fn resolution_m(field: &str, asked_m: f64) -> Result<f64, Error> {
    if RESOLUTION_RANGE_M.contains(&asked_m) {
        return Ok(asked_m);
    }
    let (least_m, most_m) = (RESOLUTION_RANGE_M.start(), RESOLUTION_RANGE_M.end());
    Err(Error::field(field, format!("{asked_m} m, must be {least_m} to {most_m} m")))
}

/// A map for the wire.
pub(crate) fn to_wire(record: MapRecord) -> v1::Map {
    let MapRecord {
        id,
        display_name,
        resolution_m,
        published_version,
        latest_version,
        publishes_automatically,
        cost_revision,
        create_time_ns,
    } = record;
    v1::Map {
        id: id.0,
        display_name,
        resolution_m,
        published_version,
        latest_version,
        publishes_automatically,
        cost_revision,
        create_time_ns,
    }
}

/// A version for the wire.
pub(crate) fn version_to_wire(record: &VersionRecord) -> v1::MapVersion {
    let VersionRecord {
        map,
        number,
        published,
        journal_seq,
        n_scans,
        bounds_m,
        create_time_ns,
        origin,
        sonar_weights,
        mapping_parameters,
    } = record;
    v1::MapVersion {
        map: map.0.clone(),
        number: *number,
        published: *published,
        journal_position: u64::try_from(journal_seq.0).unwrap_or(0),
        scans: *n_scans,
        bounding_box: bounds_m.map(|[min_x_m, min_y_m, max_x_m, max_y_m]| v1::BoundingBox {
            min_x_m,
            min_y_m,
            max_x_m,
            max_y_m,
        }),
        create_time_ns: *create_time_ns,
        origin: origin.clone(),
        sonar_weights: sonar_weights.clone(),
        mapping_parameters: mapping_parameters.clone(),
    }
}

/// A robot for the wire.
pub(crate) fn robot_to_wire(record: RobotRecord) -> v1::Robot {
    let RobotRecord { id, display_name, epoch, create_time_ns } = record;
    v1::Robot { id: id.0, display_name, epoch, create_time_ns }
}
