//! Environments for NX, each with the graph that it should find, drawn by hand beside it.

use std::f64::consts::FRAC_PI_2;

use meetpoint_geometry::{Point2, Pose};

use crate::building::{Building, InvalidBuilding};

/// An environment, and what is true of it.
#[derive(Clone, Debug)]
pub struct NxWorld {
    /// What it is called.
    pub name: &'static str,
    /// Its walls.
    pub building: Building,
    /// Where NX begins, as a place of the drawing, looking up.
    pub start: Pose,
    /// Where the mark of home is, for robots that are to see it: at a place.
    pub home: Point2<f64>,
    /// The true graph, drawn in the notation of places and ways: letters are places, `-` and `|` ways,
    /// `+` bends. A place is a junction, an end or a corner of corridors, the mouth of a
    /// corridor in a large space, and a corner of one; ways of a place are drawn in the order in
    /// which they stand around it.
    pub graph: &'static str,
}

/// The environments, in the order of their drawings.
///
/// # Panics
/// Never: the drawings are part of the crate and tested.
pub fn nx_worlds() -> Vec<NxWorld> {
    let world = |part| read(part, None).expect("the crate's own drawings are valid");
    parts().map(world).collect()
}

/// The same drawings, all corridors of one width, in metres.
///
/// # Errors
/// [`InvalidBuilding`] if that is no length.
pub fn nx_worlds_of(width_m: f64) -> Result<Vec<NxWorld>, InvalidBuilding> {
    parts().map(|part| read(part, Some(width_m))).collect()
}

fn parts() -> impl Iterator<Item = &'static str> {
    include_str!("../worlds/nx.txt").split("\n== ").skip(1)
}

/// Reads `name character_m`, a drawing, a line of `--`, and a graph.
fn read(part: &'static str, width_m: Option<f64>) -> Result<NxWorld, InvalidBuilding> {
    let (title, rest) = part.split_once('\n').ok_or(InvalidBuilding::Empty)?;
    let (name, character_m) = title.rsplit_once(' ').ok_or(InvalidBuilding::Empty)?;
    let drawn_m = character_m.parse().map_err(|_| InvalidBuilding::CharacterSize(f64::NAN))?;
    let character_m = width_m.unwrap_or(drawn_m);
    let (drawing, graph) = rest.split_once("\n--\n").ok_or(InvalidBuilding::Empty)?;
    let building = Building::from_drawing(drawing, character_m)?;
    let place = |name| building.place(name).ok_or(InvalidBuilding::Empty);
    let (start, home) = (place('S')?, place('H')?);
    let start = Pose::new(start.x, start.y, FRAC_PI_2);
    Ok(NxWorld { name, building, start, home, graph })
}
