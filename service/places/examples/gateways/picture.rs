//! Stars drawn over plans.

use std::error::Error;
use std::path::Path;

use meetpoint_geometry::{GridInfo, Point2, Vector2};
use meetpoint_occupancy::Raster;
use meetpoint_places::LocalPlace;

/// Pixels along the side of a cell.
const SCALE: usize = 2;

/// An image in colours, a cell being some pixels wide.
pub(crate) struct Picture {
    info: GridInfo,
    pixels: Vec<[u8; 3]>,
}

impl Picture {
    /// Free cells white, unknown grey, the rest dark.
    pub(crate) fn new(raster: &Raster) -> Self {
        let info = raster.info;
        let width = info.width as usize;
        let colour = |index: usize| match raster.log_odds[index] {
            odds if odds.is_nan() => [150; 3],
            odds if odds < 0.0 => [255; 3],
            _ => [40; 3],
        };
        let rows = 0..info.height as usize * SCALE;
        let pixels = rows.flat_map(|y| (0..width * SCALE).map(move |x| (x / SCALE, y / SCALE)));
        Self { info, pixels: pixels.map(|(x, y)| colour(y * width + x)).collect() }
    }

    /// A place with its path fragments: red gateways, blue ways from the core through those that a
    /// path passes, others green-blue; a green core, or an orange one of what lies on a path.
    pub(crate) fn place(&mut self, local: &LocalPlace) {
        let is_place = local.place.is_some();
        for gateway in &local.gateways {
            let colour = if is_place { [220, 0, 0] } else { [255, 170, 120] };
            self.line(gateway.ends[0], gateway.ends[1], colour);
            let (sin, cos) = gateway.heading_rad.sin_cos();
            let out = gateway.center() + 0.3 * Vector2::new(cos, sin);
            self.line(gateway.center(), out, colour);
            let way = match gateway.continues_to {
                Some(_) => [0, 60, 255],
                None => [0, 170, 170],
            };
            self.line(local.core, gateway.center(), way);
        }
        let colour = if is_place { [0, 160, 0] } else { [255, 140, 0] };
        self.dot(local.core, if is_place { 0.2 } else { 0.1 }, colour);
    }

    pub(crate) fn line(&mut self, from: Point2<f64>, to: Point2<f64>, colour: [u8; 3]) {
        let step_m = self.info.frame.resolution_m() / SCALE as f64 / 2.0;
        let n_steps = ((to - from).norm() / step_m).ceil().max(1.0);
        let mut step = 0.0;
        while step <= n_steps {
            self.point(from + step / n_steps * (to - from), colour);
            step += 1.0;
        }
    }

    pub(crate) fn dot(&mut self, at: Point2<f64>, radius_m: f64, colour: [u8; 3]) {
        let (mut y, step_m) = (-radius_m, self.info.frame.resolution_m() / SCALE as f64);
        while y <= radius_m {
            let half = (radius_m * radius_m - y * y).max(0.0).sqrt();
            let ends = [-half, half].map(|x| at + Vector2::new(x, y));
            self.line(ends[0], ends[1], colour);
            y += step_m;
        }
    }

    fn point(&mut self, at: Point2<f64>, colour: [u8; 3]) {
        let offset = (at - self.info.origin()) / self.info.frame.resolution_m() * SCALE as f64;
        let (width, height) = (self.info.width as usize * SCALE, self.info.height as usize * SCALE);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
        let (x, y) = (offset.x.floor() as usize, offset.y.floor() as usize);
        if 0.0 <= offset.x && 0.0 <= offset.y && x < width && y < height {
            self.pixels[y * width + x] = colour;
        }
    }

    pub(crate) fn save(&self, path: &Path) -> Result<(), Box<dyn Error>> {
        let side = |n: u32| n * u32::try_from(SCALE).unwrap_or(1);
        let (width, height) = (side(self.info.width), side(self.info.height));
        let rows: Vec<u8> =
            self.pixels.chunks_exact(width as usize).rev().flat_map(<[_]>::concat).collect();
        let file = std::io::BufWriter::new(std::fs::File::create(path)?);
        let mut encoder = png::Encoder::new(file, width, height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.write_header()?.write_image_data(&rows)?;
        Ok(())
    }
}
