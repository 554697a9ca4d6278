//! Pictures of grids, all in memory: what `map_server` reads and writes, NumPy, a terminal.
//!
//! Images have their top row first, rasters their lowest; the flip happens in [`picture`] and
//! [`map_server`] and nowhere else.

mod imported;
mod map_server;
mod npy;
mod pgm;
mod picture;
mod png;
mod terminal;
mod yaml;

pub use imported::{ImportParams, ImportedMap, InvalidImport, imported};
pub use map_server::{MapServerGrid, cells_from_picture};
pub use npy::npy;
pub use pgm::{pgm, read_pgm};
pub use picture::{InvalidImage, Picture, read_picture};
pub use png::{png, read_png};
pub use terminal::terminal;
pub use yaml::{InvalidYaml, MapMode, MapYaml, read_yaml, yaml};
