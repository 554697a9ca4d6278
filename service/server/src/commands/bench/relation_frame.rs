//! Where the frame sits whose poses relations relate, seen from the robot's.
//!
//! Whoever made relations may have had poses of another point of the robot than the log's. Where the
//! log's poses are right, a relation that turns by `theta` is then off by
//!
//! ```text
//! t = d - R(-theta) d
//! ```
//!
//! with `d` the log's origin seen from the relations': nothing where the robot turned by nothing, twice
//! `d` where it came back. `d` is found by least squares.

use std::collections::BTreeMap;

use meetpoint_geometry::{Pose, Vector2};

use super::relations::{Relation, left};

/// Relations that turn by less in all say nothing of where their frame sits: sum of `|1 - R(-theta)|^2`.
const TURNED_MIN: f64 = 1.0;

/// `I - R(-theta)`, which turns and scales: the factor along, and the one to the left.
fn lever(turn_rad: f64) -> (f64, f64) {
    let (sin, cos) = turn_rad.sin_cos();
    (1.0 - cos, sin)
}

/// A vector turned and scaled by a lever.
fn swung((along, left): (f64, f64), v: Vector2<f64>) -> Vector2<f64> {
    Vector2::new(along * v.x - left * v.y, left * v.x + along * v.y)
}

/// `d` in metres, by relations whose poses are known. `None` if they turn too little to say.
pub(super) fn offset_m(
    poses: &BTreeMap<i64, Pose>,
    relations: &[&Relation],
) -> Option<Vector2<f64>> {
    let (mut normal, mut sum) = (0.0, Vector2::zeros());
    for (relation, off) in relations.iter().filter_map(|one| Some((one, left(poses, one)?))) {
        let (along, left) = lever(relation.turn_rad());
        normal += along * along + left * left;
        sum += swung((along, -left), Vector2::new(off.x_m, off.y_m));
    }
    (TURNED_MIN <= normal).then(|| sum / normal)
}

/// Mean translational error of relations in metres, if their frame sits at `offset_m`. `None` if no
/// relation has both poses.
pub(super) fn error_m(
    poses: &BTreeMap<i64, Pose>,
    relations: &[&Relation],
    offset_m: Vector2<f64>,
) -> Option<f64> {
    let off = relations.iter().filter_map(|relation| {
        let off = left(poses, relation)?;
        Some((Vector2::new(off.x_m, off.y_m) - swung(lever(relation.turn_rad()), offset_m)).norm())
    });
    let off: Vec<f64> = off.collect();
    (!off.is_empty()).then(|| off.iter().sum::<f64>() / off.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::super::relations::read;
    use super::*;

    /// A log's pose each second, and relations of a point 4 cm behind and 1 cm left of it.
    #[test]
    fn finds_the_frame_that_relations_are_in() {
        let seen = Pose::new(-0.04, 0.01, 0.0);
        let second = |at: i32| Pose::new(0.3 * f64::from(at), 0.1, 0.7 * f64::from(at));
        let poses: BTreeMap<i64, Pose> =
            (0..9).map(|at| (1_000_000_000 * i64::from(at), second(at))).collect();
        let line = |at: i32| {
            let (from, to) = (second(at) * seen, second(at + 1) * seen);
            let step = from.step_to(to);
            format!("{at} {} {} {} 0 0 0 {}\n", at + 1, step.x_m, step.y_m, step.theta_rad)
        };
        let relations = read(&(0..8).map(line).collect::<String>()).expect("relations");
        let all: Vec<&Relation> = relations.iter().collect();
        let found = offset_m(&poses, &all).expect("they turn");
        let expected = Vector2::new(0.04, -0.01);
        assert!((found - expected).norm() < 1e-6, "{found} is the log's seen from theirs");
        let error = |offset| error_m(&poses, &all, offset).expect("poses are there");
        assert!(error(found) < 1e-6 && 0.02 < error(Vector2::zeros()), "it explains all");
    }
}
