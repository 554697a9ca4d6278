//! Whole environments, explored.

use meetpoint_geometry::angle_between;
use meetpoint_places::qualitative::{
    Command, Explorer, ExplorerParams, ExplorerState, Readings, SelectionRule, Whereabouts,
};
use meetpoint_sim::{ChaCha8Rng, NxDrive, NxExplored, NxWorld, nx_worlds, nx_worlds_of};
use rand::{RngExt, SeedableRng};

const DRIVE: NxDrive =
    NxDrive { params: ExplorerParams::NX, range_error: 0.0, has_home: false, seed: 1 };

fn world(name: &str) -> NxWorld {
    nx_worlds().into_iter().find(|world| world.name == name).expect("an environment")
}

fn explored(name: &str, params: ExplorerParams, range_error: f64, seed: u64) -> NxExplored {
    let drive = NxDrive { params, range_error, has_home: false, seed };
    drive.explore(&world(name), |_, _, _| {})
}

#[test]
fn every_environment_has_its_graph() {
    let worlds = nx_worlds();
    assert!(10 <= worlds.len(), "{} environments", worlds.len());
    for world in worlds {
        let graph = world.truth();
        let n_open = graph.map().gateways().filter(|&at| graph.map().leads_to(at).is_none());
        assert_eq!(n_open.count(), 0, "{}: all ways lead somewhere", world.name);
    }
}

#[test]
fn environments_are_explored_completely() {
    for name in ["tee and ends", "two loops", "hall in a loop", "twin wings"] {
        for (range_error, seed) in [(0.0, 1), (0.05, 2), (0.05, 3)] {
            let run = explored(name, ExplorerParams::NX, range_error, seed);
            assert!(run.explored.is_complete, "{name}, {range_error}: complete");
            assert!(run.is_true, "{name}, {range_error}: the true graph");
            assert!(run.explored.n_steps < run.explored.n_firings, "it also stands and listens");
            assert!(run.way_m < 400.0, "{name}: {} m", run.way_m);
        }
    }
}

#[test]
fn corridors_may_be_wider_or_narrower_than_it_was_told() {
    for width_m in [1.7, 2.6] {
        let worlds = nx_worlds_of(width_m).expect("a length");
        let world = worlds.iter().find(|world| world.name == "two loops").expect("a world");
        let run = NxDrive { range_error: 0.05, ..DRIVE }.explore(world, |_, _, _| {});
        assert!(run.is_true, "{width_m} m: the true graph");
    }
}

#[test]
fn without_a_compass_too() {
    let run = explored("streets", ExplorerParams::NX_WITHOUT_COMPASS, 0.05, 1);
    assert!(run.is_true, "the true graph");
    assert!(0 < run.explored.explorer.n_rehearsals(), "loops were closed");
}

/// Explores a crossing, and says for each direction that was chosen at a place that it had just found
/// how far the robot had to turn to it, and to the others that it could have chosen.
fn rotations(selection: SelectionRule) -> Vec<(f64, Vec<f64>)> {
    let params = ExplorerParams { selection, ..ExplorerParams::NX };
    let (mut stood, mut chosen) = (None, Vec::new());
    let drive = NxDrive { params, ..DRIVE };
    let run = drive.explore(&world("crossing"), |explorer, _, _| match explorer.whereabouts() {
        Whereabouts::AtPlace { came_by, heading_rad } => {
            stood.get_or_insert((came_by, heading_rad));
        }
        Whereabouts::OnEdge { since: Some(left), .. } => {
            let Some((came_by, heading_rad)) = stood.take() else { return };
            let known = explorer.graph().place(came_by.place).expect("a known place");
            let directions = &known.seen.directions;
            if left.place != came_by.place || directions.len() < 3 {
                return;
            }
            let rotation_rad =
                |index: usize| angle_between(heading_rad, directions[index].heading_rad).abs();
            let left_by = usize::from(left.index);
            let open = explorer.graph().agenda().filter(|at| at.place == left.place);
            let others = open.map(|at| usize::from(at.index)).filter(|&at| at != left_by);
            chosen.push((rotation_rad(left_by), others.map(rotation_rad).collect()));
        }
        _ => {}
    });
    assert!(run.is_true, "{selection:?}: the true graph");
    chosen
}

#[test]
fn selection_rules_choose_by_rotation() {
    for (selection, sign) in
        [(SelectionRule::LeastRotation, 1.0), (SelectionRule::MostRotation, -1.0)]
    {
        let chosen = rotations(selection);
        assert_eq!(chosen.len(), 3, "three ways on from the crossing");
        for (rotation_rad, others) in chosen {
            // Directions are seen anew on every arrival, a little otherwise.
            let is_first = |&other_rad: &f64| sign * rotation_rad < sign * other_rad + 0.3;
            assert!(others.iter().all(is_first), "{selection:?}: {rotation_rad} of {others:?}");
        }
    }
}

/// What tells places apart when dead reckoning does not.
fn without_positions(n_rehearsal_edges_max: usize) -> ExplorerParams {
    ExplorerParams { drift_share: f64::INFINITY, n_rehearsal_edges_max, ..ExplorerParams::NX }
}

#[test]
fn rehearsals_tell_places_apart_that_look_alike() {
    let hasty = explored("ladder", without_positions(0), 0.05, 4);
    assert!(!hasty.is_true, "one junction of the ladder is taken for another");
    let careful = explored("ladder", without_positions(2), 0.05, 4);
    assert!(0 < careful.explored.explorer.n_refuted(), "some are found not to be the place");
    assert!(careful.is_true, "the true graph");
}

#[test]
fn home_is_told_from_all_that_look_like_it() {
    let drive = NxDrive { params: without_positions(1), range_error: 0.05, ..DRIVE };
    let unmarked = drive.explore(&world("comb"), |_, _, _| {});
    assert!(!unmarked.is_true, "one tooth of the comb is taken for another");
    let marked = NxDrive { has_home: true, ..drive }.explore(&world("comb"), |_, _, _| {});
    let graph = marked.explored.explorer.graph();
    let at_home = graph
        .map()
        .places()
        .filter(|&(id, _)| graph.place(id).is_some_and(|known| known.seen.is_home));
    assert_eq!(at_home.count(), 1, "one place is home");
    assert!(marked.is_true, "the true graph");
}

#[test]
fn it_knows_where_it_is() {
    let (mut n_at_places, mut n_on_edges, mut n_in_question) = (0, 0, 0);
    let run = DRIVE.explore(&world("block"), |explorer, _, _| match explorer.whereabouts() {
        Whereabouts::AtPlace { .. } => n_at_places += 1,
        Whereabouts::OnEdge { since, .. } => {
            n_on_edges += 1;
            let is_first = explorer.state() == ExplorerState::Starting;
            assert_eq!(since.is_none(), is_first, "since a place, once there is one");
        }
        Whereabouts::InQuestion { .. } => n_in_question += 1,
    });
    assert!(4 <= n_at_places, "{n_at_places} at places");
    assert!(100 < n_on_edges, "{n_on_edges} on edges");
    assert!(50 < n_in_question, "{n_in_question} while it tests whether it is back");
    assert_eq!(run.explored.explorer.n_rehearsals(), 1, "one ring is closed");
    let measured = run.explored.explorer.graph().edges().iter().map(|edge| edge.length_m.n);
    assert_eq!(measured.clone().sum::<u32>(), 4, "each edge was explored once");
}

#[test]
fn nothing_is_done_without_readings() {
    let mut explorer = Explorer::new(ExplorerParams::NX);
    let deaf = Readings { ranges_m: &[], heading_rad: 0.0, moved_m: 0.0, sees_home: false };
    assert_eq!(explorer.next(&deaf), Command::Look, "wait for sonars");
    assert_eq!(explorer.next(&deaf), Command::Look, "wait for sonars");
}

/// Whatever a robot says, and however many sonars it says that it has, it is told something to do.
#[test]
fn nonsense_is_answered() {
    for seed in 0..40 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut explorer = Explorer::new(ExplorerParams::NX_WITHOUT_COMPASS);
        for _ in 0..500 {
            let n_sonars = if rng.random_bool(0.9) { 16 * seed } else { rng.random_range(0..200) };
            let range_m = |_| match rng.random_range(0..20) {
                0 => f64::NAN,
                1 => f64::INFINITY,
                2 => f64::NEG_INFINITY,
                _ => rng.random_range(0.5..4.0),
            };
            let ranges_m: Vec<f64> = (0..n_sonars).map(range_m).collect();
            let heading_rad = if rng.random_bool(0.01) { f64::NAN } else { rng.random() };
            let moved_m = rng.random_range(0.0..0.3);
            let sees_home = rng.random();
            let readings = Readings { ranges_m: &ranges_m, heading_rad, moved_m, sees_home };
            if let Command::Move { by_m } = explorer.next(&readings) {
                assert!(by_m.abs() < 0.26, "{by_m} m is no small step");
            }
        }
    }
}
