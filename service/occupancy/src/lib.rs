//! Occupancy of space in log-odds: the laser's beam model, the grid, its tiles, decay, what changes, and images.

mod beam;
mod changes;
mod doors;
mod following;
mod grid;
mod history;
mod image;
mod invalid_tile;
mod map_tile;
mod raster;
mod ray;
mod scan_marks;
mod sonar;
mod tile;

pub use beam::{BeamModel, LaserGeometry, Reading};
pub use changes::{Change, ChangeKind, changes, n_moved};
pub use doors::{Door, DoorParams, doors};
pub use grid::{GRID_REACH_CELLS, Grid};
pub use history::{History, LOOK_NS, PAIR_NS};
pub use image::{
    ImportParams, ImportedMap, InvalidImage, InvalidImport, InvalidYaml, MapMode, MapServerGrid,
    MapYaml, Picture, cells_from_picture, imported, npy, pgm, png, read_pgm, read_picture,
    read_png, read_yaml, terminal, yaml,
};
pub use invalid_tile::InvalidTile;
pub use map_tile::{MAP_TILE_LEVEL_MAX, MAP_TILE_PIXELS, map_tile};
pub use raster::Raster;
pub use scan_marks::ScanMarks;
pub use sonar::{
    Accuracy, Examination, Example, HeardPlace, HeardView, HeldOut, Interpretation, InvalidNetwork,
    InverseCone, Network, SonarModel, SonarRing, SonarScan, SonarView, Tenth, TrainingParams,
    WayExamination, WayTrainingParams, cross_entropy, trained, trained_on_ways,
};
pub use tile::{HitMean, TILE_CELLS, Tile, TileIndex};
