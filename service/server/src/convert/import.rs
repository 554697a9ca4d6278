//! Imported maps: files as they are sent and kept, and where their cells come to lie.

use meetpoint_occupancy::{
    ImportParams, ImportedMap, InvalidImage, InvalidImport, MapYaml, imported, read_picture,
    read_yaml,
};
use meetpoint_proto::v1;
use prost::Message;

use super::map;
use crate::error::Error;

/// What is taken from the door: the YAML is right, its image has at most `n_cells_max` pixels, and
/// both together make a map.
pub(crate) fn received(
    files: &v1::MapServerFiles,
    n_cells_max: u64,
) -> Result<(MapYaml, ImportedMap), Error> {
    let v1::MapServerFiles { yaml, image } = files;
    let yaml = read_yaml(yaml).map_err(|error| Error::field("yaml", error.to_string()))?;
    map::resolution_m("yaml.resolution", yaml.resolution_m)?;
    let picture = read_picture(image, n_cells_max).map_err(|error| match error {
        InvalidImage::TooLarge { width, height, n_pixels_max } => {
            Error::MapTooLarge { n_cells: width.saturating_mul(height), limit_cells: n_pixels_max }
        }
        other => Error::field("image", other.to_string()),
    })?;
    let map = imported(&picture, &yaml, &ImportParams::MAP_SERVER).map_err(|error| {
        let field = match error {
            InvalidImport::Resolution(_) => "yaml.resolution",
            InvalidImport::Reach { .. } => "yaml.origin",
            InvalidImport::NothingKnown => "image",
        };
        Error::field(field, error.to_string())
    })?;
    Ok((yaml, map))
}

/// What the journal holds, as a map.
///
/// # Errors
/// [`Error::Internal`] if it holds what the door never lets through.
pub(crate) fn recorded(payload: &[u8]) -> Result<ImportedMap, Error> {
    let files = v1::MapServerFiles::decode(payload).map_err(Error::internal)?;
    match received(&files, u64::MAX) {
        Ok((_, map)) => Ok(map),
        Err(error) => Err(Error::internal(format!("a recorded import: {error}"))),
    }
}

/// Where a map came to lie, for the wire.
pub(crate) fn cells_to_wire(map: &ImportedMap) -> v1::ImportedCells {
    let ImportedMap { raster, shift_m: [shift_x_m, shift_y_m], turn_rad, warnings: _ } = map;
    let count = |is_counted: fn(&f32) -> bool| {
        raster.log_odds.iter().filter(|log_odds| is_counted(log_odds)).count() as u64
    };
    let (free, unknown) = (count(|odds| *odds < 0.0), count(|odds| odds.is_nan()));
    let origin = raster.info.origin();
    v1::ImportedCells {
        origin: Some(v1::Point { x_m: origin.x, y_m: origin.y }),
        width: raster.info.width,
        height: raster.info.height,
        free,
        occupied: raster.log_odds.len() as u64 - free - unknown,
        unknown,
        shift_x_m: *shift_x_m,
        shift_y_m: *shift_y_m,
        turn_rad: *turn_rad,
    }
}
