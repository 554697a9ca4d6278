//! Plans of buildings as files.

use std::error::Error;
use std::path::Path;

use meetpoint_occupancy::{ImportParams, imported, read_pgm, read_png, read_yaml};
use meetpoint_topology::FreeSpace;

/// The free cells of a map: of the YAML of a `map_server` map, or of an image alone, which is then
/// taken to have cells of 0.05 m that are free where it is nearly white.
pub(crate) fn free_space(path: &Path) -> Result<FreeSpace, Box<dyn Error>> {
    let has = |path: &Path, extension: &str| path.extension().is_some_and(|e| e == extension);
    let text = if has(path, "yaml") {
        std::fs::read_to_string(path)?
    } else {
        let name = path.file_name().and_then(|name| name.to_str()).ok_or("no such image")?;
        format!(
            "image: {name}\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\n\
             occupied_thresh: 0.65\nfree_thresh: 0.04\n"
        )
    };
    let yaml = read_yaml(&text)?;
    let image_path = path.with_file_name(&yaml.image);
    let bytes =
        std::fs::read(&image_path).map_err(|error| format!("{}: {error}", image_path.display()))?;
    let picture = if has(&image_path, "png") { read_png(&bytes)? } else { read_pgm(&bytes)? };
    let map = imported(&picture, &yaml, &ImportParams::MAP_SERVER)?;
    for warning in &map.warnings {
        println!("{}: {warning}", path.display());
    }
    Ok(FreeSpace::from_raster(&map.raster, FreeSpace::PROBABILITY_MAX))
}
