//! Values of exploration as a picture, as Fig. 12 of S. Thrun, Artificial Intelligence 99 (1998).

use meetpoint_planning::Exploration;

use super::grey_png::grey_png;
use crate::error::Error;

/// Grey of the nearest explored cell and of the farthest; what cannot be reached is black.
const GREYS: [f32; 2] = [230.0, 50.0];

/// The values of an exploration that was asked, as a grey PNG, a pixel a cell, the highest row
/// first: white is unexplored, the darker the farther from it, black cannot be reached.
///
/// # Errors
/// [`Error::Internal`] if it cannot be written.
pub(crate) fn png(exploration: &Exploration) -> Result<Vec<u8>, Error> {
    let values = exploration.values().ok_or_else(|| Error::internal("nothing was explored"))?;
    let info = values.info();
    let width = info.width as usize;
    let farthest = (0..info.n_cells())
        .map(|cell| values.value(cell))
        .filter(|value| value.is_finite())
        .fold(0.0, f32::max);
    let grey = |cell: usize| match exploration.ground().get(cell) {
        Some(ground) if ground.is_goal => u8::MAX,
        Some(ground) if ground.cost.is_finite() => grey(values.value(cell), farthest),
        _ => 0,
    };
    let rows = (0..info.height as usize).rev();
    let samples: Vec<u8> =
        rows.flat_map(|row| (row * width..(row + 1) * width).map(grey)).collect();
    grey_png([info.width, info.height], &samples)
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within the greys")]
fn grey(value: f32, farthest: f32) -> u8 {
    if value.is_infinite() {
        return 0;
    }
    let share = if 0.0 < farthest { value / farthest } else { 0.0 };
    (GREYS[0] + share * (GREYS[1] - GREYS[0])).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_darker_the_farther() {
        let greys = [grey(0.0, 8.0), grey(4.0, 8.0), grey(8.0, 8.0), grey(f32::INFINITY, 8.0)];
        assert_eq!(greys, [230, 140, 50, 0], "what cannot be reached is black");
        assert_eq!(grey(0.0, 0.0), 230, "everything is near");
    }
}
