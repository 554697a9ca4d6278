//! The way of a session and its landmarks as a picture: the way blue from a green start, what was
//! seen along it as orange dots, landmarks as red ones in an ellipse of two standard deviations.

use std::f64::consts::TAU;

use meetpoint_geometry::{Point2, Vector2};

use crate::error::Error;

type Colour = [u8; 3];

const PAPER: Colour = [255, 255, 255];
const METRES: Colour = [232, 232, 232];
const WAY: Colour = [31, 80, 180];
const START: Colour = [30, 150, 60];
const SEEN: Colour = [240, 140, 30];
const LANDMARK: Colour = [200, 30, 40];

/// Pixels of the longer side, at most, without the margin.
const N_PIXELS_MAX: f64 = 1200.0;
/// Pixels a metre, at most.
const PIXELS_PER_M_MAX: f64 = 40.0;
/// What lies farther from the sheet's corner is drawn there, in pixels.
const N_PIXELS_FAR: f64 = 1e6;
/// Around all that is drawn, in pixels.
const MARGIN: f64 = 30.0;
/// Between the lines beneath, in metres.
const LINES_M: f64 = 10.0;
/// What an ellipse shows, in standard deviations.
const DEVIATIONS: f64 = 2.0;
/// Corners of an ellipse.
const N_CORNERS: u32 = 48;

/// What is drawn, in metres.
#[derive(Clone, Debug, Default)]
pub(crate) struct Way {
    pub(crate) points: Vec<Point2<f64>>,
    /// Where the robot was when it saw a landmark.
    pub(crate) seen: Vec<Point2<f64>>,
    /// Landmarks, and their covariances: xx, xy, yy in square metres.
    pub(crate) landmarks: Vec<(Point2<f64>, [f64; 3])>,
}

impl Way {
    fn all_points(&self) -> impl Iterator<Item = Point2<f64>> + '_ {
        let landmarks = self.landmarks.iter().map(|(at, _)| *at);
        self.points.iter().copied().chain(landmarks)
    }
}

/// A PNG of `shown` on a sheet that holds `other` too, so that both can be laid over each other.
///
/// # Errors
/// [`Error::Internal`] if it cannot be written.
pub(crate) fn png(shown: &Way, other: &Way) -> Result<Vec<u8>, Error> {
    let mut sheet = Sheet::new(shown.all_points().chain(other.all_points()));
    sheet.rule();
    for pair in shown.points.windows(2) {
        sheet.line(pair[0], pair[1], WAY, 1);
    }
    for &at in &shown.seen {
        sheet.dot(at, SEEN, 3);
    }
    if let Some(&start) = shown.points.first() {
        sheet.dot(start, START, 6);
    }
    for &(at, covariance_m2) in &shown.landmarks {
        let corners = ellipse(at, covariance_m2);
        for pair in corners.windows(2) {
            sheet.line(pair[0], pair[1], LANDMARK, 0);
        }
        sheet.dot(at, LANDMARK, 4);
    }
    sheet.encoded()
}

/// The ellipse of [`DEVIATIONS`] about a place, closed: by the Cholesky root of its covariance.
fn ellipse(at: Point2<f64>, [xx, xy, yy]: [f64; 3]) -> Vec<Point2<f64>> {
    let a = xx.max(0.0).sqrt();
    let b = if 0.0 < a { xy / a } else { 0.0 };
    let c = (yy - b * b).max(0.0).sqrt();
    let corner = |index: u32| {
        let (sin, cos) = (TAU * f64::from(index) / f64::from(N_CORNERS)).sin_cos();
        at + DEVIATIONS * Vector2::new(a * cos, b * cos + c * sin)
    };
    (0..=N_CORNERS).map(corner).collect()
}

/// Pixels, the highest row first.
struct Sheet {
    /// The upper-left corner, in metres.
    corner: Point2<f64>,
    pixels_per_m: f64,
    width: u32,
    height: u32,
    pixels: Vec<Colour>,
}

impl Sheet {
    fn new(points: impl Iterator<Item = Point2<f64>>) -> Self {
        let finite = points.filter(|at| at.x.is_finite() && at.y.is_finite());
        let bounds = finite.fold(None, |bounds: Option<(Point2<f64>, Point2<f64>)>, at| {
            let (low, high) = bounds.unwrap_or((at, at));
            Some((low.inf(&at), high.sup(&at)))
        });
        let (low, high) = bounds.unwrap_or_default();
        let size_m = high - low;
        let longest_m = size_m.x.max(size_m.y);
        let pixels_per_m = (N_PIXELS_MAX / longest_m.max(1.0)).min(PIXELS_PER_M_MAX);
        let margin_m = MARGIN / pixels_per_m;
        let corner = Point2::new(low.x - margin_m, high.y + margin_m);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most 1260")]
        let n_pixels = |side_m: f64| (side_m * pixels_per_m + 2.0 * MARGIN).ceil() as u32;
        let (width, height) = (n_pixels(size_m.x), n_pixels(size_m.y));
        let pixels = vec![PAPER; width as usize * height as usize];
        Self { corner, pixels_per_m, width, height, pixels }
    }

    /// Lines every so many metres, by which distances can be told.
    fn rule(&mut self) {
        let size = Vector2::new(f64::from(self.width), -f64::from(self.height)) / self.pixels_per_m;
        let far = self.corner + size;
        let multiples = |low: f64, high: f64| {
            let first = (low / LINES_M).ceil();
            let n = ((high / LINES_M).floor() - first).max(-1.0);
            (0_u32..)
                .map(move |index| (first + f64::from(index)) * LINES_M)
                .take_while(move |at| 0.0 <= n && *at <= high)
        };
        for x_m in multiples(self.corner.x, far.x) {
            self.line(Point2::new(x_m, far.y), Point2::new(x_m, self.corner.y), METRES, 0);
        }
        for y_m in multiples(far.y, self.corner.y) {
            self.line(Point2::new(self.corner.x, y_m), Point2::new(far.x, y_m), METRES, 0);
        }
    }

    #[expect(clippy::cast_possible_truncation, reason = "a million at most; NaN is 0")]
    fn pixel(&self, at: Point2<f64>) -> [i64; 2] {
        let offset = (at - self.corner) * self.pixels_per_m;
        [offset.x, -offset.y].map(|at| at.floor().clamp(-N_PIXELS_FAR, N_PIXELS_FAR) as i64)
    }

    fn line(&mut self, from: Point2<f64>, to: Point2<f64>, paint: Colour, half_width: i64) {
        let ([x0, y0], [x1, y1]) = (self.pixel(from), self.pixel(to));
        let n_steps = (x1 - x0).abs().max((y1 - y0).abs()).clamp(1, 1 << 12);
        for step in 0..=n_steps {
            let [x, y] = [x0 + (x1 - x0) * step / n_steps, y0 + (y1 - y0) * step / n_steps];
            for off in -half_width..=half_width {
                self.set(x + off, y, paint);
                self.set(x, y + off, paint);
            }
        }
    }

    fn dot(&mut self, at: Point2<f64>, paint: Colour, radius: i64) {
        let [x, y] = self.pixel(at);
        for dy in -radius..=radius {
            for dx in -radius..=radius {
                if dx * dx + dy * dy <= radius * radius {
                    self.set(x + dx, y + dy, paint);
                }
            }
        }
    }

    fn set(&mut self, x: i64, y: i64, paint: Colour) {
        let (Ok(x), Ok(y)) = (u32::try_from(x), u32::try_from(y)) else { return };
        if x < self.width && y < self.height {
            self.pixels[y as usize * self.width as usize + x as usize] = paint;
        }
    }

    fn encoded(&self) -> Result<Vec<u8>, Error> {
        let samples: Vec<u8> = self.pixels.iter().flatten().copied().collect();
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width, self.height);
        encoder.set_color(png::ColorType::Rgb);
        let written = encoder.write_header().and_then(|mut writer| {
            writer.write_image_data(&samples)?;
            writer.finish()
        });
        written.map_err(Error::internal)?;
        Ok(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ellipses_are_as_wide_as_they_say() {
        let corners = ellipse(Point2::new(1.0, 2.0), [0.25, 0.1, 0.09]);
        let widest = corners.iter().map(|at| at.x).fold(f64::MIN, f64::max);
        let highest = corners.iter().map(|at| at.y).fold(f64::MIN, f64::max);
        assert!((widest - 2.0).abs() < 1e-9, "two deviations of half a metre: {widest}");
        assert!((highest - 2.6).abs() < 2e-3, "two of 0.3 m: {highest}");
    }

    #[test]
    fn whatever_comes_is_a_picture() {
        let far = [f64::NAN, f64::INFINITY, 1e5, -1e5, 0.0].map(|x_m| Point2::new(x_m, 1.0));
        let landmarks = vec![(far[2], [f64::NAN, 1.0, -1.0])];
        let wild = Way { points: far.to_vec(), seen: far.to_vec(), landmarks };
        for (shown, other) in [(&Way::default(), &wild), (&wild, &Way::default())] {
            let bytes = png(shown, other).expect("a picture");
            assert!(bytes.starts_with(b"\x89PNG"), "a PNG");
        }
        let empty = png(&Way::default(), &Way::default()).expect("a picture");
        assert!(empty.len() < 2000, "a small empty sheet");
    }
}
