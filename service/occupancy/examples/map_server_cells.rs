//! Reads a map as nav2's `map_server` does and says what is in it.
//!
//! ```text
//! cargo run -p meetpoint-occupancy --example map_server_cells -- map.yaml [cells]
//! ```
//!
//! Prints sizes, counts and warnings; the cells (int8, lowest row first, as in
//! `nav_msgs/OccupancyGrid`) go into the second file, to be compared byte by byte with others.

use std::{env, error::Error, fs, path::Path};

use meetpoint_occupancy::{cells_from_picture, read_pgm, read_png, read_yaml};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let yaml_path = Path::new(arguments.first().ok_or("which map? give the path of its YAML")?);
    let yaml = read_yaml(&fs::read_to_string(yaml_path)?)?;
    let image_path = yaml_path.with_file_name(&yaml.image);
    let bytes = fs::read(&image_path)?;
    let is_png = image_path.extension().is_some_and(|extension| extension == "png");
    let picture = if is_png { read_png(&bytes) } else { read_pgm(&bytes) }?;
    let grid = cells_from_picture(&picture, &yaml);

    let count = |cell: i8| grid.cells.iter().filter(|&&other| other == cell).count();
    let (unknown, free, occupied) = (count(-1), count(0), count(100));
    println!("{} x {} cells of {} m", grid.width, grid.height, yaml.resolution_m);
    println!("unknown {unknown}, free {free}, occupied {occupied}");
    for warning in &grid.warnings {
        println!("warning: {warning}");
    }
    if let Some(path) = arguments.get(1) {
        fs::write(path, grid.cells.iter().map(|&cell| cell.cast_unsigned()).collect::<Vec<u8>>())?;
    }
    Ok(())
}
