//! What readings of a map's sensors are taken to mean, on the wire and in the journal.

use std::ops::RangeInclusive;

use meetpoint_occupancy::{BeamModel, SonarModel};
use meetpoint_proto::v1;
use meetpoint_tracking::MappingParams;
use prost::Message;

use crate::error::Error;

/// Probabilities that say something, and not everything.
const PROBABILITY_RANGE: RangeInclusive<f64> = 0.01..=0.99;
/// What no cell's probability leaves: from what readings say to a million to one.
const BOUND_RANGE: RangeInclusive<f64> = 0.7..=0.999_999;
/// Distances that lasers see, in metres.
const DISTANCE_RANGE_M: RangeInclusive<f64> = 0.1..=200.0;
/// How strong sonar's evidence is, in log-odds.
const EVIDENCE_RANGE: RangeInclusive<f64> = 0.0..=10.0;

/// As bytes, for the journal.
pub(crate) fn to_bytes(wire: &v1::MappingParameters) -> Vec<u8> {
    wire.encode_to_vec()
}

/// What the journal holds.
///
/// # Errors
/// [`Error::Internal`] if it cannot be read.
pub(crate) fn from_bytes(bytes: &[u8]) -> Result<v1::MappingParameters, Error> {
    v1::MappingParameters::decode(bytes).map_err(Error::internal)
}

/// The parameters of a map that departs from `base` in this.
///
/// # Errors
/// [`Error::InvalidField`] for what makes no sense.
pub(crate) fn applied(
    base: &MappingParams,
    wire: &v1::MappingParameters,
) -> Result<MappingParams, Error> {
    let v1::MappingParameters {
        prior,
        decay,
        probability_max,
        laser_hit,
        laser_miss,
        laser_hit_range_max_m,
        laser_clear_range_max_m,
        sonar_distance_max_m,
        sonar_evidence_min,
        sonar_evidence_max,
    } = *wire;
    let BeamModel { log_odds_prior, log_odds_hit, log_odds_miss, log_odds_bound, .. } =
        base.beam_model;
    let log_odds = |field, asked: Option<f64>, range, before| {
        let log_odds = |asked| Ok(log_odds_of(within(field, asked, range)?));
        asked.map_or(Ok::<f32, Error>(before), log_odds)
    };
    let number = |field, asked: Option<f64>, range, before: f64| {
        asked.map_or(Ok(before), |number| within(field, number, range))
    };
    #[expect(clippy::cast_possible_truncation, reason = "a handful of digits count")]
    let beam_model = BeamModel {
        log_odds_prior: log_odds("prior", prior, PROBABILITY_RANGE, log_odds_prior)?,
        decay: number("decay", decay, 0.0..=1.0, f64::from(base.beam_model.decay))? as f32,
        log_odds_bound: log_odds("probability_max", probability_max, BOUND_RANGE, log_odds_bound)?,
        log_odds_hit: log_odds("laser_hit", laser_hit, 0.51..=0.99, log_odds_hit)?,
        log_odds_miss: log_odds("laser_miss", laser_miss, 0.01..=0.49, log_odds_miss)?,
        hit_range_max_m: number(
            "laser_hit_range_max_m",
            laser_hit_range_max_m,
            DISTANCE_RANGE_M,
            base.beam_model.hit_range_max_m,
        )?,
        clear_range_max_m: number(
            "laser_clear_range_max_m",
            laser_clear_range_max_m,
            DISTANCE_RANGE_M,
            base.beam_model.clear_range_max_m,
        )?,
        ..base.beam_model
    };
    let before = base.sonar.model;
    let evidence =
        |field, asked, before: f32| number(field, asked, EVIDENCE_RANGE, f64::from(before));
    #[expect(clippy::cast_possible_truncation, reason = "a handful of digits count")]
    let model = SonarModel {
        distance_max_m: number(
            "sonar_distance_max_m",
            sonar_distance_max_m,
            0.5..=10.0,
            before.distance_max_m,
        )?,
        evidence_min: evidence("sonar_evidence_min", sonar_evidence_min, before.evidence_min)?
            as f32,
        evidence_max: evidence("sonar_evidence_max", sonar_evidence_max, before.evidence_max)?
            as f32,
        ..before
    };
    if beam_model.log_odds_bound <= beam_model.log_odds_prior.abs() {
        return Err(Error::field("parameters.prior", "beyond probability_max"));
    }
    if model.evidence_max < model.evidence_min {
        return Err(Error::field("parameters.sonar_evidence_max", "below sonar_evidence_min"));
    }
    let mut params = MappingParams { beam_model, ..*base };
    params.sonar.model = model;
    params.sonar.following.distance_max_m = model.distance_max_m;
    Ok(params)
}

/// All of them, for the wire.
pub(crate) fn to_wire(params: &MappingParams) -> v1::MappingParameters {
    let (beam, sonar) = (&params.beam_model, &params.sonar.model);
    v1::MappingParameters {
        prior: Some(probability_of(beam.log_odds_prior)),
        decay: Some(rounded(beam.decay)),
        probability_max: Some(probability_of(beam.log_odds_bound)),
        laser_hit: Some(probability_of(beam.log_odds_hit)),
        laser_miss: Some(probability_of(beam.log_odds_miss)),
        laser_hit_range_max_m: Some(beam.hit_range_max_m),
        laser_clear_range_max_m: Some(beam.clear_range_max_m),
        sonar_distance_max_m: Some(sonar.distance_max_m),
        sonar_evidence_min: Some(rounded(sonar.evidence_min)),
        sonar_evidence_max: Some(rounded(sonar.evidence_max)),
    }
}

/// False also for NaN.
fn within(field: &str, number: f64, range: RangeInclusive<f64>) -> Result<f64, Error> {
    if range.contains(&number) {
        return Ok(number);
    }
    let (least, most) = (range.start(), range.end());
    Err(Error::field(format!("parameters.{field}"), format!("{number}, must be {least} to {most}")))
}

#[expect(clippy::cast_possible_truncation, reason = "a handful of digits count")]
fn log_odds_of(probability: f64) -> f32 {
    (probability / (1.0 - probability)).ln() as f32
}

fn probability_of(log_odds: f32) -> f64 {
    rounded(1.0 / (1.0 + (-log_odds).exp()))
}

/// To a millionth: more digits are those of 32-bit floats.
fn rounded(number: f32) -> f64 {
    (f64::from(number) * 1e6).round() / 1e6
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_said_stays_as_it_is() {
        let nothing = v1::MappingParameters::default();
        let same =
            applied(&MappingParams::INDOOR, &nothing).expect("nothing is wrong with nothing");
        assert_eq!(same.beam_model, BeamModel::INDOOR, "to the bit");
        assert_eq!(same.sonar.model, SonarModel::BY_WAYS, "to the bit");
    }

    #[test]
    fn what_is_said_comes_back() {
        let said = v1::MappingParameters {
            prior: Some(0.4),
            decay: Some(0.99),
            laser_hit: Some(0.8),
            ..to_wire(&MappingParams::INDOOR)
        };
        let params = applied(&MappingParams::INDOOR, &said).expect("good parameters");
        assert_eq!(to_wire(&params), said, "all of it");
    }

    #[test]
    fn nonsense_is_refused() {
        let nothing = v1::MappingParameters::default();
        let refused = [
            v1::MappingParameters { prior: Some(0.0), ..nothing },
            v1::MappingParameters { decay: Some(1.1), ..nothing },
            v1::MappingParameters { decay: Some(f64::NAN), ..nothing },
            v1::MappingParameters { laser_hit: Some(0.4), ..nothing },
            v1::MappingParameters { laser_miss: Some(0.6), ..nothing },
            v1::MappingParameters { prior: Some(0.9), probability_max: Some(0.8), ..nothing },
            v1::MappingParameters { sonar_evidence_min: Some(5.0), ..nothing },
        ];
        for wire in refused {
            assert!(applied(&MappingParams::INDOOR, &wire).is_err(), "{wire:?}");
        }
    }
}
