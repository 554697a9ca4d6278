//! Maps of places: robots that are driven by them, people who decide about them, restarts in between.

use meetpoint_client::v1;
use meetpoint_places::{Gateway, Observation, PlaceId, View, World};
use v1::ingest_batch_request::Kind as Upload;
use v1::observation::Kind;

use crate::door::{Door, job_done, refused};
use crate::drive::{SECOND_NS, START_NS, observation, opened, opening};
use crate::place_door::PlaceDoor;
use crate::running::{Launch, Running, empty_folder, meetpoint};

const MAP: &str = "floor";
/// Robots that are not done after so many travels never will be.
const N_TRAVELS_MAX: u32 = 100;
/// Travels after which the service is killed.
const KILLS: [u32; 3] = [5, 14, 22];

/// Corners, junctions and a crossing in nested loops; A is home.
const LOOPS: &str = "
    A---B---C
    |   |   |
    D---E---F
    |   |   |
    G---H---I";

/// Two side streets that look alike: the robot that went from A to D and up again came to one of them.
const SIDE_STREETS: &str = "
    X---A---B---C
        |   |   |
        Y   +---D";

/// A robot that has nothing but eyes for places.
struct Walker {
    session: v1::Session,
    world: World,
    at: Gateway,
    home: Option<PlaceId>,
    n_batches: u64,
    n_visits: u32,
    /// Places where it was.
    visited: Vec<PlaceId>,
}

impl Walker {
    async fn new<D: Door>(door: &D, robot: &str, drawing: &str, at: char) -> Self {
        let world = World::from_drawing(drawing).expect("a drawing");
        let place = world.place_named(at).expect("a place that is drawn");
        let session = opened(door, opening(MAP, robot, &[])).await;
        let at = Gateway { place, index: 0 };
        Self { session, world, at, home: None, n_batches: 0, n_visits: 0, visited: Vec::new() }
    }

    fn seen(&self) -> Observation {
        let view = self.home.map(|home| View {
            name: if self.at.place == home { "home" } else { "elsewhere" }.to_owned(),
            is_unique: self.at.place == home,
        });
        Observation { view, ..self.world.map().observation(self.at) }
    }

    /// What it tells of where it is, having come there by that turn.
    fn visit(&self, turn: u32) -> v1::PlaceVisit {
        let Observation { star, view } = self.seen();
        v1::PlaceVisit {
            number: self.n_visits,
            turn,
            star: star.to_string(),
            view: view.as_ref().map(|view| view.name.clone()).unwrap_or_default(),
            view_is_unique: view.is_some_and(|view| view.is_unique),
            length_m: (0 < self.n_visits).then_some(3.0),
            turned_rad: None,
            moved: None,
        }
    }

    async fn tell<D: Door>(&mut self, door: &D, visits: &[v1::PlaceVisit]) -> v1::Ack {
        self.n_batches += 1;
        let stamp_ns = START_NS + i64::try_from(self.n_batches).expect("few") * SECOND_NS;
        let told = visits.iter().cloned();
        let observations =
            told.map(|visit| observation(stamp_ns, "", Kind::PlaceVisit(visit))).collect();
        let batch = v1::Batch { number: self.n_batches, observations };
        let sent = door.upload(&self.session.id, self.session.epoch, Upload::Batch(batch)).await;
        sent.expect("a good batch")
    }

    /// Tells where it is.
    async fn arrive<D: Door>(&mut self, door: &D, turn: u32) {
        let ack = self.tell(door, &[self.visit(turn)]).await;
        assert_eq!(ack.rejected, [], "nothing is wrong with it");
        self.n_visits += 1;
        self.visited.push(self.at.place);
    }

    /// Goes out through a gateway to the next place.
    async fn walk<D: Door>(&mut self, door: &D, turn: u32) {
        let left = self.world.map().turned(self.at, u8::try_from(turn).expect("a gateway"));
        self.at = self.world.map().leads_to(left).expect("every way leads somewhere");
        self.arrive(door, turn).await;
    }

    /// Goes from place to place as their names are written, from where it is.
    async fn walk_along<D: Door>(&mut self, door: &D, route: &str) {
        let (_, turns) = self.world.turns(route).expect("a route");
        self.arrive(door, 0).await;
        for turn in turns {
            self.walk(door, turn.into()).await;
        }
    }

    fn tree(&self) -> v1::TreeName {
        let (map, session) = (MAP.to_owned(), self.session.id.clone());
        v1::TreeName { map, session, planar: true, circles: false, metrical: false }
    }

    /// The places where it was as a map that is true numbers them.
    fn true_visits(&self) -> Vec<u32> {
        let mut known: Vec<PlaceId> = Vec::new();
        let mut number = |place: &PlaceId| {
            let index = known.iter().position(|other| other == place).unwrap_or_else(|| {
                known.push(*place);
                known.len() - 1
            });
            u32::try_from(index).expect("few places")
        };
        self.visited.iter().map(&mut number).collect()
    }
}

fn all_of(tree: &v1::TreeName) -> v1::ListHypothesesRequest {
    let tree = Some(tree.clone());
    v1::ListHypothesesRequest { tree, page_size: 0, page_token: String::new() }
}

async fn listed<D: PlaceDoor>(door: &D, tree: &v1::TreeName) -> v1::ListHypothesesResponse {
    door.hypotheses(all_of(tree)).await.expect("a travel that was told of")
}

/// Closed loop over gRPC until nothing is left to do, killed in between: one simplest map, which is true.
#[tokio::test(flavor = "multi_thread")]
async fn a_robot_is_driven_until_one_map_is_left() {
    let data = empty_folder();
    let mut service = Launch::at(data.path()).start();
    let mut door = service.grpc();
    door.create_map(MAP, 0.05).await.expect("a new map");
    let mut walker = Walker::new(&door, "rover", LOOPS, 'A').await;
    let tree = walker.tree();
    refused(door.next_travel(&tree, v1::TravelSelection::Unspecified).await, "NOTHING_TRAVELLED");
    walker.home = Some(walker.at.place);
    walker.arrive(&door, 0).await;
    let (mut n_rehearsed, mut n_explored) = (0, 0);
    loop {
        let next = door.next_travel(&tree, v1::TravelSelection::LeastRotation).await;
        let next = next.expect("a travel that was told of");
        let known = next.tree.as_ref().expect("the tree as it is");
        assert_eq!(known.visits, walker.n_visits, "all of them are in it: {next:?}");
        match next.errand() {
            v1::TravelErrand::Explored => break,
            v1::TravelErrand::Explore => n_explored += 1,
            v1::TravelErrand::Rehearse | v1::TravelErrand::Confirm => n_rehearsed += 1,
            other => panic!("{other:?}: {next:?}"),
        }
        walker.walk(&door, next.turns[0]).await;
        assert!(walker.n_visits < N_TRAVELS_MAX, "an end: {known:?}");
        if KILLS.contains(&walker.n_visits) {
            let before = listed(&door, &tree).await;
            service.kill();
            service = Launch::at(data.path()).start();
            door = service.grpc();
            assert_eq!(listed(&door, &tree).await, before, "the same from the journal");
        }
    }
    assert!(0 < n_rehearsed && 0 < n_explored, "{n_rehearsed} rehearsals, {n_explored} new ways");
    let all = listed(&door, &tree).await;
    let known = all.tree.clone().expect("the tree as it is");
    assert_eq!((known.minimal, known.truncated), (1, false), "{known:?}");
    let simplest = &all.hypotheses[0];
    assert!(simplest.minimal && simplest.rank == 1, "{simplest:?}");
    let size = (simplest.places, simplest.edges, simplest.paths, simplest.unexplored);
    assert_eq!(size, (9, 12, 6, 0), "the whole floor: {simplest:?}");
    assert_eq!(simplest.visits, walker.true_visits(), "the true map");

    let rest = service.rest();
    assert_eq!(listed(&rest, &tree).await, all, "the same over REST");
    let detail = door.hypothesis(&tree, "").await.expect("the simplest");
    assert_eq!(rest.hypothesis(&tree, &simplest.id).await, Ok(detail.clone()), "by its id");
    assert_eq!((detail.places.len(), &detail.agenda[..]), (9, &[][..]), "all of it");
    assert_eq!(detail.places[0].view, "home", "{detail:?}");
    assert!(
        detail.paths.len() == 6 && detail.paths.iter().all(|path| path.places.len() == 3),
        "{detail:?}"
    );
    let lengths = detail.places.iter().flat_map(|place| &place.gateways).map(|way| way.length_m);
    assert!(lengths.into_iter().all(|length_m| length_m == Some(3.0)), "{detail:?}");
    for drawing in [door.drawing(&tree, "").await, rest.drawing(&tree, &simplest.id).await] {
        assert!(drawing.expect("a drawing").starts_with(b"\x89PNG"), "a PNG");
    }
    routes(&door, &rest, &tree, &walker).await;
    told_on_the_command_line(&service, simplest);
}

/// The same printed, as JSON, and as a drawing.
fn told_on_the_command_line(service: &Running, simplest: &v1::Hypothesis) {
    let folder = empty_folder();
    let (url, drawing) = (service.url(), folder.path().join("map.png"));
    let path = drawing.to_str().expect("a plain path");
    let asked = ["hypotheses", "--map", MAP, "--planar", "--server", &url];
    let told = meetpoint(&asked).args(["--png", path]).output().expect("the binary runs");
    let text = String::from_utf8_lossy(&told.stdout);
    assert!(told.status.success(), "{}", String::from_utf8_lossy(&told.stderr));
    assert!(text.contains("of these simplest: 1;") && text.contains(&simplest.id), "{text}");
    let bytes = std::fs::read(&drawing).expect("it was saved");
    assert!(bytes.starts_with(b"\x89PNG"), "a PNG");
    let told = meetpoint(&asked).arg("--json").output().expect("the binary runs");
    let body: serde_json::Value = serde_json::from_slice(&told.stdout).expect("JSON");
    assert_eq!(body["hypotheses"][0]["id"], simplest.id.as_str(), "{body}");
    let nowhere = ["hypotheses", "--map", "attic", "--server", &url];
    let refused = meetpoint(&nowhere).output().expect("the binary runs");
    assert_eq!(refused.status.code(), Some(1), "not done: {refused:?}");
}

/// Ways along the true map of the loops.
async fn routes(
    door: &impl PlaceDoor,
    rest: &impl PlaceDoor,
    tree: &v1::TreeName,
    walker: &Walker,
) {
    let number = |name: char| {
        let place = walker.world.place_named(name).expect("a place that is drawn");
        let visit = walker.visited.iter().position(|&at| at == place).expect("it was there");
        walker.true_visits()[visit]
    };
    let request = |from: Option<char>, to: u32| v1::PlanTravelRequest {
        tree: Some(tree.clone()),
        hypothesis: String::new(),
        from_place: from.map(number),
        to_place: to,
    };
    let across = request(Some('A'), number('I'));
    let way = door.travel(across.clone()).await.expect("a good question");
    assert_eq!(rest.travel(across).await, Ok(way.clone()), "the same over REST");
    assert_eq!((way.code(), way.legs.len()), (v1::TravelPlanCode::Ok, 4), "{way:?}");
    assert_eq!(way.length_m, Some(12.0), "four ways of 3 m: {way:?}");
    assert!(way.legs.windows(2).all(|pair| pair[0].to_place == pair[1].place), "{way:?}");
    assert_eq!(way.legs.last().map(|leg| leg.to_place), Some(number('I')), "{way:?}");
    // From where the robot is, by the turns that are told.
    let home = door.travel(request(None, 0)).await.expect("a good question");
    let mut at = walker.at;
    for leg in &home.legs {
        let left = walker.world.map().turned(at, u8::try_from(leg.turn).expect("a gateway"));
        at = walker.world.map().leads_to(left).expect("every way leads somewhere");
    }
    assert_eq!(walker.world.name(at.place), Some('A'), "home: {home:?}");
    let nowhere = door.travel(request(None, 99)).await.expect("a good question");
    assert_eq!(nowhere.code(), v1::TravelPlanCode::PlaceUnknown, "{nowhere:?}");
    assert_eq!((nowhere.legs.len(), nowhere.length_m), (0, None), "{nowhere:?}");
}

/// Three maps fit; a person says which is true, the service is killed, and the person takes it back.
async fn people_decide<D: PlaceDoor>(launch: impl AsyncFn() -> D) {
    let door = launch().await;
    door.create_map(MAP, 0.05).await.expect("a new map");
    let mut walker = Walker::new(&door, "rover", SIDE_STREETS, 'A').await;
    let tree = v1::TreeName { planar: false, ..walker.tree() };
    walker.walk_along(&door, "ABCDB").await;
    let before = listed(&door, &tree).await;
    let known = before.tree.clone().expect("the tree as it is");
    assert_eq!((known.consistent, known.minimal, known.visits), (3, 2, 5), "{known:?}");
    let difference = before.difference.expect("there are several");
    assert_eq!(
        (difference.visit, difference.first_visit, difference.other_first_visit),
        (4, 0, 1),
        "A or B"
    );
    let decision = before.next_decision.clone().expect("something to try");
    assert_eq!(
        (&decision.turns[..], decision.expected.as_str()),
        (&[2][..], "aab"),
        "to the right"
    );
    let ids: Vec<&String> = before.hypotheses.iter().map(|map| &map.id).collect();
    assert_eq!([&decision.hypothesis, &decision.other_hypothesis], [ids[0], ids[1]], "which");
    let page = v1::ListHypothesesRequest { page_size: 2, ..all_of(&tree) };
    let first = door.hypotheses(page.clone()).await.expect("a page");
    let rest = v1::ListHypothesesRequest { page_token: first.next_page_token, ..page };
    let second = door.hypotheses(rest).await.expect("a page");
    assert_eq!([first.hypotheses, second.hypotheses].concat(), before.hypotheses, "by pages");
    assert_eq!(second.next_page_token, "", "the last page");

    let asserted = door.assert_true(&tree, ids[1]).await.expect("it fits");
    assert_eq!((asserted.consistent, asserted.ruled_out), (1, 2), "{asserted:?}");
    let [said] = &asserted.assertions[..] else { panic!("one: {asserted:?}") };
    assert_eq!((&said.hypothesis, said.in_force, said.visits), (ids[1], true, 5), "{said:?}");
    assert_eq!(said.author, "anna", "{said:?}");
    let again = door.assert_true(&tree, ids[1]).await;
    assert_eq!(again, Ok(asserted.clone()), "nothing changes");
    let by_other_assumptions = v1::TreeName { planar: true, circles: true, ..tree.clone() };
    let by_others = listed(&door, &by_other_assumptions).await;
    assert_eq!(by_others.hypotheses.len(), 1, "the same map, whatever else is assumed");
    assert_eq!(&by_others.hypotheses[0].id, ids[1], "by the same id");

    let door = launch().await;
    let after = listed(&door, &tree).await;
    assert_eq!(after.tree, Some(asserted), "it stays");
    assert_eq!((after.hypotheses.len(), &after.hypotheses[0].id), (1, ids[1]), "and so does it");
    let rebuilt = job_done(&door, &door.create_job(MAP).await.expect("a job").id).await;
    assert_eq!(rebuilt.state(), v1::JobState::Succeeded, "{rebuilt:?}");
    assert_eq!(listed(&door, &tree).await, after, "whatever is drawn again");
    refused(door.take_back(&tree, ids[0]).await, "HYPOTHESIS_NOT_ASSERTED");
    let undone = door.take_back(&tree, ids[1]).await.expect("it was asserted");
    assert_eq!(undone, known, "what it was");
    assert_eq!(listed(&door, &tree).await, before, "with the same maps");
    assert_eq!(door.take_back(&tree, ids[1]).await, Ok(undone), "nothing changes");

    // The robot goes on, and what was listed before can still be said.
    walker.walk(&door, 2).await;
    let late = door.assert_true(&tree, ids[1]).await.expect("it fits still");
    assert_eq!((late.visits, late.assertions[0].visits), (6, 5), "of an older visit");
    let is_true = &listed(&door, &tree).await.hypotheses[0];
    assert_eq!(is_true.visits, walker.true_visits(), "it went to C, which is a corner");
    refused(door.assert_true(&tree, ids[0]).await, "HYPOTHESIS_NOT_FOUND");
    refused(door.assert_true(&tree, "none").await, "HYPOTHESIS_NOT_FOUND");
    refused(door.hypothesis(&tree, ids[0]).await, "HYPOTHESIS_NOT_FOUND");
    door.take_back(&tree, "").await.expect("the last");
    refused(door.take_back(&tree, "").await, "HYPOTHESIS_NOT_ASSERTED");
}

#[tokio::test(flavor = "multi_thread")]
async fn people_decide_over_grpc() {
    let (data, running) = (empty_folder(), std::cell::RefCell::new(None));
    people_decide(async || {
        if let Some(before) = running.take() {
            Running::kill(before);
        }
        let service = Launch::at(data.path()).start();
        let door = service.grpc();
        running.replace(Some(service));
        door
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn people_decide_over_rest() {
    let (data, running) = (empty_folder(), std::cell::RefCell::new(None));
    people_decide(async || {
        if let Some(before) = running.take() {
            Running::kill(before);
        }
        let service = Launch::at(data.path()).start();
        let door = service.rest();
        running.replace(Some(service));
        door
    })
    .await;
}

/// What cannot be used is named, and can be told again.
async fn visits_are_judged<D: PlaceDoor>(door: D) {
    door.create_map(MAP, 0.05).await.expect("a new map");
    let nobody = v1::TreeName { map: MAP.to_owned(), ..Default::default() };
    refused(door.hypotheses(all_of(&nobody)).await, "NOTHING_TRAVELLED");
    let nowhere = v1::TreeName { map: "attic".to_owned(), ..Default::default() };
    refused(door.hypotheses(all_of(&nowhere)).await, "MAP_NOT_FOUND");
    let mut walker = Walker::new(&door, "rover", SIDE_STREETS, 'A').await;
    let good = walker.visit(0);
    let next =
        |star: &str| v1::PlaceVisit { star: star.into(), number: 1, turn: 1, ..good.clone() };
    let told = [
        good.clone(),
        next("aaa"),
        v1::PlaceVisit { turn: 40, ..next("aa") },
        v1::PlaceVisit { view: "x".repeat(65), ..next("aa") },
        v1::PlaceVisit { length_m: Some(-1.0), ..next("aa") },
    ];
    let ack = walker.tell(&door, &told).await;
    let codes: Vec<&str> = ack.rejected.iter().map(|rejection| rejection.code.as_str()).collect();
    assert_eq!(codes, ["INVALID_STAR", "OUT_OF_RANGE", "TOO_LONG", "OUT_OF_RANGE"], "{ack:?}");
    // One too far, one by a gateway that A does not have, the right one, and the same again.
    let told = [
        v1::PlaceVisit { number: 2, ..next("aa") },
        v1::PlaceVisit { turn: 7, ..next("aa") },
        next("aa"),
        next("aa"),
    ];
    let ack = walker.tell(&door, &told).await;
    assert_eq!(ack.rejected, [], "single visits are good");
    let known = listed(&door, &nobody).await.tree.expect("the tree as it is");
    assert_eq!((known.visits, known.visits_left_out), (2, 3), "{known:?}");
    assert_eq!(known.left_out_reason, "visit 1, where 2 was the next", "{known:?}");
    let session = known.name.map(|name| name.session);
    assert_eq!(session, Some(walker.session.id.clone()), "the only one that told of visits");
    // What was not seen before fits no map that has been there.
    let ack = walker.tell(&door, &[v1::PlaceVisit { number: 2, turn: 0, ..next("abab") }]).await;
    assert_eq!(ack.rejected, [], "it may be");
    let refuted = door.next_travel(&nobody, v1::TravelSelection::MostRotation).await;
    let refuted = refuted.expect("a travel that was told of");
    assert_eq!(refuted.errand(), v1::TravelErrand::Refuted, "{refuted:?}");
    assert_eq!(listed(&door, &nobody).await.hypotheses, [], "no map fits");
    let stranger = v1::TreeName { session: walker.session.robot.clone(), ..nobody.clone() };
    refused(door.hypotheses(all_of(&stranger)).await, "INVALID_FIELD");
    let unknown = "0199d3a6-6ac5-7c4e-9d51-2d9a3f1f3c11".to_owned();
    let stranger = v1::TreeName { session: unknown, ..nobody };
    refused(door.hypotheses(all_of(&stranger)).await, "SESSION_NOT_FOUND");
}

#[tokio::test(flavor = "multi_thread")]
async fn visits_are_judged_over_grpc() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    visits_are_judged(service.grpc()).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn visits_are_judged_over_rest() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    visits_are_judged(service.rest()).await;
}
