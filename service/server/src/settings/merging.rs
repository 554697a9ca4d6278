//! How sessions of unknown start are put into maps.

use meetpoint_merging::MergeRules;
use serde::Deserialize;

/// When merges are looked at unasked, and what is accepted without a person.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "each field is explained in settings.toml, once")]
#[expect(clippy::struct_excessive_bools, reason = "each is a setting of its own")]
pub struct MergingSettings {
    pub looks_again: bool,
    pub way_first_m: f64,
    pub way_again_m: f64,
    pub again_share: f64,
    pub n_scans_again: u64,
    pub accepts: bool,
    pub founds_map: bool,
    pub relaxes_after: bool,
    pub log_odds_min: f64,
    pub margin_min: f64,
    pub margin_share_min: f64,
    pub named_margin_min: f64,
    pub named_min: usize,
    pub overlap_min_m2: f64,
    pub agreement_min: f64,
    pub contradiction_max: f64,
    pub std_max_m: f64,
    pub landmarks_log_odds_min: f64,
    pub landmarks_contradiction_max: f64,
    pub landmarks_accepts_nameless: bool,
}

impl MergingSettings {
    /// The rules that searches judge by.
    pub(crate) fn rules(&self) -> MergeRules {
        MergeRules {
            log_odds_min: self.log_odds_min,
            margin_min: self.margin_min,
            margin_share_min: self.margin_share_min,
            named_margin_min: self.named_margin_min,
            named_min: self.named_min,
            accepts_nameless: self.landmarks_accepts_nameless,
            overlap_min_m2: self.overlap_min_m2,
            agreement_min: self.agreement_min,
            contradiction_max: self.contradiction_max,
            std_max_m: self.std_max_m,
            ..MergeRules::INDOOR
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::read;
    use super::*;

    #[test]
    fn the_defaults_are_those_that_were_measured() {
        let settings = read(None, std::iter::empty()).expect("compiled in");
        assert_eq!(settings.merging.rules(), MergeRules::INDOOR, "as they are told");
    }
}
