//! A map that was made by itself, made ready for being laid on another.

use meetpoint_geometry::GridFrame;
use meetpoint_occupancy::{BeamModel, Grid, ScanMarks};
use meetpoint_tracking::LaserTravel;

use crate::alignment_params::AlignmentParams;
use crate::ground::Ground;
use crate::looked::{Look, Looked};
use crate::named_landmarks::NamedLandmark;
use crate::nameless_landmarks::NamelessLandmark;
use crate::nearest_walls::NearestWalls;
use crate::search_field::{SearchField, known_m2};
use crate::walls::{Wall, main_direction, walls};

/// A map made ready, as the site or as the newcomer: walls, free space, and what searching needs.
///
/// Making one takes some 10 to 100 milliseconds for a floor of an office building; it is made once a
/// version of the map and shared (`Arc`) by all searches.
#[derive(Clone, Debug)]
pub struct Part {
    pub(crate) ground: Ground,
    pub(crate) walls: Vec<Wall>,
    pub(crate) nearest: NearestWalls,
    pub(crate) search: SearchField,
    /// Of most walls modulo a quarter turn, in radians, and how many say so, in 0..=1.
    pub(crate) direction: (f64, f64),
    known_m2: f64,
    /// Landmarks with names, in its frame.
    pub(crate) landmarks: Vec<NamedLandmark>,
    /// Landmarks without names...
    pub(crate) nameless: Vec<NamelessLandmark>,
    /// ...and where they were looked for.
    pub(crate) looked: Looked,
}

impl Part {
    /// Of a grid of any resolution: drawn live, relaxed, or imported.
    pub fn of_grid(grid: &Grid, params: &AlignmentParams) -> Self {
        let (ground, points) = Ground::of_grid(grid);
        let walls = walls(&ground, &points);
        Self {
            nearest: NearestWalls::new(&ground, &walls),
            search: SearchField::new(&ground, &walls, params.patch_radius_m, &params.field),
            direction: main_direction(&walls),
            known_m2: known_m2(&ground),
            ground,
            walls,
            landmarks: Vec::new(),
            nameless: Vec::new(),
            looked: Looked::default(),
        }
    }

    /// The same with landmarks that have names, in its frame.
    #[must_use]
    pub fn with_landmarks(self, landmarks: Vec<NamedLandmark>) -> Self {
        Self { landmarks, ..self }
    }

    /// The same with landmarks that have none, in its frame, and the moments at which its robots looked for
    /// them.
    #[must_use]
    pub fn with_nameless(self, nameless: Vec<NamelessLandmark>, looks: &[Look]) -> Self {
        let looked = Looked::new(&self.ground, looks);
        Self { nameless, looked, ..self }
    }

    /// Of the scans of some sessions in one frame, drawn at their poses; scans that live mapping did not
    /// trust are left out.
    pub fn of_travels(
        travels: &[LaserTravel],
        frame: GridFrame,
        model: &BeamModel,
        params: &AlignmentParams,
    ) -> Self {
        let (mut grid, mut marks) = (Grid::new(frame), ScanMarks::new());
        for travel in travels {
            for scan in travel.scans.iter().filter(|scan| !scan.is_lost) {
                let Some(laser) = travel.lasers.get(scan.laser) else { continue };
                let pose = scan.map_from_robot * laser.robot_from_sensor;
                grid.insert_scan(pose, &laser.geometry, &scan.ranges_m, model, &mut marks);
            }
        }
        Self::of_grid(&grid, params)
    }

    /// Length of the walls that it shows, in metres, about.
    pub fn walls_m(&self) -> f64 {
        self.walls.len() as f64 * self.ground.edge_m()
    }

    /// Area that it has seen, in square metres.
    pub fn known_m2(&self) -> f64 {
        self.known_m2
    }
}
