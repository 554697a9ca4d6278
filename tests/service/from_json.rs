//! REST's JSON as messages.

use meetpoint_client::v1;
use serde_json::Value;

pub(crate) fn text(value: &Value) -> String {
    value.as_str().unwrap_or_default().to_owned()
}

/// A 64-bit count: a number, or digits where it is large; 0 where it is absent.
pub(crate) fn unsigned(value: &Value) -> u64 {
    match value {
        Value::Null => 0,
        Value::String(digits) => digits.parse().expect("digits"),
        number => number.as_u64().unwrap_or_else(|| panic!("{number} is no count")),
    }
}

/// A time in nanoseconds.
pub(crate) fn signed(value: &Value) -> i64 {
    match value {
        Value::String(digits) => digits.parse().expect("digits"),
        number => number.as_i64().unwrap_or_else(|| panic!("{number} is no time")),
    }
}

pub(crate) fn small(value: &Value) -> u32 {
    u32::try_from(unsigned(value)).expect("a small count")
}

pub(crate) fn real(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

pub(crate) fn truth(value: &Value) -> bool {
    value.as_bool().unwrap_or_else(|| panic!("{value} is neither true nor false"))
}

/// What stands at a name, if anything does.
pub(crate) fn present<'a>(body: &'a Value, name: &str) -> Option<&'a Value> {
    body.get(name).inspect(|value| assert!(!value.is_null(), "`{name}` is absent, not null"))
}

pub(crate) fn rows<T>(list: &Value, row: impl FnMut(&Value) -> T) -> Vec<T> {
    list.as_array().unwrap_or_else(|| panic!("{list} is no list")).iter().map(row).collect()
}

pub(crate) fn map(body: &Value) -> v1::Map {
    v1::Map {
        id: text(&body["id"]),
        display_name: text(&body["display_name"]),
        resolution_m: real(&body["resolution_m"]),
        published_version: unsigned(&body["published_version"]),
        latest_version: unsigned(&body["latest_version"]),
        publishes_automatically: truth(&body["publishes_automatically"]),
        cost_revision: unsigned(&body["cost_revision"]),
        create_time_ns: signed(&body["create_time_ns"]),
    }
}

pub(crate) fn version(body: &Value) -> v1::MapVersion {
    v1::MapVersion {
        map: text(&body["map"]),
        number: unsigned(&body["number"]),
        published: truth(&body["published"]),
        journal_position: unsigned(&body["journal_position"]),
        scans: unsigned(&body["scans"]),
        bounding_box: present(body, "bounding_box").map(bounding_box),
        create_time_ns: signed(&body["create_time_ns"]),
        origin: text(&body["origin"]),
        sonar_weights: text(&body["sonar_weights"]),
        mapping_parameters: text(&body["mapping_parameters"]),
    }
}

pub(crate) fn bounding_box(body: &Value) -> v1::BoundingBox {
    v1::BoundingBox {
        min_x_m: real(&body["min_x_m"]),
        min_y_m: real(&body["min_y_m"]),
        max_x_m: real(&body["max_x_m"]),
        max_y_m: real(&body["max_y_m"]),
    }
}

pub(crate) fn import(body: &Value) -> v1::ImportMapResponse {
    let cells = &body["cells"];
    let cells = v1::ImportedCells {
        origin: Some(point(&cells["origin"])),
        width: small(&cells["width"]),
        height: small(&cells["height"]),
        free: unsigned(&cells["free"]),
        occupied: unsigned(&cells["occupied"]),
        unknown: unsigned(&cells["unknown"]),
        shift_x_m: real(&cells["shift_x_m"]),
        shift_y_m: real(&cells["shift_y_m"]),
        turn_rad: real(&cells["turn_rad"]),
    };
    v1::ImportMapResponse {
        map: Some(map(&body["map"])),
        map_version: unsigned(&body["map_version"]),
        journal_position: unsigned(&body["journal_position"]),
        already_imported: truth(&body["already_imported"]),
        cells: Some(cells),
        warnings: rows(&body["warnings"], text),
    }
}

pub(crate) fn point(body: &Value) -> v1::Point {
    v1::Point { x_m: real(&body["x_m"]), y_m: real(&body["y_m"]) }
}

pub(crate) fn robot(body: &Value) -> v1::Robot {
    v1::Robot {
        id: text(&body["id"]),
        display_name: text(&body["display_name"]),
        epoch: unsigned(&body["epoch"]),
        create_time_ns: signed(&body["create_time_ns"]),
    }
}

pub(crate) fn pose(body: &Value) -> v1::Pose {
    v1::Pose {
        x_m: real(&body["x_m"]),
        y_m: real(&body["y_m"]),
        theta_rad: real(&body["theta_rad"]),
    }
}

/// All but the sensors, which no scenario reads back over REST.
pub(crate) fn session(body: &Value) -> v1::Session {
    let state = match text(&body["state"]).as_str() {
        "OPEN" => v1::SessionState::Open,
        "CLOSED" => v1::SessionState::Closed,
        "FENCED" => v1::SessionState::Fenced,
        other => panic!("`{other}` is no state of a session"),
    };
    let start = present(body, "start").map(|start| match start.get("known") {
        Some(known) => v1::start::Kind::Known(pose(known)),
        None => v1::start::Kind::Unknown(v1::UnknownStart {}),
    });
    let delivery = match text(&body["delivery"]).as_str() {
        "BOUNDED_LAG" => v1::Delivery::BoundedLag,
        _ => v1::Delivery::Complete,
    };
    v1::Session {
        id: text(&body["id"]),
        map: text(&body["map"]),
        robot: text(&body["robot"]),
        epoch: unsigned(&body["epoch"]),
        client_key: text(&body["client_key"]),
        state: state.into(),
        start: start.map(|kind| v1::Start { kind: Some(kind) }),
        map_from_session: present(body, "map_from_session").map(pose),
        sensors: Vec::new(),
        delivery: delivery.into(),
        acked_through: unsigned(&body["acked_through"]),
        mapped_through: unsigned(&body["mapped_through"]),
        scans: unsigned(&body["scans"]),
        rejected: unsigned(&body["rejected"]),
        first_time_ns: present(body, "first_time_ns").map(signed),
        last_time_ns: present(body, "last_time_ns").map(signed),
        create_time_ns: signed(&body["create_time_ns"]),
        warnings: rows(&body["warnings"], text),
        lost: truth(&body["lost"]),
        complete_in_version: unsigned(&body["complete_in_version"]),
        frame_session: present(body, "frame_session").map(text).unwrap_or_default(),
        frame_from_session: Some(pose(&body["frame_from_session"])),
    }
}

pub(crate) fn opened(body: &Value) -> v1::OpenSessionResponse {
    let limits = &body["limits"];
    v1::OpenSessionResponse {
        session: Some(session(&body["session"])),
        resumed: truth(&body["resumed"]),
        limits: Some(v1::IngestLimits {
            n_in_flight_max: small(&limits["n_in_flight_max"]),
            batch_bytes_max: small(&limits["batch_bytes_max"]),
            observations_max: small(&limits["observations_max"]),
        }),
    }
}

pub(crate) fn ack(body: &Value) -> v1::Ack {
    let rejection = |body: &Value| v1::Rejection {
        batch_number: unsigned(&body["batch_number"]),
        index: small(&body["index"]),
        code: text(&body["code"]),
        detail: text(&body["detail"]),
    };
    v1::Ack {
        acked_through: unsigned(&body["acked_through"]),
        rejected: rows(&body["rejected"], rejection),
    }
}

pub(crate) fn trajectory(body: &Value) -> v1::Trajectory {
    let origin = match text(&body["origin"]).as_str() {
        "ODOMETRY" => v1::TrajectoryOrigin::Odometry,
        "TRACKING" => v1::TrajectoryOrigin::Tracking,
        "RELAXATION" => v1::TrajectoryOrigin::Relaxation,
        other => panic!("`{other}` is no origin of a trajectory"),
    };
    let trajectory_pose = |body: &Value| v1::TrajectoryPose {
        stamp_ns: signed(&body["stamp_ns"]),
        sensor_id: text(&body["sensor_id"]),
        pose: present(body, "pose").map(pose),
        lost: truth(&body["lost"]),
    };
    v1::Trajectory {
        session: text(&body["session"]),
        map: text(&body["map"]),
        map_version: unsigned(&body["map_version"]),
        reference_frame: text(&body["reference_frame"]),
        frame: text(&body["frame"]),
        origin: origin.into(),
        poses: rows(&body["poses"], trajectory_pose),
    }
}

pub(crate) fn grid(body: &Value) -> v1::Grid {
    let origin = &body["origin"];
    v1::Grid {
        map: text(&body["map"]),
        map_version: unsigned(&body["map_version"]),
        cost_revision: unsigned(&body["cost_revision"]),
        resolution_m: real(&body["resolution_m"]),
        origin: Some(point(origin)),
        width: small(&body["width"]),
        height: small(&body["height"]),
        cells: rows(&body["cells"], |cell| u8::try_from(small(cell)).expect("a byte")),
        frame_session: present(body, "frame_session").map(text).unwrap_or_default(),
    }
}
