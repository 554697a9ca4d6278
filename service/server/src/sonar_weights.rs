//! The weights by which sonars are read: those that are compiled in, or files that `meetpoint train` made.

use std::path::Path;
use std::sync::Arc;

use anyhow::Context;
use meetpoint_occupancy::{Accuracy, Examination, Network};
use serde::{Deserialize, Serialize};

/// What the file is, and its layout.
const FORMAT: &str = "meetpoint sonar weights 1";
/// Bytes of a file, at most: twenty times what `meetpoint train` writes.
const FILE_BYTES_MAX: u64 = 1 << 17;
/// Bytes of the hash that names weights: two of a million differ by chance in all but 10⁻³ of cases.
const N_NAME_BYTES: usize = 6;

/// What weights are good for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Purpose {
    /// To follow robots without a laser: trained on single firings. What files mean that do not say.
    #[default]
    Following,
    /// To draw maps: trained on ways besides.
    Drawing,
}

/// A network, and its name.
#[derive(Clone, Debug)]
pub struct SonarWeights {
    /// The beginning of the hash of the weights, in hexadecimal: other weights, another name.
    pub name: String,
    /// Interprets sonars.
    pub network: Arc<Network>,
}

impl SonarWeights {
    /// Weights by their name.
    pub fn new(network: Network) -> Self {
        let hash = blake3::hash(network.to_text().as_bytes());
        let mut name = hash.to_hex().to_string();
        name.truncate(2 * N_NAME_BYTES);
        Self { name, network: Arc::new(network) }
    }

    /// Those that come with the service.
    pub fn shipped(purpose: Purpose) -> Self {
        Self::new(match purpose {
            Purpose::Following => Network::shipped(),
            Purpose::Drawing => Network::by_ways(),
        })
    }

    /// Those of a file.
    ///
    /// # Errors
    /// If it cannot be read, is none, was changed after it was made, or was made for another purpose.
    pub fn read(path: &Path, purpose: Purpose) -> anyhow::Result<Self> {
        let place = || format!("the sonar weights {}", path.display());
        let n_bytes = std::fs::metadata(path).with_context(place)?.len();
        anyhow::ensure!(
            n_bytes <= FILE_BYTES_MAX,
            "{}: {n_bytes} bytes; at most {FILE_BYTES_MAX} are read",
            place()
        );
        let text = std::fs::read_to_string(path).with_context(place)?;
        SonarWeightsFile::weights(&text, purpose).with_context(place)
    }
}

/// What `meetpoint train` writes.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SonarWeightsFile {
    format: String,
    /// Hash of the weights: see [`SonarWeights::name`].
    name: String,
    /// The version of the program.
    made_by: String,
    #[serde(default)]
    purpose: Purpose,
    trained_on: String,
    n_trained: usize,
    held_out: HeldOutFigures,
    /// As [`Network::to_text`] writes them.
    weights: String,
}

/// How good weights are on places that they were not trained on.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct HeldOutFigures {
    n_places: usize,
    occupied_share: f64,
    calibration_error: f64,
    constant: AccuracyFigures,
    inverse_cone: AccuracyFigures,
    network: AccuracyFigures,
    calibration: Vec<TenthFigures>,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct AccuracyFigures {
    cross_entropy_nats: f64,
    wrong_share: f64,
}

/// Places that the network says are occupied with a probability from `from` on, up to a tenth more.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct TenthFigures {
    from: f64,
    said_mean: f64,
    n_places: usize,
    n_occupied: usize,
}

impl SonarWeightsFile {
    pub(crate) fn new(
        (weights, purpose): (&SonarWeights, Purpose),
        trained_on: String,
        n_trained: usize,
        examination: &Examination,
    ) -> Self {
        Self {
            format: FORMAT.to_owned(),
            name: weights.name.clone(),
            made_by: concat!("meetpoint ", env!("CARGO_PKG_VERSION")).to_owned(),
            purpose,
            trained_on,
            n_trained,
            held_out: figures(examination),
            weights: weights.network.to_text(),
        }
    }

    fn weights(text: &str, purpose: Purpose) -> anyhow::Result<SonarWeights> {
        let file: Self =
            serde_json::from_str(text).context("this is not what `meetpoint train` writes")?;
        anyhow::ensure!(
            file.format == FORMAT,
            "its format is `{}`; this service reads `{FORMAT}`",
            file.format
        );
        match (file.purpose, purpose) {
            (Purpose::Following, Purpose::Drawing) => anyhow::bail!(
                "its weights are for following robots (mapping.sonar_following_weights); \
                 `meetpoint train --way-places 80000` makes weights that draw"
            ),
            (Purpose::Drawing, Purpose::Following) => anyhow::bail!(
                "its weights are for drawing maps (mapping.sonar_weights); `meetpoint train` without \
                 `--way-places` makes weights that robots are followed by"
            ),
            _ => {}
        }
        let weights = SonarWeights::new(Network::from_text(&file.weights)?);
        anyhow::ensure!(
            weights.name == file.name,
            "its name is {}, but its weights are those of {}: it was changed after it was made",
            file.name,
            weights.name
        );
        Ok(weights)
    }
}

fn figures(examination: &Examination) -> HeldOutFigures {
    let accuracy = |accuracy: &Accuracy| AccuracyFigures {
        cross_entropy_nats: accuracy.cross_entropy_nats,
        wrong_share: accuracy.wrong_share,
    };
    let tenths = (0_u8..).zip(&examination.calibration).map(|(index, tenth)| TenthFigures {
        from: f64::from(index) / 10.0,
        said_mean: tenth.said_mean,
        n_places: tenth.n_places,
        n_occupied: tenth.n_occupied,
    });
    HeldOutFigures {
        n_places: examination.n_places,
        occupied_share: examination.occupied_share,
        calibration_error: examination.calibration_error(),
        constant: accuracy(&examination.constant),
        inverse_cone: accuracy(&examination.inverse_cone),
        network: accuracy(&examination.network),
        calibration: tenths.collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PURPOSE: Purpose = Purpose::Following;

    fn text(network: Network, purpose: Purpose) -> String {
        let examination = Examination::new(&network, &[]);
        let weights = SonarWeights::new(network);
        let file =
            SonarWeightsFile::new((&weights, purpose), "nothing".to_owned(), 0, &examination);
        serde_json::to_string_pretty(&file).expect("JSON")
    }

    #[test]
    fn what_is_written_is_read() {
        let text = text(Network::shipped(), PURPOSE);
        let read = SonarWeightsFile::weights(&text, PURPOSE).expect("it was written so");
        assert_eq!(*read.network, Network::shipped(), "bit for bit");
        assert_eq!(read.name, SonarWeights::shipped(PURPOSE).name, "by the weights alone");
        assert_ne!(read.name, SonarWeights::new(Network::BLANK).name, "other weights");
    }

    #[test]
    fn says_what_is_wrong() {
        let error = |text: &str| {
            let error = SonarWeightsFile::weights(text, PURPOSE).expect_err("not weights");
            format!("{error:#}")
        };
        assert!(
            error("{}").starts_with("this is not what `meetpoint train` writes: missing field"),
            "{}",
            error("{}")
        );
        let good = text(Network::shipped(), PURPOSE);
        let other = error(&text(Network::by_ways(), Purpose::Drawing));
        assert!(other.starts_with("its weights are for drawing maps"), "{other}");
        let unsaid = good.replace("  \"purpose\": \"following\",\n", "");
        assert_ne!(unsaid, good, "it is said");
        SonarWeightsFile::weights(&unsaid, PURPOSE).expect("as files were written before");
        let newer = error(&good.replace(FORMAT, "meetpoint sonar weights 9"));
        assert!(newer.starts_with("its format is `meetpoint sonar weights 9`"), "{newer}");
        let shipped = SonarWeights::shipped(PURPOSE).name;
        let renamed = error(&good.replace(&shipped, "000000000000"));
        assert!(renamed.ends_with("it was changed after it was made"), "{renamed}");
        let missing = SonarWeights::read(Path::new("no/such/file"), PURPOSE).expect_err("no file");
        assert!(
            format!("{missing:#}").starts_with("the sonar weights no/such/file"),
            "{missing:#}"
        );
    }
}
