//! Pieces of the newcomer that are searched for in the site.

use std::collections::BTreeMap;

use meetpoint_geometry::{Point2, Pose, Vector2};

use crate::alignment_params::AlignmentParams;
use crate::part::Part;
use crate::walls::Wall;

/// A piece of a map: its walls about a middle.
#[derive(Clone, Debug)]
pub(crate) struct Patch {
    /// The middle seen from the map: no turn.
    pub(crate) map_from_patch: Pose,
    /// Walls seen from the middle.
    pub(crate) points: Vec<Point2<f64>>,
    /// How well its walls hold it: of the direction in which they do least, in walls.
    hold: f64,
}

/// The patches of a map, those that are held best first: what stands in a corner is found before what
/// stands in a corridor. One a square of `patch_spacing_m`.
pub(crate) fn patches(part: &Part, params: &AlignmentParams) -> Vec<Patch> {
    let mut squares: BTreeMap<(i32, i32), (Vector2<f64>, f64)> = BTreeMap::new();
    for wall in &part.walls {
        let sum = squares.entry(square(wall.at, params.patch_spacing_m)).or_default();
        sum.0 += wall.at.coords;
        sum.1 += 1.0;
    }
    let middles = squares.values().map(|&(sum, n)| Point2::from(sum / n));
    let mut patches: Vec<Patch> =
        middles.filter_map(|middle| patch(&part.walls, middle, params)).collect();
    patches.sort_by(|a, b| b.hold.total_cmp(&a.hold));
    patches.truncate(params.n_patches_max);
    patches
}

fn patch(walls: &[Wall], middle: Point2<f64>, params: &AlignmentParams) -> Option<Patch> {
    let radius2 = params.patch_radius_m * params.patch_radius_m;
    let near = || walls.iter().filter(|wall| (wall.at - middle).norm_squared() <= radius2);
    let mut places = BTreeMap::new();
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for wall in near() {
        let at = Point2::from(wall.at - middle);
        places.entry(square(at, params.point_edge_m)).or_insert(at);
        if let Some(normal) = wall.normal {
            xx += normal.x * normal.x;
            xy += normal.x * normal.y;
            yy += normal.y * normal.y;
        }
    }
    if places.len() < params.n_points_min {
        return None;
    }
    let hold = 0.5 * (xx + yy) - (0.25 * (xx - yy) * (xx - yy) + xy * xy).sqrt();
    let stride = places.len().div_ceil(params.n_points_max.max(1)).max(1);
    Some(Patch {
        map_from_patch: Pose::new(middle.x, middle.y, 0.0),
        points: places.into_values().step_by(stride).collect(),
        hold,
    })
}

#[expect(clippy::cast_possible_truncation, reason = "saturating; maps end far below")]
fn square(at: Point2<f64>, edge_m: f64) -> (i32, i32) {
    ((at.y / edge_m).floor() as i32, (at.x / edge_m).floor() as i32)
}
