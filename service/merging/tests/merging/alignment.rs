//! Planted transforms are found, what cannot be told is not merged.

use std::f64::consts::PI;
use std::num::NonZero;
use std::sync::Arc;

use meetpoint_geometry::{GridFrame, Pose};
use meetpoint_merging::{
    AlignmentParams, AlignmentSearch, Alignments, MergeRules, Part, Reason, Verdict, preview,
};
use meetpoint_occupancy::{Grid, read_png};
use proptest::prelude::*;

use crate::drawn::{FLOOR, ROOM, ROOMS_ALIKE, World};

const PARAMS: AlignmentParams = AlignmentParams::INDOOR;

fn aligned(site: &Grid, newcomer: &Grid, n_threads: usize) -> Alignments {
    let part = |grid| Arc::new(Part::of_grid(grid, &PARAMS));
    let mut search = AlignmentSearch::new(part(site), part(newcomer), PARAMS, MergeRules::INDOOR);
    search.use_threads(NonZero::new(n_threads).expect("not zero"));
    let mut share = 0.0;
    while let Some(progress) = search.advance() {
        assert!(share <= progress.share && progress.share <= 1.0, "{progress:?} after {share}");
        share = progress.share;
    }
    search.into_alignments()
}

/// Error of the first alignment: metres at the newcomer's middle, and radians.
fn off(alignments: &Alignments, map_from_world: Pose) -> (f64, f64) {
    let best = alignments.ranked.first().expect("an alignment");
    let error = best.site_from_newcomer * map_from_world;
    let middle = meetpoint_geometry::Point2::new(15.0, 7.0);
    ((error * middle - middle).norm(), error.theta_rad.abs())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    /// However the newcomer's frame lies, its map is laid where it belongs.
    #[test]
    fn turning_the_newcomer_turns_the_answer(
        (x, y, turn) in (-40.0_f64..40.0, -40.0_f64..40.0, -PI..PI),
        share in 0.6_f64..0.8,
    ) {
        let world = World::new(FLOOR);
        let pose = Pose::new(x, y, turn);
        let site = world.grid(0.05, Pose::IDENTITY, 0.0..30.0 * share);
        let newcomer = world.grid(0.05, pose, 30.0 * (1.0 - share) - 4.0..30.0);
        let found = aligned(&site, &newcomer, 1);
        let (off_m, off_rad) = off(&found, pose);
        prop_assert!(off_m < 0.1 && off_rad < 0.5_f64.to_radians(), "{off_m} m, {off_rad}");
        prop_assert_eq!(found.verdict, Verdict::Merged, "{:?}", found.reasons);
    }
}

#[test]
fn grids_of_other_resolutions_are_laid_on_one_another() {
    let world = World::new(FLOOR);
    let pose = Pose::new(3.0, -2.0, 2.0);
    for (fine_m, coarse_m) in [(0.02, 0.1), (0.05, 0.15)] {
        let site = world.grid(coarse_m, Pose::IDENTITY, 0.0..20.0);
        let newcomer = world.grid(fine_m, pose, 8.0..30.0);
        let found = aligned(&site, &newcomer, 1);
        let (off_m, off_rad) = off(&found, pose);
        assert!(off_m < 0.15 && off_rad < 0.01, "{fine_m} on {coarse_m}: {off_m} m, {off_rad}");
        assert_eq!(found.verdict, Verdict::Merged, "{:?}", found.reasons);
    }
}

#[test]
fn threads_change_no_bit() {
    let world = World::new(FLOOR);
    let site = world.grid(0.05, Pose::IDENTITY, 0.0..18.0);
    let newcomer = world.grid(0.05, Pose::new(1.0, 2.0, 1.0), 10.0..30.0);
    let one = aligned(&site, &newcomer, 1);
    for n_threads in [2, 3] {
        assert_eq!(aligned(&site, &newcomer, n_threads), one, "{n_threads} threads");
    }
}

#[test]
fn a_room_like_others_is_ambiguous() {
    let site = World::new(ROOMS_ALIKE).grid(0.05, Pose::IDENTITY, 0.0..30.0);
    let newcomer = World::new(ROOM).grid(0.05, Pose::new(4.0, 4.0, 0.7), 0.0..30.0);
    let found = aligned(&site, &newcomer, 1);
    assert_eq!(found.verdict, Verdict::Ambiguous, "{:?}", found.reasons);
    assert!(matches!(found.reasons[0], Reason::Rival { .. }), "{}", found.reasons[0]);
    assert!(4 <= found.ranked.len(), "each room is a place: {}", found.ranked.len());
    let margin = found.ranked[0].margin.expect("a rival");
    assert!(margin < 1.0, "{margin}");
}

/// The other way round: what the site has seen is found several times in the newcomer's map.
#[test]
fn a_site_like_parts_of_the_newcomer_is_ambiguous() {
    let site = World::new(ROOM).grid(0.05, Pose::IDENTITY, 0.0..30.0);
    let newcomer = World::new(ROOMS_ALIKE).grid(0.05, Pose::new(1.0, 0.0, 0.3), 0.0..30.0);
    let found = aligned(&site, &newcomer, 1);
    assert_eq!(found.verdict, Verdict::Ambiguous, "{:?}", found.reasons);
}

#[test]
fn a_corridor_alone_is_not_merged() {
    let corridor = format!("{}\n{}\n{}", "#".repeat(80), ".".repeat(80), "#".repeat(80));
    let world = World::new(&corridor);
    let site = world.grid(0.05, Pose::IDENTITY, 0.0..30.0);
    let newcomer = world.grid(0.05, Pose::new(4.0, 4.0, 0.7), 12.0..40.0);
    let found = aligned(&site, &newcomer, 1);
    assert_ne!(found.verdict, Verdict::Merged, "{:?}", found.reasons);
}

#[test]
fn other_floors_do_not_overlap() {
    let site = World::new(FLOOR).grid(0.05, Pose::IDENTITY, 0.0..30.0);
    let newcomer = World::new(ROOMS_ALIKE).grid(0.05, Pose::new(4.0, 4.0, 0.7), 0.0..30.0);
    let found = aligned(&site, &newcomer, 1);
    assert!(
        [Verdict::NoOverlap, Verdict::Ambiguous].contains(&found.verdict),
        "{:?}",
        found.reasons
    );
}

#[test]
fn who_has_seen_little_waits() {
    let world = World::new(FLOOR);
    let site = world.grid(0.05, Pose::IDENTITY, 0.0..30.0);
    let nothing = Grid::new(GridFrame::new(0.05).expect("a length"));
    let corner = World::new("##\n#.").grid(0.05, Pose::IDENTITY, 0.0..3.0);
    for (site, newcomer) in [(&site, &nothing), (&nothing, &site), (&site, &corner)] {
        let found = aligned(site, newcomer, 1);
        assert_eq!(found.verdict, Verdict::NotEnoughSeen, "{:?}", found.reasons);
        assert!(found.ranked.is_empty(), "{:?}", found.ranked);
    }
}

/// That a room fits nowhere yet does not say that it lies nowhere.
#[test]
fn a_room_that_fits_nowhere_waits() {
    let site = World::new(FLOOR).grid(0.05, Pose::IDENTITY, 0.0..12.0);
    let newcomer = World::new(ROOM).grid(0.05, Pose::new(4.0, 4.0, 0.7), 0.0..30.0);
    let found = aligned(&site, &newcomer, 1);
    assert_eq!(found.verdict, Verdict::NotEnoughSeen, "{:?}", found.reasons);
    assert!(matches!(found.reasons[0], Reason::FewWalls { .. }), "{}", found.reasons[0]);
}

#[test]
fn a_preview_shows_both() {
    let world = World::new(FLOOR);
    let site = world.grid(0.05, Pose::IDENTITY, 0.0..18.0);
    let pose = Pose::new(1.0, 2.0, 1.0);
    let newcomer = world.grid(0.05, pose, 10.0..30.0);
    let picture = read_png(&preview(&site, &newcomer, pose.inverse(), 300)).expect("a picture");
    assert_eq!(picture.width.max(picture.height), 300, "as large as asked for");
    let n_white = picture.grey.iter().map(|&grey| u32::from(grey == 255)).sum::<u32>();
    assert!(500 < n_white, "{n_white} pixels are free by both");
    let nothing = Grid::new(GridFrame::new(0.05).expect("a length"));
    let empty = read_png(&preview(&nothing, &nothing, pose, 300)).expect("a picture");
    assert!(0 < empty.width, "nothing is a picture too");
}
