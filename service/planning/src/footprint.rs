//! Configuration space of a round robot: cells that its centre may be at.
//!
//! A cell may be entered if its centre is at least
//!
//! ```text
//! rho = sqrt(radius² + (resolution / 2)²)
//! ```
//!
//! from every obstacle cell, a square. Then the robot on the straight way between the centres of
//! two neighbours, diagonal ones only where both cells beside the diagonal may be entered, never
//! comes closer than `radius` to a square: what is nearest to the middle of a step is at least
//! `sqrt(rho² - (resolution / 2)²)` away. T. Lozano-Pérez, "Spatial planning: a configuration
//! space approach", IEEE Transactions on Computers C-32 (1983). Time and space O(cells).

use meetpoint_topology::FreeSpace;

/// For every cell of `space` whether the centre of a robot of `radius_m` may be there. A radius of
/// 0 leaves the free cells as they are.
pub fn enterable(space: &FreeSpace, radius_m: f64) -> Vec<bool> {
    let info = space.info();
    let (width, height) = (info.width as usize, info.height as usize);
    // In half cells, where an obstacle's edge is 1 from its centre.
    let radius = 2.0 * radius_m.max(0.0) / info.frame.resolution_m();
    let rho_squared = radius * radius + 1.0;
    let rise = rises(space);
    let mut enterable = space.is_free().to_vec();
    let mut blocks = vec![0_i32; width + 1];
    for y in 0..height {
        let row = y * width..(y + 1) * width;
        blocks.fill(0);
        for (x, &rise) in rise[row.clone()].iter().enumerate() {
            if let Some(reach) = reach(rho_squared - f64::from(rise) * f64::from(rise)) {
                blocks[x.saturating_sub(reach)] += 1;
                blocks[(x + reach + 1).min(width)] -= 1;
            }
        }
        let mut n_blocks = 0;
        for (is_enterable, block) in enterable[row].iter_mut().zip(&blocks) {
            n_blocks += block;
            *is_enterable &= n_blocks == 0;
        }
    }
    enterable
}

/// How many columns away an obstacle still blocks, if `left` of the squared distance is left for
/// the columns: the largest `n` with `max(2 n - 1, 0)² < left`.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "below a million")]
fn reach(left: f64) -> Option<usize> {
    if left <= 0.0 {
        return None;
    }
    let nearest = left.sqrt();
    let mut n = f64::midpoint(nearest.min(1e6), 1.0) as usize;
    while 0 < n && left <= (2.0 * n as f64 - 1.0).powi(2) {
        n -= 1;
    }
    Some(n)
}

/// For every cell how far its centre is above or below the nearest obstacle of its column, in half
/// cells: 0 on an obstacle.
fn rises(space: &FreeSpace) -> Vec<u32> {
    let width = space.info().width as usize;
    let is_free = space.is_free();
    let far = u32::MAX / 4;
    let mut steps = vec![far; is_free.len()];
    let next = |steps: u32| (steps + 1).min(far);
    for index in 0..steps.len() {
        let below = if index < width { far } else { next(steps[index - width]) };
        steps[index] = if is_free[index] { below } else { 0 };
    }
    for index in (0..steps.len().saturating_sub(width)).rev() {
        steps[index] = steps[index].min(next(steps[index + width]));
    }
    for steps in &mut steps {
        *steps = (2 * *steps).saturating_sub(1);
    }
    steps
}
