//! Pictures of maps: regions in colours that stay with their ids, walls dark, what was never observed
//! grey, and lines and dots over them.

use anyhow::Context;
use meetpoint_geometry::{GridInfo, Point2};
use meetpoint_occupancy::Raster;
use meetpoint_proto::v1;

pub(super) type Colour = [u8; 3];

const UNKNOWN: Colour = [205, 205, 205];
const FREE: Colour = [255, 255, 255];
const WALL: Colour = [45, 45, 45];
const SPECK: Colour = [238, 238, 238];
/// Critical lines.
pub(super) const CRITICAL_LINE: Colour = [214, 39, 40];
/// Pixels that the longer side of a small map is enlarged to, at most.
const N_PIXELS_WANTED: u32 = 1600;
/// Pixels a cell, at most.
const SCALE_MAX: u32 = 6;
/// From one id's hue to the next one's, as a share of the circle: the golden section, by which any
/// run of numbers is spread evenly.
const HUE_STEP: f64 = 0.618_033_988_749_895;

/// Colour of a region: light, so that lines stand out, and of three shades, so that neighbours whose
/// hues come near differ all the same.
fn colour(id: u64) -> Colour {
    // Ids are far below 2^53.
    let hue = (id as f64 * HUE_STEP).fract() * 6.0;
    let (saturation, value) = [(0.45, 0.97), (0.30, 0.90), (0.55, 0.86)][(id % 3) as usize];
    let channel = |offset: f64| {
        let place = (hue + offset) % 6.0;
        value * (1.0 - saturation * place.min(4.0 - place).clamp(0.0, 1.0))
    };
    [channel(5.0), channel(3.0), channel(1.0)].map(byte)
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of 255")]
fn byte(share: f64) -> u8 {
    (255.0 * share.clamp(0.0, 1.0)).round() as u8
}

/// Pixels, some a cell, the lowest row first.
pub(super) struct Canvas {
    info: GridInfo,
    scale: u32,
    width: usize,
    pixels: Vec<Colour>,
}

impl Canvas {
    pub(super) fn new(raster: &Raster) -> Self {
        let info = raster.info;
        let longest = info.width.max(info.height).max(1);
        let scale = (N_PIXELS_WANTED / longest).clamp(1, SCALE_MAX);
        let width = (info.width * scale) as usize;
        let height = (info.height * scale) as usize;
        Self { info, scale, width, pixels: vec![UNKNOWN; width * height] }
    }

    /// Walls, and every region's cells.
    pub(super) fn draw_cells(&mut self, raster: &Raster, graph: &v1::Graph) {
        let n_columns = self.info.width as usize;
        let mut cells: Vec<Colour> = raster
            .log_odds
            .iter()
            .map(|log_odds| if log_odds.is_nan() { UNKNOWN } else { WALL })
            .collect();
        for region in &graph.regions {
            let paint = if region.is_speck { SPECK } else { colour(region.id) };
            self.fill(&region.outline, |column, row| {
                if let Some(cell) = cells.get_mut(row * n_columns + column) {
                    *cell = paint;
                }
            });
        }
        let scale = self.scale as usize;
        for (index, pixel) in self.pixels.iter_mut().enumerate() {
            let (column, row) = (index % self.width / scale, index / self.width / scale);
            *pixel = cells[row * n_columns + column];
        }
    }

    /// What is free, walls, and what was never observed.
    pub(super) fn draw_occupancy(&mut self, raster: &Raster) {
        let scale = self.scale as usize;
        let n_columns = self.info.width as usize;
        for (index, pixel) in self.pixels.iter_mut().enumerate() {
            let (column, row) = (index % self.width / scale, index / self.width / scale);
            *pixel = match raster.log_odds[row * n_columns + column] {
                odds if odds.is_nan() => UNKNOWN,
                odds if odds < 0.0 => FREE,
                _ => WALL,
            };
        }
    }

    /// Tells `cell` of every column and row whose centre lies within rings, by the even-odd rule.
    fn fill(&self, rings: &[v1::Ring], mut cell: impl FnMut(usize, usize)) {
        let mut crossings = vec![Vec::new(); self.info.height as usize];
        for ring in rings {
            let corners: Vec<[usize; 2]> = ring.points.iter().map(|at| self.corner(at)).collect();
            let edges = corners.iter().zip(corners.iter().cycle().skip(1));
            for ([column, from], [_, to]) in edges.filter(|(from, to)| from[0] == to[0]) {
                let rows = *from.min(to)..(*from.max(to)).min(crossings.len());
                crossings[rows].iter_mut().for_each(|row| row.push(*column));
            }
        }
        for (row, columns) in crossings.iter_mut().enumerate() {
            columns.sort_unstable();
            for pair in columns.chunks_exact(2) {
                (pair[0]..pair[1]).for_each(|column| cell(column, row));
            }
        }
    }

    /// Column and row of a corner of cells, which lie within the picture.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates at 0")]
    fn corner(&self, point: &v1::Point) -> [usize; 2] {
        self.place(point).map(|place| place.round() as usize)
    }

    /// In cells from the lower-left corner.
    fn place(&self, point: &v1::Point) -> [f64; 2] {
        let offset = Point2::new(point.x_m, point.y_m) - self.info.origin();
        [offset.x, offset.y].map(|offset_m| offset_m / self.info.frame.resolution_m())
    }

    #[expect(clippy::cast_possible_truncation, reason = "saturates, and is looked up with care")]
    pub(super) fn pixel(&self, point: Option<v1::Point>) -> [i64; 2] {
        let place = self.place(&point.unwrap_or_default());
        place.map(|place| (place * f64::from(self.scale)).floor() as i64)
    }

    /// A line, `half_width` pixels wider on both sides.
    pub(super) fn line(&mut self, [from, to]: [[i64; 2]; 2], paint: Colour, half_width: i64) {
        let [dx, dy] = [to[0] - from[0], to[1] - from[1]];
        let n_steps = dx.abs().max(dy.abs()).clamp(1, 1 << 16);
        for step in 0..=n_steps {
            let [x, y] = [from[0] + dx * step / n_steps, from[1] + dy * step / n_steps];
            for off_y in -half_width..=half_width {
                for off_x in -half_width..=half_width {
                    self.set([x + off_x, y + off_y], paint);
                }
            }
        }
    }

    /// A dot.
    pub(super) fn dot(&mut self, [x, y]: [i64; 2], paint: Colour, radius: i64) {
        for dy in -radius..=radius {
            for dx in -radius..=radius {
                if dx * dx + dy * dy <= radius * radius {
                    self.set([x + dx, y + dy], paint);
                }
            }
        }
    }

    /// Mixes everything so far with white, of which this is the share.
    pub(super) fn fade(&mut self, white: f64) {
        let mixed = |channel: u8| byte(white + (1.0 - white) * f64::from(channel) / 255.0);
        for pixel in self.pixels.iter_mut().filter(|pixel| **pixel != WALL) {
            *pixel = pixel.map(mixed);
        }
    }

    fn set(&mut self, [x, y]: [i64; 2], paint: Colour) {
        let (Ok(x), Ok(y)) = (usize::try_from(x), usize::try_from(y)) else { return };
        if x < self.width
            && let Some(pixel) = self.pixels.get_mut(y * self.width + x)
        {
            *pixel = paint;
        }
    }

    pub(super) fn encoded(&self) -> anyhow::Result<Vec<u8>> {
        let rows = self.pixels.chunks_exact(self.width.max(1)).rev();
        let samples: Vec<u8> = rows.flatten().flatten().copied().collect();
        let mut bytes = Vec::new();
        let (width, height) = (self.info.width * self.scale, self.info.height * self.scale);
        let mut encoder = png::Encoder::new(&mut bytes, width, height);
        encoder.set_color(png::ColorType::Rgb);
        let written = encoder.write_header().and_then(|mut writer| {
            writer.write_image_data(&samples)?;
            writer.finish()
        });
        written.context("the picture cannot be written")?;
        Ok(bytes)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;

    #[test]
    fn colours_are_light_and_differ() {
        let colours: Vec<Colour> = (1..40).map(colour).collect();
        assert!(colours.iter().all(|colour| colour.iter().max() > Some(&200)), "light");
        let different: HashSet<&Colour> = colours.iter().collect();
        assert_eq!(different.len(), colours.len(), "one each: {colours:?}");
    }
}
