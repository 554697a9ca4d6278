//! A sheet of paper to draw on in metres: lines, dots, numbers, as a PNG.

use meetpoint_geometry::{Point2, Vector2};

use crate::error::Error;

pub(super) type Colour = [u8; 3];

const PAPER: Colour = [255, 255, 255];
const METRES: Colour = [232, 232, 232];
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
/// Digits of 3 by 5 dots, row by row.
const DIGITS: [u16; 10] = [
    0b111_101_101_101_111,
    0b010_110_010_010_111,
    0b111_001_111_100_111,
    0b111_001_111_001_111,
    0b101_101_111_001_001,
    0b111_100_111_001_111,
    0b111_100_111_101_111,
    0b111_001_010_010_010,
    0b111_101_111_101_111,
    0b111_101_111_001_111,
];

/// Pixels, the highest row first.
pub(super) struct Sheet {
    /// The upper-left corner, in metres.
    corner: Point2<f64>,
    pixels_per_m: f64,
    width: u32,
    height: u32,
    pixels: Vec<Colour>,
}

impl Sheet {
    /// Empty, with room for these points, in metres; those that are not finite count for nothing.
    pub(super) fn new(points: impl Iterator<Item = Point2<f64>>) -> Self {
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
    pub(super) fn rule(&mut self) {
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

    /// A line, so many pixels wider on both sides.
    pub(super) fn line(
        &mut self,
        from: Point2<f64>,
        to: Point2<f64>,
        paint: Colour,
        half_width: i64,
    ) {
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

    /// A disc of a radius in pixels.
    pub(super) fn dot(&mut self, at: Point2<f64>, paint: Colour, radius: i64) {
        let [x, y] = self.pixel(at);
        for dy in -radius..=radius {
            for dx in -radius..=radius {
                if dx * dx + dy * dy <= radius * radius {
                    self.set(x + dx, y + dy, paint);
                }
            }
        }
    }

    /// A number in digits of 3 by 5 dots of two pixels, centred.
    pub(super) fn number(&mut self, at: Point2<f64>, number: u32, paint: Colour) {
        let digits = number.to_string();
        let [x, y] = self.pixel(at);
        let n_digits: i64 = digits.bytes().map(|_| 1).sum();
        let left = x - 4 * n_digits + 1;
        let digits = digits.bytes().map(|digit| usize::from(digit - b'0'));
        for (place, digit) in (0_i64..).zip(digits) {
            for dot in (0..15).filter(|dot| DIGITS[digit] >> (14 - dot) & 1 == 1) {
                let (column, row) = (left + 8 * place + 2 * (dot % 3), y - 5 + 2 * (dot / 3));
                for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                    self.set(column + dx, row + dy, paint);
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

    /// As a PNG.
    ///
    /// # Errors
    /// [`Error::Internal`] if it cannot be written.
    pub(super) fn encoded(&self) -> Result<Vec<u8>, Error> {
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
