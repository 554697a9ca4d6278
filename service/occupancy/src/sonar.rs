//! Sonar: what a ring of transducers says of the cells around it, by a network that reads neighbouring
//! transducers together, and by the classic model that reads them one by one.

mod drawing;
mod examination;
mod interpretation;
mod inverse_cone;
mod network;
mod ring;
mod training;
mod way_examination;
mod way_training;

pub use examination::{Accuracy, Examination, HeldOut, Tenth};
pub use interpretation::{Interpretation, SonarModel};
pub use inverse_cone::InverseCone;
pub use network::{InvalidNetwork, Network};
pub use ring::{SonarRing, SonarScan, SonarView};
pub use training::{Example, TrainingParams, cross_entropy, trained};
pub use way_examination::WayExamination;
pub use way_training::{HeardPlace, HeardView, WayTrainingParams, trained_on_ways};
