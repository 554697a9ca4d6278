//! MRCLAM folders: robots with odometry as velocities, and a camera that sees landmarks by barcode.
//!
//! A folder holds `RobotN_Odometry.dat` and `RobotN_Measurement.dat` of up to five robots, and
//! `Barcodes.dat`, which says whose the barcodes are: subjects 1 to 5 are the robots themselves, the
//! others landmarks. All are columns of text, `#` for comments, plain or gzipped. Source: K. Y. K.
//! Leung, Y. Halpern, T. D. Barfoot, H. H. T. Liu, "The UTIAS multi-robot cooperative localization
//! and mapping dataset", International Journal of Robotics Research 30 (2011). Ground truth that may
//! lie beside is not read.

mod barcodes;
mod folder;
mod row;
mod run;
mod run_batches;
mod table;

pub(crate) use folder::{Folder, RobotFiles};
pub(crate) use run::Run;
pub(crate) use run_batches::RunBatches;
