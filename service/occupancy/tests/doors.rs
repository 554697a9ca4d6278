//! Doors told from what changed for good, from people, and from noise.

use meetpoint_geometry::{GridFrame, Point2, Pose};
use meetpoint_occupancy::{BeamModel, Door, DoorParams, Grid, ScanMarks, Tile, doors};
use meetpoint_sim::{Building, ChaCha8Rng, Laser, Person, route};
use rand::{RngExt, SeedableRng};

/// Two rooms; a door of a metre between them is 1, one of 0.75 m is 2, and 3 is a wall that will be moved to 4.
/// A character is a quarter of a metre.
const ROOMS: &str = "
    ########################################
    #..................#...................#
    #.A..............B.1.C...............D.#
    #..................1...................#
    #..................1...................#
    #..................1...................#
    #..................#...................#
    #.......3333.......#...................#
    #..................#...................#
    #.......4444.......2...................#
    #..................2...................#
    #.F..............E.2.G...............H.#
    #..................#...................#
    ########################################";
/// Scans are drawn every so many points of the path, which are 0.05 m apart: the mapper draws every half metre.
const N_POINTS_PER_SCAN: usize = 10;
/// What a robot drives in that time, at half a metre a second.
const STEP_NS: i64 = 1_000_000_000;
/// How far the poses of a good map are off, in metres and radians, at most.
const POSE_ERROR: (f64, f64) = (0.03, 0.01);

/// A map on which somebody drives.
struct Mapped {
    building: Building,
    grid: Grid,
    stamp_ns: i64,
    rng: ChaCha8Rng,
    marks: ScanMarks,
}

impl Mapped {
    fn new() -> Self {
        let mut building = Building::from_drawing(ROOMS, 0.25).expect("a drawing");
        assert!(building.set_door('3', true), "it is drawn");
        let grid = Grid::new(GridFrame::new(0.05).expect("a length"));
        let rng = ChaCha8Rng::seed_from_u64(7);
        Self { building, grid, stamp_ns: 1_000_000_000_000, rng, marks: ScanMarks::new() }
    }

    /// Drives by way of these places, to each of which there is a way; a person stands where this says in the
    /// second that it is asked about, or nobody.
    fn drive(&mut self, places: &str, person_at: impl Fn(i64) -> Option<Point2<f64>>) {
        let places = self.building.places(places).expect("drawn places");
        let path = route(&self.building, &places, 0.35).expect("a way");
        let laser = Laser::INDOOR;
        let geometry = laser.geometry();
        for pair in path.windows(2).step_by(N_POINTS_PER_SCAN) {
            let step = pair[1] - pair[0];
            let robot = Pose::new(pair[0].x, pair[0].y, step.y.atan2(step.x));
            let there = person_at(self.stamp_ns / STEP_NS);
            let person = there.map(|position| Person { position, radius_m: Person::RADIUS_M });
            self.building.set_people(person.into_iter().collect());
            let scan = laser.scan(&self.building, robot, &mut self.rng);
            let mut error = |most: f64| most * (2.0 * self.rng.random::<f64>() - 1.0);
            let (x_m, y_m, theta_rad) =
                (error(POSE_ERROR.0), error(POSE_ERROR.0), error(POSE_ERROR.1));
            let believed = robot * Pose::new(x_m, y_m, theta_rad) * laser.robot_from_laser;
            let marks = &mut self.marks;
            self.grid.insert_scan(believed, &geometry, &scan, &BeamModel::INDOOR, marks);
            self.grid.remember(self.stamp_ns, marks);
            self.stamp_ns += STEP_NS;
        }
    }

    fn doors(&self) -> Vec<Door> {
        doors(&self.grid, &DoorParams::INDOOR)
    }

    /// Both sides of the doors while they are open, then both rooms by somebody who stays in each.
    fn close_and_open(&mut self, name: char, n_times: usize) {
        for _ in 0..n_times {
            self.drive("AEFBAEFB", |_| None);
            assert!(self.building.set_door(name, true), "it is drawn");
            self.drive("BAEFBAEFB", |_| None);
            assert!(self.building.set_door(name, false), "it is drawn");
        }
        self.drive("BAEFBCHGDCB", |_| None);
    }
}

fn nobody(_: i64) -> Option<Point2<f64>> {
    None
}

#[test]
fn a_door_that_is_closed_and_opened_five_times() {
    let mut mapped = Mapped::new();
    mapped.drive("ABCDHGCBEFA", nobody);
    assert_eq!(mapped.doors(), [], "nothing changed");
    mapped.close_and_open('1', 5);
    let [door] = &mapped.doors()[..] else { panic!("one door: {:?}", mapped.doors()) };
    assert!((door.position - Point2::new(4.9, 2.5)).norm() < 0.3, "where it is drawn: {door:?}");
    assert!((8..=10).contains(&door.n_changes), "five times closed, five times opened: {door:?}");
    assert!(!door.is_closed && (0.2..0.6).contains(&door.closed_share), "{door:?}");
    assert!(0.6 < door.autocorrelation && 0.15 < door.variance, "{door:?}");
    let height = door.high.y - door.low.y + 1;
    assert!((12..=20).contains(&height) && door.high.x - door.low.x < 6, "a metre: {door:?}");
    let before = *door;

    mapped.building.set_door('1', true);
    mapped.drive("BAEFBAEFB", nobody);
    mapped.building.set_door('2', true);
    mapped.building.set_door('1', false);
    mapped.drive("BAEFBCHGDCB", nobody);
    mapped.close_and_open('2', 3);
    let [first, second] = &mapped.doors()[..] else { panic!("two doors: {:?}", mapped.doors()) };
    assert_eq!(first.oldest, before.oldest, "the same door");
    assert!(
        before.n_changes < first.n_changes && before.changed_ns < first.changed_ns,
        "{first:?}"
    );
    assert!(first.changed_ns < second.changed_ns, "the other was closed later: {second:?}");
}

#[test]
fn a_closed_door_is_told_as_such() {
    let mut mapped = Mapped::new();
    mapped.drive("ABCDHGCBEFA", nobody);
    mapped.close_and_open('1', 3);
    mapped.building.set_door('1', true);
    mapped.drive("BAEFBAEFB", nobody);
    let [door] = &mapped.doors()[..] else { panic!("one door: {:?}", mapped.doors()) };
    assert!(door.is_closed, "{door:?}");
}

#[test]
fn a_wall_that_is_moved_is_no_door() {
    let mut mapped = Mapped::new();
    for _ in 0..3 {
        mapped.drive("ABEFAEBFA", nobody);
    }
    mapped.building.set_door('3', false);
    mapped.building.set_door('4', true);
    for _ in 0..6 {
        mapped.drive("ABEFAEBFA", nobody);
    }
    assert_eq!(mapped.doors(), [], "it changed once");
}

#[test]
fn people_and_edges_of_walls_are_no_doors() {
    let mut mapped = Mapped::new();
    let walking = |second: i64| {
        // To and fro before the robot, a metre a second, with two seconds' rest at each end.
        let along_m = f64::from(i32::try_from(second % 20).expect("small"));
        let x_m = if along_m < 10.0 { along_m.min(8.0) } else { (18.0 - along_m).max(0.0) };
        (second % 3 != 0).then_some(Point2::new(0.6 + 0.4 * x_m, 1.1))
    };
    for _ in 0..20 {
        mapped.drive("ABCDHGCBEFA", walking);
    }
    let n_remembered: usize = mapped.grid.tiles().map(|(_, tile)| tile.histories().count()).sum();
    assert!(100 < n_remembered, "{n_remembered} cells were both hit and free");
    assert_eq!(mapped.doors(), [], "noise");
}

#[test]
fn a_stored_map_remembers() {
    let mut mapped = Mapped::new();
    mapped.drive("ABCDHGCBEFA", nobody);
    mapped.close_and_open('1', 2);
    let tiles = mapped.grid.tiles().map(|(index, tile)| {
        (index, Tile::from_bytes(&tile.to_bytes()).expect("our own bytes").into())
    });
    mapped.grid = Grid::from_tiles(mapped.grid.frame(), tiles.collect::<Vec<_>>());
    let mut other = Mapped::new();
    other.drive("ABCDHGCBEFA", nobody);
    other.close_and_open('1', 2);
    mapped.close_and_open('1', 2);
    other.close_and_open('1', 2);
    assert!(!mapped.doors().is_empty(), "a door");
    assert_eq!(mapped.doors(), other.doors(), "as if it had not been stored");
}
