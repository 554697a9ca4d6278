//! An office floor whose doors are closed and opened by lot while people walk about and a robot goes from room to
//! room: which doors are found, and what else is taken for one (T98, section 2.4, on Schneider 1994).

use anyhow::Context;
use meetpoint_geometry::{Point2, Pose};
use meetpoint_occupancy::{BeamModel, Door, DoorParams, Grid, ScanMarks, doors};
use meetpoint_sim::{Building, ChaCha8Rng, Crowd, Laser, route};
use rand::{Rng, RngExt, SeedableRng};

/// Six rooms along a corridor, each with a door of a metre. A character is a quarter of a metre.
const FLOOR: &str = "
    ##################################################
    #...............#................#...............#
    #......A........#.......B........#.......C.......#
    #...............#................#...............#
    #...............#................#...............#
    #...............#................#...............#
    #...............#................#...............#
    #...............#................#...............#
    ######1111############2222#############3333#######
    #................................................#
    #................................................#
    #..G....................H.....................I..#
    #................................................#
    #................................................#
    #######4444###########5555############6666########
    #...............#................#...............#
    #...............#................#...............#
    #...............#................#...............#
    #...............#................#...............#
    #......D........#.......E........#.......F.......#
    #...............#................#...............#
    #...............#................#...............#
    ##################################################";
/// Edge of a character, in metres.
const CHARACTER_M: f64 = 0.25;
/// Edge of a cell, in metres.
const RESOLUTION_M: f64 = 0.05;
const DOORS: [char; 6] = ['1', '2', '3', '4', '5', '6'];
/// Each door changes with this chance whenever the robot sets out.
const CHANGE_SHARE: f64 = 0.15;
/// Times that the robot sets out.
const N_TRIPS: usize = 150;
/// A scan is drawn every so many points of the path, which are 0.05 m apart: every half metre, as the mapper does.
const N_POINTS_PER_SCAN: usize = 10;
/// What that takes at half a metre a second.
const STEP_S: f64 = 1.0;
/// How far the poses of a good map are off: at most, in metres and radians.
const POSE_ERROR: (f64, f64) = (0.03, 0.01);
/// What is found this near to a door is it, in metres.
const NEAR_M: f64 = 0.4;

/// A floor, a map of it, and who is there.
struct Floor {
    building: Building,
    crowd: Crowd,
    grid: Grid,
    marks: ScanMarks,
    rng: ChaCha8Rng,
    stamp_ns: i64,
    /// How often each door changed.
    n_changes: [u32; 6],
    is_closed: [bool; 6],
}

/// Prints a table with a row for every floor.
pub(super) fn print() -> anyhow::Result<()> {
    println!(
        "| seed | people | minutes | doors changed, each | found of 6 | told that they changed, each | open or \
         closed rightly told | taken for doors besides | cells remembered |"
    );
    println!("|{}", "---|".repeat(9));
    for (seed, n_people) in [(1, 0), (2, 0), (3, 6), (4, 6), (5, 12), (6, 12)] {
        let mut floor = Floor::new(seed, n_people)?;
        for _ in 0..N_TRIPS {
            floor.trip()?;
        }
        floor.look_at_all()?;
        floor.row(seed, n_people);
    }
    Ok(())
}

impl Floor {
    fn new(seed: u64, n_people: usize) -> anyhow::Result<Self> {
        let building = Building::from_drawing(FLOOR, CHARACTER_M)?;
        let frame = meetpoint_geometry::GridFrame::new(RESOLUTION_M)
            .map_err(|_| anyhow::anyhow!("no length"))?;
        let crowd = Crowd::new(&building, n_people, seed);
        Ok(Self {
            building,
            crowd,
            grid: Grid::new(frame),
            marks: ScanMarks::new(),
            rng: ChaCha8Rng::seed_from_u64(seed),
            stamp_ns: 0,
            n_changes: [0; 6],
            is_closed: [false; 6],
        })
    }

    /// Somebody closes or opens doors; the robot goes from the corridor into a room that is open, and back. Doors
    /// stay as they are while it does.
    fn trip(&mut self) -> anyhow::Result<()> {
        for (at, name) in DOORS.into_iter().enumerate() {
            if self.rng.random::<f64>() < CHANGE_SHARE {
                self.is_closed[at] = !self.is_closed[at];
                self.n_changes[at] += 1;
                self.building.set_door(name, self.is_closed[at]);
            }
        }
        let pick = |rng: &mut ChaCha8Rng, names: &str| {
            let at = rng.random_range(0..names.len());
            names.chars().nth(at).and_then(|name| self.building.place(name))
        };
        let room = pick(&mut self.rng, "ABCDEF").context("a room")?;
        let [from, to] = [(); 2].map(|()| pick(&mut self.rng, "GHI"));
        let (from, to) = from.zip(to).context("ends of the corridor")?;
        let by_room = route(&self.building, &[from, room, to], 0.35);
        let path = by_room.or_else(|| route(&self.building, &[from, to], 0.35));
        self.drive(&path.context("a way along the corridor")?);
        Ok(())
    }

    /// Once along the corridor and back, so that all doors were seen as they are.
    fn look_at_all(&mut self) -> anyhow::Result<()> {
        let ends = self.building.places("GIGI").context("ends of the corridor")?;
        let path = route(&self.building, &ends, 0.35).context("a way along the corridor")?;
        self.drive(&path);
        Ok(())
    }

    fn drive(&mut self, path: &[Point2<f64>]) {
        let laser = Laser::INDOOR;
        let geometry = laser.geometry();
        for pair in path.windows(2).step_by(N_POINTS_PER_SCAN) {
            self.crowd.walk(&self.building, STEP_S);
            self.building.set_people(self.crowd.people());
            let step = pair[1] - pair[0];
            let robot = Pose::new(pair[0].x, pair[0].y, step.y.atan2(step.x));
            let scan = laser.scan(&self.building, robot, &mut self.rng);
            let believed = robot * pose_error(&mut self.rng) * laser.robot_from_laser;
            let model = BeamModel::INDOOR;
            self.grid.insert_scan(believed, &geometry, &scan, &model, &mut self.marks);
            self.grid.remember(self.stamp_ns, &self.marks);
            self.stamp_ns += 1_000_000_000;
        }
    }

    fn row(&self, seed: u64, n_people: usize) {
        let found = doors(&self.grid, &DoorParams::INDOOR);
        let truths = DOORS.map(|name| self.middle(name));
        let is_near = |door: &Door, truth: &Point2<f64>| (door.position - truth).norm() < NEAR_M;
        let by_truth = truths.map(|truth| found.iter().find(|door| is_near(door, &truth)));
        let is_other = |door: &&Door| !truths.iter().any(|truth| is_near(door, truth));
        let n_right = by_truth
            .iter()
            .zip(self.is_closed)
            .filter(|(found, is_closed)| found.is_some_and(|door| door.is_closed == *is_closed));
        let mean =
            |numbers: &[u32]| f64::from(numbers.iter().sum::<u32>()) / numbers.len().max(1) as f64;
        let told: Vec<u32> = by_truth.iter().flatten().map(|door| door.n_changes).collect();
        let n_remembered: usize = self.grid.tiles().map(|(_, tile)| tile.histories().count()).sum();
        println!(
            "| {seed} | {n_people} | {} | {:.1} | {} | {:.1} | {} | {} | {n_remembered} |",
            self.stamp_ns / 60_000_000_000,
            mean(&self.n_changes),
            told.len(),
            mean(&told),
            n_right.count(),
            found.iter().filter(is_other).count(),
        );
    }

    /// Middle of a door, in metres.
    fn middle(&self, name: char) -> Point2<f64> {
        let frame = self.building.info().frame;
        let cells = self.building.door(name);
        let sum =
            cells.iter().fold(Point2::origin(), |sum, &cell| sum + frame.center_of(cell).coords);
        sum / cells.len().max(1) as f64
    }
}

fn pose_error(rng: &mut impl Rng) -> Pose {
    let mut error = |most: f64| most * (2.0 * rng.random::<f64>() - 1.0);
    Pose::new(error(POSE_ERROR.0), error(POSE_ERROR.0), error(POSE_ERROR.1))
}
