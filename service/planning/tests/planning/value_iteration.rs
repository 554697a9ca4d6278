//! Value iteration against the equation, from scratch and after changes.

use expect_test::{Expect, expect};
use meetpoint_geometry::{Cell, GridFrame, GridInfo};
use meetpoint_planning::{Ground, InvalidGround, ValueIteration};
use proptest::prelude::*;

fn info(width: u32, height: u32) -> GridInfo {
    let frame = GridFrame::new(0.15).expect("a length");
    GridInfo { frame, first: Cell { x: -3, y: 5 }, width, height }
}

/// The equation, applied until nothing changes.
fn reference(info: GridInfo, ground: &[Ground], diagonal: f32) -> Vec<f32> {
    let (width, height) = (info.width.cast_signed(), info.height.cast_signed());
    let at = |x: i32, y: i32| {
        let is_inside = 0 <= x && x < width && 0 <= y && y < height;
        is_inside.then(|| (y * width + x).cast_unsigned() as usize)
    };
    let cost = |x, y| at(x, y).map_or(f32::INFINITY, |at| ground[at].cost.max(Ground::COST_MIN));
    let mut values: Vec<f32> =
        ground.iter().map(|ground| if ground.is_goal { 0.0 } else { f32::INFINITY }).collect();
    loop {
        let before = values.clone();
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            for (dx, dy) in (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (dx, dy))) {
                let Some(from) = at(x + dx, y + dy) else { continue };
                let cuts = !cost(x + dx, y).is_finite() || !cost(x, y + dy).is_finite();
                let step = match (dx, dy) {
                    (0, 0) => continue,
                    (0, _) | (_, 0) => cost(x + dx, y + dy),
                    _ if cuts => continue,
                    _ => diagonal * cost(x + dx, y + dy),
                };
                let here = at(x, y).expect("inside");
                values[here] = values[here].min(values[from] + step);
            }
        }
        if values == before {
            return values;
        }
    }
}

fn values(iteration: &ValueIteration) -> Vec<f32> {
    (0..iteration.info().n_cells()).map(|cell| iteration.value(cell)).collect()
}

/// Ground in words: mostly free, some dear, some closed, a few goals.
fn ground() -> impl Strategy<Value = Ground> {
    let cost = prop_oneof![
        6 => Just(0.05_f32),
        3 => 0.05_f32..1.0,
        3 => Just(f32::INFINITY),
        1 => Just(0.0_f32),
    ];
    (cost, prop::bool::weighted(0.04)).prop_map(|(cost, is_goal)| Ground { cost, is_goal })
}

proptest! {
    #[test]
    fn fulfils_the_equation_from_scratch_and_after_changes(
        (width, height) in (1..24_u32, 1..24_u32),
        first in prop::collection::vec(ground(), 24 * 24),
        changes in prop::collection::vec(
            prop::collection::vec((any::<prop::sample::Index>(), ground()), 1..6), 0..6),
        diagonal in prop_oneof![Just(1.0_f32), Just(std::f32::consts::SQRT_2)],
    ) {
        let info = info(width, height);
        let mut ground = first[..info.n_cells()].to_vec();
        let mut iteration = ValueIteration::new(info, &ground, diagonal).expect("fits");
        for changes in std::iter::once(vec![]).chain(changes) {
            for (at, now) in changes {
                let cell = at.index(ground.len());
                ground[cell] = now;
                iteration.set(cell, now);
            }
            let settled = iteration.settle(u32::MAX);
            prop_assert!(settled.is_settled);
            prop_assert_eq!(values(&iteration), reference(info, &ground, diagonal));
        }
    }

    #[test]
    fn any_time_values_are_bounds_from_above(
        first in prop::collection::vec(ground(), 16 * 16),
        n_sweeps in 0..4_u32,
    ) {
        let info = info(16, 16);
        let mut iteration = ValueIteration::new(info, &first, 1.0).expect("fits");
        iteration.settle(n_sweeps);
        let truth = reference(info, &first, 1.0);
        for (value, truth) in values(&iteration).into_iter().zip(truth) {
            prop_assert!(truth <= value, "{} is below {}", value, truth);
        }
    }

    #[test]
    fn paths_cost_what_values_say(first in prop::collection::vec(ground(), 16 * 16)) {
        let info = info(16, 16);
        let mut iteration = ValueIteration::new(info, &first, 1.0).expect("fits");
        iteration.settle(u32::MAX);
        for cell in 0..first.len() {
            let path = iteration.path(cell);
            prop_assert_eq!(path.is_empty(), iteration.value(cell).is_infinite());
            // Summed up from the goal, as values are.
            let entered = path.iter().skip(1).rev();
            let sum = entered.fold(0.0, |sum, &cell| sum + first[cell].cost.max(Ground::COST_MIN));
            prop_assert!(path.is_empty() || sum == iteration.value(cell));
        }
    }
}

/// `#` cannot be entered, `?` is unexplored, anything else costs 1.
fn drawn(drawing: &str) -> (GridInfo, Vec<Ground>) {
    let rows: Vec<&str> = drawing.lines().map(str::trim).rev().collect();
    let ground = rows.iter().flat_map(|row| row.chars()).map(|symbol| Ground {
        cost: if symbol == '#' { f32::INFINITY } else { 1.0 },
        is_goal: symbol == '?',
    });
    let side = |n: usize| u32::try_from(n).expect("a small drawing");
    (info(side(rows[0].len()), side(rows.len())), ground.collect())
}

fn check(iteration: &ValueIteration, ground: &[Ground], expected: &Expect) {
    let width = iteration.info().width as usize;
    let symbols = || ('0'..='9').chain('a'..='z').zip(0_u8..);
    let symbol = |cell: usize| match iteration.value(cell) {
        _ if ground[cell].cost.is_infinite() => '#',
        value => symbols().find(|&(_, n)| f32::from(n) == value).map_or('-', |(symbol, _)| symbol),
    };
    let rows = (0..ground.len() / width).rev();
    let rows = rows.map(|y| (0..width).map(|x| symbol(y * width + x)).collect::<String>());
    expected.assert_eq(&rows.collect::<Vec<_>>().join("\n"));
}

#[test]
fn a_door_closes_and_the_way_to_the_unexplored_is_another() {
    let (info, mut ground) = drawn(
        "#########
         #...#..?#
         #.......#
         #...#...#
         #.###...#
         #.......#
         #########",
    );
    let mut iteration = ValueIteration::new(info, &ground, 1.0).expect("fits");
    iteration.settle(u32::MAX);
    check(
        &iteration,
        &ground,
        &expect![[r"
            #########
            #655#210#
            #6543211#
            #655#222#
            #7###333#
            #8765444#
            #########"]],
    );
    let door = 4 * 9 + 4;
    ground[door].cost = f32::INFINITY;
    iteration.set(door, ground[door]);
    iteration.settle(u32::MAX);
    check(
        &iteration,
        &ground,
        &expect![[r"
            #########
            #ccc#210#
            #bbc#211#
            #abc#222#
            #9###333#
            #8765444#
            #########"]],
    );
}

#[test]
fn refuses_what_makes_no_problem() {
    let (info, ground) = drawn("..\n..");
    let error = |ground: &[Ground], diagonal| {
        ValueIteration::new(info, ground, diagonal).expect_err("refused").to_string()
    };
    assert_eq!(error(&ground[..3], 1.0), "3 pieces of ground for 4 cells", "too few");
    assert_eq!(
        error(&ground, 0.5),
        "a diagonal step costs 0.5 straight ones; needed is at least 1",
        "too cheap"
    );
    assert!(
        matches!(
            ValueIteration::new(info, &ground, f32::NAN).expect_err("refused"),
            InvalidGround::Diagonal(_)
        ),
        "no number"
    );
    let nowhere = ValueIteration::new(info, &ground, 1.0)
        .map(|mut nowhere| (nowhere.settle(u32::MAX).is_settled, nowhere.path(0).is_empty()));
    assert_eq!(nowhere.ok(), Some((true, true)), "no goal, no way");
}
