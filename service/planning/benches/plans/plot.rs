//! Loss by path length, drawn: figures 18 to 20 of the paper.
//!
//! Along x the length of the shortest path, in metres; along y the loss, in percent of it. Bars: the
//! paper's planner, grey what its choice of regions loses, light what its triplets lose. Dark dots:
//! the mode `triplet`.

use std::error::Error;
use std::path::Path;

use crate::comparison::Comparison;
use crate::tally::{N_BINS, Sums};

const WIDTH: usize = 520;
const HEIGHT: usize = 300;
/// Left and below of the bars, where the numbers stand, in pixels.
const MARGIN: usize = 44;
/// Of a bar, gap included, in pixels.
const BAR: usize = (WIDTH - MARGIN - 8) / N_BINS;
/// Of the tallest bar, in pixels.
const TALLEST: f64 = (HEIGHT - MARGIN - 24) as f64;
/// A figure's pixels are squares of so many.
const DOT: usize = 2;

const WHITE: u8 = 255;
const LIGHT: u8 = 205;
const LINE: u8 = 232;
const GREY: u8 = 130;
const BLACK: u8 = 0;

/// Figures of three by five pixels, a row in three bits, top row first.
const FIGURES: [(char, [u8; 5]); 12] = [
    ('0', [7, 5, 5, 5, 7]),
    ('1', [2, 6, 2, 2, 7]),
    ('2', [7, 1, 7, 4, 7]),
    ('3', [7, 1, 7, 1, 7]),
    ('4', [5, 5, 7, 1, 1]),
    ('5', [7, 4, 7, 1, 7]),
    ('6', [7, 4, 7, 5, 7]),
    ('7', [7, 1, 2, 2, 2]),
    ('8', [7, 5, 7, 5, 7]),
    ('9', [7, 5, 7, 1, 7]),
    ('.', [0, 0, 0, 0, 2]),
    ('%', [5, 1, 2, 4, 5]),
];

/// A picture in shades of grey, top row first.
struct Canvas(Vec<u8>);

impl Canvas {
    fn fill(&mut self, [left, right]: [usize; 2], [top, bottom]: [usize; 2], shade: u8) {
        for y in top..bottom.min(HEIGHT) {
            let row = &mut self.0[y * WIDTH..(y + 1) * WIDTH];
            row[left.min(WIDTH)..right.min(WIDTH)].fill(shade);
        }
    }

    fn write(&mut self, text: &str, left: usize, top: usize) {
        for (place, letter) in text.chars().enumerate() {
            let figure = FIGURES.iter().find(|(known, _)| *known == letter);
            let Some((_, rows)) = figure else { continue };
            for (y, row) in rows.iter().enumerate() {
                for x in (0..3).filter(|x| row >> (2 - x) & 1 == 1) {
                    let (x, y) = (left + (4 * place + x) * DOT, top + y * DOT);
                    self.fill([x, x + DOT], [y, y + DOT], BLACK);
                }
            }
        }
    }
}

/// Draws the losses of a comparison as a PNG.
pub(crate) fn draw(comparison: &Comparison, path: &Path) -> Result<(), Box<dyn Error>> {
    let [paper, triplet, _] = &comparison.tallies;
    let percent = |bin: &Sums| bin.percent(bin.topological_loss + bin.triplet_loss);
    let most = paper.bins.iter().chain(&triplet.bins).map(percent).fold(0.0, f64::max);
    let scale = Scale::new(most);
    let mut canvas = Canvas(vec![WHITE; WIDTH * HEIGHT]);
    scale.draw(&mut canvas);
    for (at, (bin, better)) in paper.bins.iter().zip(&triplet.bins).enumerate() {
        let across = [MARGIN + at * BAR + 3, MARGIN + (at + 1) * BAR - 3];
        let grey = scale.y(bin.percent(bin.topological_loss));
        canvas.fill(across, [scale.y(percent(bin)), grey], LIGHT);
        canvas.fill(across, [grey, scale.y(0.0)], GREY);
        if 0 < better.n_pairs {
            let (middle, y) = (MARGIN + at * BAR + BAR / 2, scale.y(percent(better)));
            canvas.fill([middle - 3, middle + 3], [y - 3, y + 3], BLACK);
        }
    }
    let bin_m = paper.bin_cells * comparison.resolution_m;
    for at in (0..=N_BINS).step_by(4) {
        let text = format!("{:.0}", at as f64 * bin_m);
        let middle = MARGIN + at * BAR;
        canvas.write(&text, middle - 4 * DOT * text.len() / 2, scale.y(0.0) + 8);
    }
    save(&canvas, path)
}

/// From percent to pixels.
struct Scale {
    /// Between two lines, in percent.
    step: f64,
    n_steps: u32,
}

impl Scale {
    /// Two to five lines up to above `most`, one, two or five times a power of ten apart.
    fn new(most: f64) -> Self {
        let powers = (-3..5).map(|power| 10_f64.powi(power));
        let mut steps = powers.flat_map(|power| [power, 2.0 * power, 5.0 * power]);
        let step = steps.find(|step| most < 5.0 * step).unwrap_or(1e5);
        let n_steps = (1..5).find(|&n_steps| most < f64::from(n_steps) * step).unwrap_or(5);
        Self { step, n_steps }
    }

    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within a picture")]
    fn y(&self, percent: f64) -> usize {
        let up = TALLEST * percent / (self.step * f64::from(self.n_steps));
        HEIGHT - MARGIN - up as usize
    }

    fn draw(&self, canvas: &mut Canvas) {
        for at in 0..=self.n_steps {
            let percent = f64::from(at) * self.step;
            let y = self.y(percent);
            let shade = if at == 0 { BLACK } else { LINE };
            canvas.fill([MARGIN, WIDTH - 8], [y, y + 1], shade);
            canvas.write(&format!("{}%", (percent * 1e3).round() / 1e3), 2, y - 5);
        }
    }
}

fn save(canvas: &Canvas, path: &Path) -> Result<(), Box<dyn Error>> {
    let file = std::io::BufWriter::new(std::fs::File::create(path)?);
    let mut encoder = png::Encoder::new(file, u32::try_from(WIDTH)?, u32::try_from(HEIGHT)?);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.write_header()?.write_image_data(&canvas.0)?;
    Ok(())
}
