//! NX told step by step, as a service tells it: all that is known of its motions is its odometry.

use meetpoint_geometry::Pose;
use meetpoint_places::PlaceId;
use meetpoint_places::qualitative::{
    Command, Explorer, ExplorerParams, ExplorerState, Firing, Guide, GuideParams, Stop,
};
use meetpoint_places::{
    Assumptions, Gateway, Hypothesis, MapTree, MapTreeParams, Observation, PlaceMap, Step, Travel,
    World, is_isomorphic,
};
use meetpoint_sim::{ChaCha8Rng, Nx, NxSenses, OdometryError, nx_worlds};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};

/// Firings after which an exploration counts as not complete.
const N_FIRINGS_MAX: u64 = 100_000;

/// How far a robot goes of what it is told before it fires.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Gait {
    /// All of it.
    Steps,
    /// Half of what is left, however short, and now and then it stands and fires.
    Halves,
}

/// Explores a world: what guided it, and whether the graph found is the true one.
fn guided(name: &str, params: ExplorerParams, gait: Gait) -> (Guide, bool) {
    let worlds = nx_worlds();
    let world = worlds.iter().find(|world| world.name == name).expect("an environment");
    let senses = NxSenses {
        range_error: 0.05,
        odometry_error: OdometryError::UNCALIBRATED,
        has_compass: params.heading_error.is_compass(),
    };
    let mut nx = Nx::new(&world.building, world.start, senses, ChaCha8Rng::seed_from_u64(3));
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let mut guide = Guide::new(Explorer::new(params), GuideParams::WHEELS);
    let mut odometry = Pose::new(0.0, 0.0, nx.heading_rad());
    while guide.n_firings() < N_FIRINGS_MAX {
        guide.take_in(&Firing {
            ranges_m: nx.ranges_m(),
            odometry_from_robot: odometry,
            sees_home: false,
        });
        let share = if gait == Gait::Steps { 1.0 } else { 0.5 };
        match guide.next() {
            Command::Done => break,
            Command::Look => nx.look(),
            _ if gait == Gait::Halves && rng.random_bool(0.1) => nx.look(),
            Command::Turn { by_rad } => nx.turn(share * by_rad),
            Command::Move { by_m } => {
                nx.advance(share * by_m);
                let (sin, cos) = nx.heading_rad().sin_cos();
                let moved_m = by_m.signum() * nx.moved_m();
                odometry.x_m += moved_m * cos;
                odometry.y_m += moved_m * sin;
            }
        }
        odometry = Pose::new(odometry.x_m, odometry.y_m, nx.heading_rad());
    }
    let truth = World::from_drawing(world.graph).expect("a graph");
    let is_true = guide.explorer().state() == ExplorerState::Complete
        && is_isomorphic(guide.explorer().graph().map(), truth.map());
    (guide, is_true)
}

#[test]
fn it_finds_the_true_graph() {
    for name in ["tee and ends", "two loops", "hall in a loop"] {
        let (guide, is_true) = guided(name, ExplorerParams::NX, Gait::Steps);
        assert!(is_true, "{name}: {} firings", guide.n_firings());
    }
}

/// A map that is told by its places and edges is the same map; one that cannot be is none.
#[test]
fn what_it_found_can_be_told() {
    let (guide, _) = guided("two loops", ExplorerParams::NX, Gait::Steps);
    let graph = guide.explorer().graph();
    let ids = graph.map().places().map(|(id, _)| id);
    let places: Vec<Observation> =
        ids.map(|place| graph.map().observation(Gateway { place, index: 0 })).collect();
    let mut edges: Vec<[Gateway; 2]> = graph.edges().iter().map(|edge| edge.ends).collect();
    let told = PlaceMap::joined(&places, &edges).expect("places and edges");
    assert!(is_isomorphic(&told, graph.map()), "the same graph");
    edges.push(edges[0]);
    assert_eq!(PlaceMap::joined(&places, &edges), None, "a gateway leads to one place");
    assert_eq!(PlaceMap::joined(&places[1..], &edges), None, "a place is missing");
}

/// The travel of an explorer, as its arrivals say it.
fn travel(guide: &Guide) -> Travel {
    let stops = guide.explorer().itinerary().stops();
    let (first, others) = stops.split_first().expect("a first place");
    let step = |stop: &Stop| Step { turn: stop.turn, seen: stop.seen.clone() };
    Travel { first: first.seen.clone(), steps: others.iter().map(step).collect() }
}

/// All maps that fit its arrivals: the true one is among them, whatever the explorer made of them.
#[test]
fn the_true_map_fits_its_travel_with_a_compass_and_without() {
    for (name, params) in [
        ("block", ExplorerParams::NX),
        ("two loops", ExplorerParams::NX),
        ("two loops", ExplorerParams::NX_WITHOUT_COMPASS),
        ("streets", ExplorerParams::NX_WITHOUT_COMPASS),
    ] {
        let (guide, _) = guided(name, params, Gait::Steps);
        let travel = travel(&guide);
        let assumptions = Assumptions::HSSH_2004_PLANAR;
        let params = MapTreeParams { assumptions, n_hypotheses_max: 300 };
        let tree = MapTree::of_travel(params, &travel).expect("turns to gateways that are there");
        let found = guide.explorer().graph().map();
        let is_true = |map: &Hypothesis| is_isomorphic(&map.map, found);
        let rank = tree.hypotheses().iter().position(is_true);
        println!("{name}: {travel}: {} maps, {rank:?}", tree.hypotheses().len());
        assert!(rank.is_some(), "{name}: {travel}");
        let stops = &guide.explorer().itinerary().stops()[1..];
        let is_measured =
            |stop: &Stop| stop.record.moved.is_some() && stop.record.length_m.is_some();
        assert!(stops.iter().all(is_measured), "{name}: {stops:?}");
    }
}

#[test]
fn it_may_fire_as_it_likes() {
    let (guide, is_true) = guided("two loops", ExplorerParams::NX, Gait::Halves);
    assert!(is_true, "the true graph");
    assert!(guide.n_steps() < guide.n_firings(), "steps were not done at once");
}

#[test]
fn without_a_compass_too() {
    let (_, is_true) = guided("streets", ExplorerParams::NX_WITHOUT_COMPASS, Gait::Steps);
    assert!(is_true, "the true graph");
}

#[test]
fn what_it_has_before_it_is_told() {
    let (guide, _) = guided("tee and ends", ExplorerParams::NX, Gait::Steps);
    let outlook = guide.explorer().outlook().expect("it fired");
    assert!(outlook.measures.lateral_m < 6.0, "between walls: {:?}", outlook.measures);
    assert_eq!(outlook.ring.heading_rad(0), outlook.heading_rad, "from where it looks");
    assert_eq!(guide.explorer().rehearsing(), None, "nothing is left to be tested");
}

/// Readings of sixteen cones from nothing heard to nothing there, as a service takes them in.
fn any_ring() -> impl Strategy<Value = Vec<f64>> {
    let range_m =
        prop_oneof![4 => 0.0..8.0_f64, 1 => Just(0.0), 1 => Just(f64::INFINITY), 1 => 1.0..1.2_f64];
    prop::collection::vec(range_m, 16)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Whatever a robot sends, whatever it does of what it is told, and whatever people mark: it is told a
    /// motion of a length, and all that can be asked is answered.
    #[test]
    fn whatever_it_hears_it_is_told_a_motion(
        rings in prop::collection::vec(any_ring(), 1..12),
        sent in prop::collection::vec((0..12_usize, 0..8_u8, -1.0e5..1.0e5_f64, any::<bool>()), 1..400),
        has_compass in any::<bool>(),
    ) {
        let params = if has_compass { ExplorerParams::NX } else { ExplorerParams::NX_WITHOUT_COMPASS };
        let mut guide = Guide::new(Explorer::new(params), GuideParams::WHEELS);
        let mut odometry = Pose::IDENTITY;
        for (ring, does, far, sees_home) in sent {
            odometry = match (does, guide.next()) {
                (0, _) => Pose::new(far, -far, far),
                (2.., Command::Turn { by_rad }) => odometry * Pose::new(0.0, 0.0, by_rad),
                (2.., Command::Move { by_m }) => odometry * Pose::new(by_m, 0.0, 0.0),
                (1, _) | (2.., Command::Look | Command::Done) => odometry,
            };
            let ranges_m = &rings[ring % rings.len()][..];
            guide.take_in(&Firing { ranges_m, odometry_from_robot: odometry, sees_home });
            if does == 2 {
                guide.explorer_mut().mark_home(PlaceId(u32::from(does)), sees_home);
            }
            let is_motion = match guide.next() {
                Command::Turn { by_rad } => by_rad.is_finite(),
                Command::Move { by_m } => by_m.is_finite(),
                Command::Look | Command::Done => true,
            };
            prop_assert!(is_motion, "{:?}", guide.next());
        }
        let explorer = guide.explorer();
        prop_assert!(explorer.outlook().is_some(), "it fired");
        let n_places = explorer.graph().map().n_places();
        prop_assert!(explorer.graph().edges().iter().all(|edge| {
            edge.ends.iter().all(|end| (end.place.0 as usize) < n_places)
        }), "edges join places that are there");
    }
}
