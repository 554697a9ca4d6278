//! What a step costs, in whole numbers.
//!
//! ```text
//! straight 985, diagonal 1393; 1393 / 985 = sqrt(2) (1 - 2.6e-7)
//! ```
//!
//! Whole numbers add up to the same sum in every order, so that lengths from different tables can
//! be compared exactly. 1393 / 985 is a convergent of the continued fraction of sqrt(2): two paths
//! compare as their true lengths do unless their numbers of diagonal steps differ by 985 or more.

/// What a path costs: 985 a cell of free travel along an axis.
pub type Cost = u32;

/// A step to a neighbour along an axis, through cells of weight [`WEIGHT_ONE`].
pub const STRAIGHT: Cost = 985;

/// A step to a diagonal neighbour, through cells of weight [`WEIGHT_ONE`].
pub const DIAGONAL: Cost = 1393;

/// No way. A path that costs as much, a million cells long, is not found; two such costs still add
/// up without overflow.
pub const UNREACHABLE: Cost = 1 << 30;

/// Weight of a cell that costs its length and no more. A step between two cells costs its length
/// times the mean of their weights over this.
pub const WEIGHT_ONE: u8 = 16;

/// Length of a path of that cost through cells of weight [`WEIGHT_ONE`], in cells.
///
/// The cost tells the numbers of straight and diagonal steps: `cost = 985 a + 1393 b`, and 577 is
/// the inverse of 1393 modulo 985. A path with 985 diagonal steps or more is at most 4e-4 cells off.
pub fn length_cells(cost: Cost) -> f64 {
    let cost = u64::from(cost);
    let diagonal = cost * 577 % u64::from(STRAIGHT);
    let of_diagonal = diagonal * u64::from(DIAGONAL);
    if cost < of_diagonal {
        return cost as f64 / f64::from(STRAIGHT);
    }
    let straight = (cost - of_diagonal) / u64::from(STRAIGHT);
    straight as f64 + diagonal as f64 * std::f64::consts::SQRT_2
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cost_tells_the_steps() {
        for (straight, diagonal) in [(0, 0), (7, 0), (0, 984), (12_345, 678), (1, 983)] {
            let cost = straight * STRAIGHT + diagonal * DIAGONAL;
            let length = f64::from(straight) + f64::from(diagonal) * std::f64::consts::SQRT_2;
            assert_eq!(length_cells(cost), length, "{straight} straight, {diagonal} diagonal");
        }
    }
}
