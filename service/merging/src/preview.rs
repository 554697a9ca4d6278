//! One map drawn over the other.

use meetpoint_geometry::{Point2, Pose, Vector2};
use meetpoint_occupancy::{Grid, Raster};

/// Red, green and blue.
type Color = [u8; 3];

/// Where neither map has seen.
const UNKNOWN: Color = [214, 214, 214];
/// Free by the site, by the newcomer, by both.
const FREE: [Color; 3] = [[228, 238, 250], [252, 236, 218], [255, 255, 255]];
/// Walls of the site: blue.
const SITE_WALL: Color = [20, 80, 190];
/// Walls of the newcomer: orange.
const NEWCOMER_WALL: Color = [230, 100, 0];
/// Walls of both.
const COMMON_WALL: Color = [30, 30, 30];
/// Pixels on a side, at most, whatever is asked for.
const N_PIXELS_SIDE_MAX: u32 = 4096;

/// The newcomer laid over the site, as an RGB PNG in the site's frame, top row first: walls of the site
/// blue, of the newcomer orange, of both black; free space tinted alike and white where both are free.
/// The longer side has `n_pixels_max` pixels (1 to 4096); a pixel shows the darkest of its cells.
///
/// # Panics
/// Never: writing into memory fails only beyond PNG's own limits.
pub fn preview(
    site: &Grid,
    newcomer: &Grid,
    site_from_newcomer: Pose,
    n_pixels_max: u32,
) -> Vec<u8> {
    let canvas = Canvas::over(site, newcomer, site_from_newcomer, n_pixels_max);
    let site_marks = canvas.marks(&site.raster(None), Pose::IDENTITY);
    let newcomer_marks = canvas.marks(&newcomer.raster(None), site_from_newcomer);
    let pixels = site_marks.iter().zip(&newcomer_marks).flat_map(|(&a, &b)| color(a, b));
    let mut bytes = Vec::new();
    encode(&canvas, &pixels.collect::<Vec<u8>>(), &mut bytes)
        .expect("writing into memory fails only beyond PNG's own limits");
    bytes
}

/// What a map says of a pixel. The greater counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Mark {
    Unknown,
    Free,
    Wall,
}

fn color(site: Mark, newcomer: Mark) -> Color {
    match (site, newcomer) {
        (Mark::Wall, Mark::Wall) => COMMON_WALL,
        (Mark::Wall, _) => SITE_WALL,
        (_, Mark::Wall) => NEWCOMER_WALL,
        (Mark::Free, Mark::Free) => FREE[2],
        (Mark::Free, _) => FREE[0],
        (_, Mark::Free) => FREE[1],
        _ => UNKNOWN,
    }
}

/// A picture's place in the site's frame.
struct Canvas {
    /// Of the lower left pixel.
    corner: Point2<f64>,
    pixel_m: f64,
    width: u32,
    height: u32,
}

impl Canvas {
    /// One that holds all that either map has seen.
    fn over(site: &Grid, newcomer: &Grid, site_from_newcomer: Pose, n_pixels_max: u32) -> Self {
        let corners = |grid: &Grid, pose: Pose| {
            let bounds = grid.bounds().into_iter();
            bounds.flat_map(move |info| {
                let edge_m = info.frame.resolution_m();
                let side = |n: u32| f64::from(n) * edge_m;
                let (width_m, height_m) = (side(info.width), side(info.height));
                [(0.0, 0.0), (width_m, 0.0), (0.0, height_m), (width_m, height_m)]
                    .map(|(x, y)| pose * (info.origin() + Vector2::new(x, y)))
            })
        };
        let all: Vec<Point2<f64>> =
            corners(site, Pose::IDENTITY).chain(corners(newcomer, site_from_newcomer)).collect();
        let first = all.first().copied().unwrap_or_default();
        let low = all.iter().fold(first, |low, at| Point2::new(low.x.min(at.x), low.y.min(at.y)));
        let high = all.iter().fold(first, |low, at| Point2::new(low.x.max(at.x), low.y.max(at.y)));
        let n_pixels = n_pixels_max.clamp(1, N_PIXELS_SIDE_MAX);
        let side_m = (high.x - low.x).max(high.y - low.y).max(f64::MIN_POSITIVE);
        let pixel_m = side_m / f64::from(n_pixels);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
        let pixels =
            |length_m: f64| (length_m / pixel_m).ceil().clamp(1.0, f64::from(n_pixels)) as u32;
        let (width, height) = (pixels(high.x - low.x), pixels(high.y - low.y));
        Self { corner: low, pixel_m, width, height }
    }

    /// What a map says of each pixel, the top row first.
    fn marks(&self, raster: &Raster, site_from_map: Pose) -> Vec<Mark> {
        let mut marks = vec![Mark::Unknown; self.width as usize * self.height as usize];
        let frame = raster.info.frame;
        // Cells wider than pixels are drawn as squares of pixels.
        let edge_m = frame.resolution_m();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
        let n_dots = (1.5 * edge_m / self.pixel_m).ceil().clamp(1.0, 64.0) as u32;
        let dot = |n: u32| ((f64::from(n) + 0.5) / f64::from(n_dots) - 0.5) * edge_m;
        let width = raster.info.width as usize;
        for (row, cells) in (0..).zip(raster.log_odds.chunks_exact(width.max(1))) {
            for (column, &log_odds) in (0..).zip(cells) {
                let Some(mark) = mark(log_odds) else { continue };
                let cell = meetpoint_geometry::Cell {
                    x: raster.info.first.x + column,
                    y: raster.info.first.y + row,
                };
                let center = frame.center_of(cell);
                for (x, y) in (0..n_dots).flat_map(|y| (0..n_dots).map(move |x| (x, y))) {
                    let at = site_from_map * (center + Vector2::new(dot(x), dot(y)));
                    if let Some(pixel) = self.pixel_at(at) {
                        marks[pixel] = marks[pixel].max(mark);
                    }
                }
            }
        }
        marks
    }

    /// A pixel's place in the picture.
    fn pixel_at(&self, point: Point2<f64>) -> Option<usize> {
        let x = (point.x - self.corner.x) / self.pixel_m;
        let y = (point.y - self.corner.y) / self.pixel_m;
        if !(0.0 <= x && x < f64::from(self.width) && 0.0 <= y && y < f64::from(self.height)) {
            return None;
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "checked above"
        )]
        let (x, y) = (x as usize, y as usize);
        Some((self.height as usize - 1 - y) * self.width as usize + x)
    }
}

/// `None` where nothing was observed.
fn mark(log_odds: f32) -> Option<Mark> {
    if log_odds.is_nan() {
        return None;
    }
    Some(if 0.0 < log_odds { Mark::Wall } else { Mark::Free })
}

fn encode(canvas: &Canvas, pixels: &[u8], bytes: &mut Vec<u8>) -> Result<(), png::EncodingError> {
    let mut encoder = png::Encoder::new(bytes, canvas.width, canvas.height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(pixels)?;
    writer.finish()
}
