//! Landmarks with names, where walls alone do not say which place it is.

use std::sync::Arc;

use meetpoint_geometry::{Point2, Pose};
use meetpoint_merging::{
    AlignmentParams, AlignmentSearch, Alignments, MergeRules, NamedLandmark, Part, Reason, Verdict,
};

use crate::drawn::{FLOOR, ROOM, ROOMS_ALIKE, World};

const PARAMS: AlignmentParams = AlignmentParams::INDOOR;
const NEWCOMER_FROM_WORLD: Pose = Pose { x_m: 4.0, y_m: 4.0, theta_rad: 0.7 };

/// Rooms that are all alike, and one such room.
fn rooms() -> [Part; 2] {
    let site = World::new(ROOMS_ALIKE).grid(0.05, Pose::IDENTITY, 0.0..30.0);
    let newcomer = World::new(ROOM).grid(0.05, NEWCOMER_FROM_WORLD, 0.0..30.0);
    [&site, &newcomer].map(|grid| Part::of_grid(grid, &PARAMS))
}

fn aligned([site, newcomer]: [Part; 2]) -> Alignments {
    let (site, newcomer) = (Arc::new(site), Arc::new(newcomer));
    AlignmentSearch::new(site, newcomer, PARAMS, MergeRules::INDOOR).into_alignments()
}

fn tags(at: &[Point2<f64>]) -> Vec<NamedLandmark> {
    let tags = (0..).zip(at).map(|(name, &at)| NamedLandmark { name, at, variance_m2: 0.01 });
    tags.collect()
}

/// Where `n` tags hang, in the newcomer's frame.
fn in_newcomer(n: usize) -> Vec<Point2<f64>> {
    let in_room = [(1.0, 1.0), (3.5, 2.0), (1.5, 3.0)].map(|(x_m, y_m)| Point2::new(x_m, y_m));
    in_room[..n].iter().map(|&at| NEWCOMER_FROM_WORLD * at).collect()
}

/// The rooms with `n` tags in both maps, which hang in that room, a decimetre off.
fn tagged(site_from_newcomer: Pose, n: usize) -> [Part; 2] {
    let own = in_newcomer(n);
    let in_site = own.iter().map(|&at| site_from_newcomer * at + nalgebra::Vector2::new(0.1, 0.0));
    let in_site: Vec<Point2<f64>> = in_site.collect();
    let [site, newcomer] = rooms();
    [site.with_landmarks(tags(&in_site)), newcomer.with_landmarks(tags(&own))]
}

#[test]
fn two_names_tell_rooms_apart_that_walls_do_not() {
    let by_walls = aligned(rooms());
    assert_eq!(by_walls.verdict, Verdict::Ambiguous, "{:?}", by_walls.reasons);
    for room in &by_walls.ranked[..4] {
        let truth = room.site_from_newcomer;
        let found = aligned(tagged(truth, 2));
        let best = &found.ranked[0];
        let off_m = best.site_from_newcomer.step_to(truth).distance_m();
        assert!(off_m < 0.2, "{off_m} m off");
        assert_eq!((best.n_named, best.n_named_agreeing), (2, 2), "{best:?}");
        assert!(!found.reasons.iter().any(|it| matches!(it, Reason::Rival { .. })), "{found:?}");
        assert_ne!(found.verdict, Verdict::Ambiguous, "{:?}", found.reasons);
    }
}

#[test]
fn one_name_is_not_enough() {
    let truth = aligned(rooms()).ranked[3].site_from_newcomer;
    let found = aligned(tagged(truth, 1));
    assert_eq!(found.verdict, Verdict::Ambiguous, "it may be called so twice: {:?}", found.reasons);
    let best = &found.ranked[0];
    assert_eq!(best.n_named_agreeing, 1, "but the room with it is the first: {best:?}");
}

/// Two tags of one name in a map say nothing.
#[test]
fn a_name_that_several_have_does_not_count() {
    let truth = aligned(rooms()).ranked[2].site_from_newcomer;
    let [site, newcomer] = tagged(truth, 2);
    let at = in_newcomer(2);
    let twice = [at.clone(), at].concat();
    let landmarks = twice.iter().enumerate().map(|(index, &at)| NamedLandmark {
        name: u32::from(index % 2 == 1),
        at,
        variance_m2: 0.01,
    });
    let found = aligned([site, newcomer.with_landmarks(landmarks.collect())]);
    assert_eq!(found.verdict, Verdict::Ambiguous, "{:?}", found.reasons);
    assert_eq!(found.ranked[0].n_named, 0, "{:?}", found.ranked[0]);
}

#[test]
fn names_that_lie_elsewhere_need_a_person() {
    let world = World::new(FLOOR);
    let pose = Pose::new(1.0, 2.0, 1.0);
    let grids = [world.grid(0.05, Pose::IDENTITY, 0.0..20.0), world.grid(0.05, pose, 8.0..30.0)];
    let at = [Point2::new(12.0, 4.0), Point2::new(15.0, 8.0)];
    let merged = |shift_m: f64| {
        let [site, newcomer] = grids.each_ref().map(|grid| Part::of_grid(grid, &PARAMS));
        let moved = at.map(|at| at + nalgebra::Vector2::new(shift_m, 0.0));
        let site = site.with_landmarks(tags(&moved));
        aligned([site, newcomer.with_landmarks(tags(&at.map(|at| pose * at)))])
    };
    assert_eq!(merged(0.1).verdict, Verdict::Merged, "{:?}", merged(0.1).reasons);
    let found = merged(6.0);
    let off_m = (found.ranked[0].site_from_newcomer * pose).distance_m();
    assert!(off_m < 0.2, "so many walls are right: {off_m} m");
    assert_eq!(found.verdict, Verdict::Proposed, "{:?}", found.reasons);
    let named = Reason::NamedElsewhere { n_elsewhere: 2, n_common: 2 };
    assert!(found.reasons.contains(&named), "{:?}", found.reasons);
}
