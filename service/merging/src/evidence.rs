//! What the walls of one map say of its lying on another.
//!
//! Each wall that lies where the other map has seen is a witness:
//!
//! ```text
//! l = weight * (AGREES v - DIFFERS (1 - v))   a wall of the other map is near: v by distance and direction
//! l = -weight * CONTRADICTS                   the other map is clearly free there
//! ```
//!
//! logarithms of the odds between "the same place" and "two places that have nothing to do with one
//! another, but for walls that run alike". Neighbouring pieces of a wall say the same: a metre of them is
//! one witness. The log odds of a place are the mean of what both maps' walls say.

use meetpoint_geometry::{Point2, Pose, Vector2};

use crate::ground::Known;
use crate::named_landmarks::NamedTestimony;
use crate::nameless_landmarks::NamelessTestimony;
use crate::part::Part;
use crate::walls::Wall;

/// A wall that agrees.
const AGREES: f64 = 1.0;
/// A wall near one of the other map, but not at it.
const DIFFERS: f64 = 1.2;
/// A wall in free space.
const CONTRADICTS: f64 = 3.0;
/// Standard deviation of a wall's place in the other map, in metres: both maps bend by some of it.
const WALL_STD_M: f64 = 0.12;
/// A wall within this distance of one of the other map does not contradict it, in metres.
const NEAR_M: f64 = 0.35;
/// Metres of wall that are one witness.
const WITNESS_M: f64 = 1.0;
/// Share of a witness's agreement that walls across one another have.
const COSINE_MIN: f64 = 0.6;

/// What one map's walls say, in their order, thinned.
#[derive(Clone, Debug)]
pub(crate) struct Testimony {
    /// Of each wall that was asked; NaN where the other map has not seen.
    pub(crate) log_odds: Vec<f32>,
    /// Walls that lie where the other map has seen.
    pub(crate) n_known: usize,
    /// Sum of how well these agree.
    pub(crate) agreeing: f64,
    pub(crate) n_contradicting: usize,
}

/// What both maps' walls, and the names that they have in common, say of a place.
#[derive(Clone, Debug)]
pub(crate) struct Evidence {
    /// Of the newcomer's walls.
    pub(crate) newcomer: Testimony,
    /// Of the site's.
    pub(crate) site: Testimony,
    /// Of the landmarks with names.
    pub(crate) named: NamedTestimony,
    /// Of those without.
    pub(crate) nameless: NamelessTestimony,
}

/// What landmarks without names take from the log odds of a place, at most: a detector that misses what
/// another one sees is no proof against what walls say.
const NAMELESS_AGAINST_MAX: f64 = 20.0;

impl Evidence {
    /// Of a place of the newcomer, by `n_max` walls of each map at most.
    pub(crate) fn new(
        (site, newcomer): (&Part, &Part),
        site_from_newcomer: Pose,
        n_max: usize,
    ) -> Self {
        Self {
            newcomer: Testimony::new(newcomer, site, site_from_newcomer, n_max),
            site: Testimony::new(site, newcomer, site_from_newcomer.inverse(), n_max),
            named: NamedTestimony::new((site, newcomer), site_from_newcomer),
            nameless: NamelessTestimony::new((site, newcomer), site_from_newcomer),
        }
    }

    /// Logarithm of the odds against no overlap. Landmarks without names only speak against: those that lie
    /// together repeat what an architect repeats, doors above all, as walls do.
    pub(crate) fn log_odds(&self) -> f64 {
        let nameless = self.nameless.log_odds.clamp(-NAMELESS_AGAINST_MAX, 0.0);
        0.5 * (self.newcomer.sum() + self.site.sum()) + self.named.log_odds + nameless
    }

    /// Share of the walls that agree, by the map of which fewer do.
    pub(crate) fn agreement(&self) -> f64 {
        self.newcomer.agreement().min(self.site.agreement())
    }

    /// Share of the walls that lie in free space, by the map of which more do.
    pub(crate) fn contradiction(&self) -> f64 {
        self.newcomer.contradiction().max(self.site.contradiction())
    }
}

impl Testimony {
    /// What walls say of `other_from_own`, `n_max` of them at most.
    pub(crate) fn new(own: &Part, other: &Part, other_from_own: Pose, n_max: usize) -> Self {
        let stride = own.walls.len().div_ceil(n_max.max(1)).max(1);
        let weight = stride as f64 * own.ground.edge_m() / WITNESS_M;
        let mut testimony =
            Self { log_odds: Vec::new(), n_known: 0, agreeing: 0.0, n_contradicting: 0 };
        let (sin, cos) = other_from_own.theta_rad.sin_cos();
        let turned = |v: Vector2<f64>| Vector2::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y);
        for wall in own.walls.iter().step_by(stride) {
            let at = other_from_own.position() + turned(wall.at.coords);
            let placed = Wall { at, normal: wall.normal.map(turned), ..*wall };
            let said = match agreement(&placed, other) {
                Some(Said::Agrees(v)) => {
                    testimony.agreeing += v;
                    AGREES * v - DIFFERS * (1.0 - v)
                }
                Some(Said::Contradicts) => {
                    testimony.n_contradicting += 1;
                    -CONTRADICTS
                }
                None => f64::NAN,
            };
            testimony.n_known += usize::from(!said.is_nan());
            #[expect(clippy::cast_possible_truncation, reason = "one witness of thousands")]
            testimony.log_odds.push((weight * said) as f32);
        }
        testimony
    }

    /// Sum of all that is said.
    pub(crate) fn sum(&self) -> f64 {
        self.log_odds.iter().filter(|said| !said.is_nan()).map(|&said| f64::from(said)).sum()
    }

    fn agreement(&self) -> f64 {
        self.agreeing / self.n_known.max(1) as f64
    }

    fn contradiction(&self) -> f64 {
        self.n_contradicting as f64 / self.n_known.max(1) as f64
    }
}

enum Said {
    Agrees(f64),
    Contradicts,
}

/// What a wall says, placed in the other map; `None` if that has not seen there.
fn agreement(wall: &Wall, other: &Part) -> Option<Said> {
    let known = other.ground.at(wall.at);
    let near = other.nearest.near(&other.ground, &other.walls, wall.at);
    let near = near.map(|near| (near, (near.at - wall.at).norm()));
    match near.filter(|(_, distance_m)| *distance_m <= NEAR_M) {
        Some((near, _)) => {
            let v = likeness(wall, near);
            // Beside the wall where it ends nothing was seen: that it goes on is no evidence.
            (known != Known::Unknown || 0.5 < v).then_some(Said::Agrees(v))
        }
        None => (known == Known::Free).then_some(Said::Contradicts),
    }
}

/// How much two walls are one, in 0..=1: by the distance across and the direction.
fn likeness(wall: &Wall, near: &Wall) -> f64 {
    let away = near.at - wall.at;
    let (across_m, cosine) = match (wall.normal, near.normal) {
        (Some(a), Some(b)) => {
            let cosine = a.dot(&b);
            let is_behind = wall.is_one_sided && near.is_one_sided && cosine < 0.0;
            (b.dot(&away).abs(), if is_behind { 0.0 } else { cosine.abs() })
        }
        (None, Some(normal)) => (normal.dot(&away).abs(), 1.0),
        _ => (away.norm(), 1.0),
    };
    let by_direction = ((cosine - COSINE_MIN) / (1.0 - COSINE_MIN)).clamp(0.0, 1.0).sqrt();
    (-0.5 * (across_m / WALL_STD_M).powi(2)).exp() * by_direction
}

/// The middle of the newcomer's walls that say something, in the newcomer's frame.
pub(crate) fn middle(newcomer: &Part, testimony: &Testimony) -> Point2<f64> {
    let stride = newcomer.walls.len().div_ceil(testimony.log_odds.len().max(1)).max(1);
    let said = newcomer.walls.iter().step_by(stride).zip(&testimony.log_odds);
    let known = said.filter(|(_, said)| !said.is_nan()).map(|(wall, _)| wall.at.coords);
    let (sum, n) = known.fold((Vector2::zeros(), 0.0), |(sum, n), at| (sum + at, n + 1.0));
    Point2::from(sum / f64::max(n, 1.0))
}
