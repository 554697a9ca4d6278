//! Expectation maximisation over a robot's poses and the landmarks that it saw, whether these can
//! be told apart or not, and whatever its odometry does.
//!
//! S. Thrun, W. Burgard and D. Fox, "A probabilistic approach to concurrent mapping and
//! localization for mobile robots", Machine Learning 31 (1998).

mod arrow;
mod calibration;
mod chain;
mod error_model;
mod hypotheses;
mod least_squares;
mod missed;
mod motion;
mod travel;

pub use calibration::Calibration;
pub use error_model::ErrorModel;
pub use hypotheses::{Hypothesis, SearchParams, hypotheses};
pub use motion::Motion;
pub use travel::{Detector, Sighting, Step, Travel};
