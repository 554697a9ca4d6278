//! REST's parameters of maps as messages, and back.

use meetpoint_client::v1;
use serde_json::{Map, Value, json};

use crate::from_json::{present, real, text, truth, unsigned};

pub(crate) fn state(body: &Value) -> v1::MappingParametersState {
    let number = |name: &str| present(&body["parameters"], name).map(real);
    v1::MappingParametersState {
        parameters: Some(v1::MappingParameters {
            prior: number("prior"),
            decay: number("decay"),
            probability_max: number("probability_max"),
            laser_hit: number("laser_hit"),
            laser_miss: number("laser_miss"),
            laser_hit_range_max_m: number("laser_hit_range_max_m"),
            laser_clear_range_max_m: number("laser_clear_range_max_m"),
            sonar_distance_max_m: number("sonar_distance_max_m"),
            sonar_evidence_min: number("sonar_evidence_min"),
            sonar_evidence_max: number("sonar_evidence_max"),
        }),
        name: text(&body["name"]),
        map_version: unsigned(&body["map_version"]),
        drawn: truth(&body["drawn"]),
    }
}

/// Only what is said.
pub(crate) fn body(parameters: &v1::MappingParameters) -> Value {
    let all = [
        ("prior", parameters.prior),
        ("decay", parameters.decay),
        ("probability_max", parameters.probability_max),
        ("laser_hit", parameters.laser_hit),
        ("laser_miss", parameters.laser_miss),
        ("laser_hit_range_max_m", parameters.laser_hit_range_max_m),
        ("laser_clear_range_max_m", parameters.laser_clear_range_max_m),
        ("sonar_distance_max_m", parameters.sonar_distance_max_m),
        ("sonar_evidence_min", parameters.sonar_evidence_min),
        ("sonar_evidence_max", parameters.sonar_evidence_max),
    ];
    let said = all.into_iter().filter_map(|(name, number)| Some((name.to_owned(), json!(number?))));
    Value::Object(said.collect::<Map<_, _>>())
}
