//! A map grows from what a robot sends, and is given out in every form.

use meetpoint_client::v1;
use meetpoint_geometry::Pose;
use serde_json::Value;

use crate::door::{Door, FIRST_PAGE, Page, finished, refused};
use crate::drive::{LASER, Odometry, SimulatedDrive, driven};
use crate::http::{Http, Reply};
use crate::running::{Launch, Running, empty_folder};

/// Mean distance from the truth that a trajectory may have in the hall, in metres: a cell.
const ERROR_MAX_M: f64 = 0.05;

async fn trajectory<D: Door>(door: &D, session: &str, frame: &str) -> v1::Trajectory {
    let request = v1::GetTrajectoryRequest {
        session: session.to_owned(),
        frame: frame.to_owned(),
        ..Default::default()
    };
    let (trajectory, next) = door.trajectory(request).await.expect("it is mapped");
    assert_eq!(next, 0, "it fits on a page");
    trajectory
}

/// The session ends up mapped, published, and nearer to the truth than its odometry.
async fn a_drive_is_mapped<D: Door>(door: &D, odometry: Odometry) -> v1::Session {
    let drive = SimulatedDrive::through_the_hall(3);
    let batches = drive.batches_with(20, odometry);
    let session = driven(door, "hall", &drive, &batches).await;
    let session = finished(door, &session).await;
    assert_eq!(session.acked_through, batches.len() as u64, "all is kept");
    assert_eq!(session.mapped_through, session.acked_through, "all is mapped");
    assert_eq!(session.scans, drive.n_scans() as u64, "every scan counts");
    assert!(!session.lost, "the tracker knows where the robot is");
    let stamps = (session.first_time_ns, session.last_time_ns);
    let first_and_last = [drive.ticks.first(), drive.ticks.last()];
    let [first, last] = first_and_last.map(|tick| tick.map(|tick| tick.stamp_ns));
    assert_eq!(stamps, (first, last), "the robot's clock");
    let found = trajectory(door, &session.id, "").await;
    assert_eq!((found.frame.as_str(), found.reference_frame.as_str()), ("robot", "map"), "frames");
    assert_eq!(found.origin, i32::from(v1::TrajectoryOrigin::Tracking), "by matching");
    assert!(found.poses.iter().all(|pose| !pose.lost && pose.sensor_id == LASER), "all trusted");
    let (error_m, odometry_m) = drive.mean_errors_m(&found);
    assert!(error_m < ERROR_MAX_M, "{error_m} m; odometry alone {odometry_m} m");
    let map = door.map("hall").await.expect("it was made");
    assert_eq!(map.published_version, map.latest_version, "published by itself");
    assert!(session.complete_in_version <= map.latest_version, "{session:?} {map:?}");
    session
}

async fn poses_by_pages_and_frames<D: Door>(door: &D, session: &v1::Session) {
    let robot = trajectory(door, &session.id, "robot").await;
    let laser = trajectory(door, &session.id, LASER).await;
    let robot_from_laser = Pose::new(0.1, 0.0, 0.0);
    for (robot, laser) in robot.poses.iter().zip(&laser.poses) {
        let [robot, laser] = [robot, laser].map(|pose| {
            let v1::Pose { x_m, y_m, theta_rad } = pose.pose.expect("it is there");
            Pose::new(x_m, y_m, theta_rad)
        });
        let off_m = laser.step_to(robot * robot_from_laser).distance_m();
        assert!(off_m < 1e-9, "the laser sits on the robot, {off_m} m off");
    }
    let (mut paged, mut offset) = (Vec::new(), 0);
    loop {
        let request = v1::GetTrajectoryRequest {
            session: session.id.clone(),
            offset,
            page_size: 100,
            ..Default::default()
        };
        let (page, next) = door.trajectory(request).await.expect("a page");
        paged.extend(page.poses);
        if next == 0 {
            break;
        }
        assert_eq!(next, offset + 100, "page by page");
        offset = next;
    }
    assert!(paged == robot.poses, "pages are the whole");
}

async fn versions_are_immutable_and_published<D: Door>(door: &D) {
    let (versions, _) = door.versions("hall", FIRST_PAGE).await.expect("versions");
    let numbers: Vec<u64> = versions.iter().map(|version| version.number).collect();
    let newest = numbers[0];
    assert!(numbers.iter().copied().eq((1..=newest).rev()), "newest first, no gaps: {numbers:?}");
    assert!(2 < newest, "several snapshots");
    let published: Vec<u64> =
        versions.iter().filter(|version| version.published).map(|v| v.number).collect();
    assert_eq!(published, [newest], "one pointer");
    let (page, token) = door.versions("hall", Page(2, "")).await.expect("a page");
    assert_eq!(page, versions[..2], "two newest");
    let (page, _) = door.versions("hall", Page(1, &token)).await.expect("a page");
    assert_eq!(page, versions[2..3], "the next");
    assert_eq!(door.version("hall", 0).await.as_ref(), Ok(&versions[0]), "0 is the published one");
    let extent = versions[0].bounding_box.expect("something was observed");
    assert!(5.0 < extent.max_x_m - extent.min_x_m, "a room of 8 m by 6 m: {extent:?}");

    let first = door.grid("hall", 1, None).await.expect("a grid");
    let last = door.grid("hall", 0, None).await.expect("a grid");
    assert_eq!((first.map_version, last.map_version), (1, newest), "the version is named");
    assert!(first.cells != last.cells, "the map grew");
    let n_cells = last.width as usize * last.height as usize;
    assert_eq!(last.cells.len(), n_cells, "a byte a cell");
    let count = |range: std::ops::RangeInclusive<u8>| {
        last.cells.iter().filter(|cell| range.contains(cell)).count()
    };
    assert!(n_cells / 4 < count(0..=30), "most of the hall is free");
    assert!(200 < count(70..=100), "its walls are seen");
    assert_eq!(count(101..=254), 0, "nothing between certain and never observed");
}

async fn rectangles<D: Door>(door: &D) {
    let corner = v1::BoundingBox { min_x_m: -1.0, min_y_m: -0.5, max_x_m: 1.0, max_y_m: 0.5 };
    let part = door.grid("hall", 0, Some(corner)).await.expect("a part");
    assert!((40..=42).contains(&part.width), "2 m in cells of 5 cm: {}", part.width);
    assert!((20..=22).contains(&part.height), "1 m in cells of 5 cm: {}", part.height);
    let turned = v1::BoundingBox { min_x_m: 1.0, max_x_m: -1.0, ..corner };
    refused(door.grid("hall", 0, Some(turned)).await, "INVALID_FIELD");
    let huge = v1::BoundingBox { min_x_m: -900.0, min_y_m: -900.0, max_x_m: 900.0, max_y_m: 900.0 };
    let huge = refused(door.grid("hall", 0, Some(huge)).await, "GRID_TOO_LARGE");
    assert_eq!(huge.fact("limit_cells"), "16777216", "{huge:?}");
    refused(door.grid("hall", 999, None).await, "VERSION_NOT_FOUND");
}

/// While the pointer is back, versions are made and not published; the newest resumes that.
async fn the_pointer_stays_where_a_person_put_it<D: Door>(door: &D) {
    let newest = door.map("hall").await.expect("it was made").latest_version;
    let back = door.publish("hall", 1).await.expect("rolled back");
    assert_eq!((back.published_version, back.publishes_automatically), (1, false), "{back:?}");
    let grid = door.grid("hall", 0, None).await.expect("a grid");
    assert_eq!(grid.map_version, 1, "queries are answered from it");
    let drive = SimulatedDrive::through_the_hall(5);
    let opening = v1::OpenSessionRequest {
        client_key: "second".into(),
        // The service counts.
        epoch: 0,
        ..crate::drive::opening("hall", "rover", std::slice::from_ref(&drive.sensor))
    };
    let session = crate::drive::opened(door, opening).await;
    crate::drive::send(door, &session, &drive.batches(20)[..10]).await;
    let session = finished(door, &session).await;
    assert!(newest < session.complete_in_version, "a newer version was made");
    let map = door.map("hall").await.expect("it was made");
    assert_eq!(map.published_version, 1, "and not published: {map:?}");
    let forward = door.publish("hall", map.latest_version).await.expect("the newest");
    assert!(forward.publishes_automatically, "publishing the newest resumes it: {forward:?}");
    assert_eq!(forward.published_version, forward.latest_version, "{forward:?}");
}

async fn a_map<D: Door>(door: &D) -> v1::Session {
    let session = a_drive_is_mapped(door, Odometry::Poses).await;
    poses_by_pages_and_frames(door, &session).await;
    versions_are_immutable_and_published(door).await;
    rectangles(door).await;
    session
}

/// Versions often enough that a short drive has several.
fn started(data: &std::path::Path) -> Running {
    Launch::at(data).setting("mapping.snapshot_scans", 60).start()
}

#[tokio::test(flavor = "multi_thread")]
async fn over_grpc() {
    let data = empty_folder();
    let service = started(data.path());
    a_map(&service.grpc()).await;
    the_pointer_stays_where_a_person_put_it(&service.grpc()).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn over_rest() {
    let data = empty_folder();
    let service = started(data.path());
    let session = a_map(&service.rest()).await;
    pictures(&service.http());
    entity_tags(&service.http());
    tiles(&service.http());
    tum(&service.http(), &session.id, &trajectory(&service.grpc(), &session.id, "").await);
    both_doors_say_the_same(&service, &session.id).await;
    the_pointer_stays_where_a_person_put_it(&service.rest()).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn from_velocities() {
    let data = empty_folder();
    let service = started(data.path());
    a_drive_is_mapped(&service.grpc(), Odometry::Velocities).await;
}

async fn both_doors_say_the_same(service: &Running, session: &str) {
    let (grpc, rest) = (service.grpc(), service.rest());
    assert_eq!(grpc.map("hall").await, rest.map("hall").await, "the map");
    assert!(grpc.grid("hall", 0, None).await == rest.grid("hall", 0, None).await, "the grid");
    let without_sensors =
        v1::Session { sensors: Vec::new(), ..grpc.session(session).await.expect("it was opened") };
    assert_eq!(Ok(without_sensors), rest.session(session).await, "the session");
    let paths = [trajectory(&grpc, session, "").await, trajectory(&rest, session, "").await];
    assert!(paths[0] == paths[1], "the trajectory, to the last bit");
}

fn picture(http: &Http, format: &str) -> Reply {
    let map = "hall";
    let reply = http.get(&format!("/v1/maps/{map}/grid?format={format}"));
    assert_eq!(reply.status, 200, "{}", reply.text());
    let disposition = reply.header("content-disposition");
    assert!(disposition.contains(&format!("hall.{format}")), "{disposition}");
    reply
}

/// PNG, PGM with YAML, NPY: the same cells as the JSON says.
fn pictures(http: &Http) {
    let json = picture(http, "json").json();
    let (width, height) = (json["width"].to_string(), json["height"].to_string());
    let png = picture(http, "png");
    assert_eq!(png.header("content-type"), "image/png", "by its type");
    assert_eq!(&png.body[..8], b"\x89PNG\r\n\x1a\n", "by its signature");
    let side = |at: usize| u32::from_be_bytes(png.body[at..at + 4].try_into().expect("4 bytes"));
    assert_eq!(
        (side(16).to_string(), side(20).to_string()),
        (width.clone(), height.clone()),
        "IHDR"
    );
    for (name, value) in [
        ("meetpoint-map-version", &json["map_version"]),
        ("meetpoint-cost-revision", &json["cost_revision"]),
        ("meetpoint-resolution-m", &json["resolution_m"]),
        ("meetpoint-origin-x-m", &json["origin"]["x_m"]),
        ("meetpoint-origin-y-m", &json["origin"]["y_m"]),
    ] {
        let told: f64 = png.header(name).parse().unwrap_or_else(|_| panic!("no {name}"));
        assert_eq!(Some(told), value.as_f64(), "{name}");
    }
    let pgm = picture(http, "pgm");
    let text = String::from_utf8_lossy(&pgm.body[..200]).into_owned();
    let head: Vec<&str> = text
        .lines()
        .filter(|line| !line.starts_with('#'))
        .flat_map(str::split_whitespace)
        .take(4)
        .collect();
    assert_eq!(head, ["P5", &width, &height, "255"], "a PGM of that size");
    let yaml = picture(http, "yaml").text();
    for line in ["image: hall.pgm", "resolution: 0.05", "negate: 0", "origin: ["] {
        assert!(yaml.contains(line), "no `{line}` in {yaml}");
    }
    let npy = picture(http, "npy");
    assert_eq!(&npy.body[..6], b"\x93NUMPY", "by its signature");
    let head = String::from_utf8_lossy(&npy.body[..128]).into_owned();
    assert!(head.contains(&format!("'shape': ({height}, {width})")), "{head}");
    let cells = json["cells"].as_array().map_or(0, Vec::len);
    assert_eq!((npy.body.len() - 4 * cells) % 64, 0, "a header and a float a cell");
}

/// A client that has an answer does not get it again.
fn entity_tags(http: &Http) {
    let (map, version) = ("hall", "1");
    for (path, cached) in [
        (format!("/v1/maps/{map}/grid?format=png"), "no-cache"),
        (format!("/v1/maps/{map}/grid?format=png&version={version}"), "immutable"),
    ] {
        let reply = http.get(&path);
        let tag = reply.header("etag").to_owned();
        assert!(tag.starts_with('"'), "a strong tag: {tag}");
        assert!(reply.header("cache-control").contains(cached), "{cached}: {:?}", reply.headers);
        let known = http.get_with(&path, &[("if-none-match", &tag)]);
        assert_eq!((known.status, known.body.len()), (304, 0), "{path} is known");
        let other = http.get_with(&path, &[("if-none-match", "\"something else\"")]);
        assert_eq!((other.status, &other.body), (200, &reply.body), "{path} is not known");
    }
}

fn tiles(http: &Http) {
    let (map, version, z, x, y) = ("hall", "latest", 0, 0, 0);
    let path = format!("/v1/maps/{map}/versions/{version}/tiles/{z}/{x}/{y}.png");
    let tile = http.get(&path);
    assert_eq!((tile.status, tile.header("content-type")), (200, "image/png"), "{}", tile.text());
    let side = u32::from_be_bytes(tile.body[16..20].try_into().expect("4 bytes"));
    assert_eq!(side, 256, "of 256 pixels");
    let known = http.get_with(&path, &[("if-none-match", tile.header("etag"))]);
    assert_eq!(known.status, 304, "it is known");
    for wrong in ["9/0/0.png", "0/0/0.jpg", "0/0/0", "0/x/0.png", "-1/0/0.png"] {
        let reply = http.get(&format!("/v1/maps/{map}/versions/{version}/tiles/{wrong}"));
        assert_eq!(reply.status, 400, "{wrong}: {}", reply.text());
        reply.problem();
    }
}

fn tum(http: &Http, session: &str, trajectory: &v1::Trajectory) {
    let reply = http.get(&format!("/v1/sessions/{session}/trajectory?format=tum"));
    assert_eq!(reply.status, 200, "{}", reply.text());
    let text = reply.text();
    let lines: Vec<&str> = text.lines().filter(|line| !line.starts_with('#')).collect();
    assert_eq!(lines.len(), trajectory.poses.len(), "a line a pose");
    for (line, pose) in lines.iter().zip(&trajectory.poses) {
        let fields: Vec<&str> = line.split(' ').collect();
        let stamp = Stamp(pose.stamp_ns).to_string();
        assert_eq!((fields.len(), fields[0]), (8, stamp.as_str()), "t x y z qx qy qz qw: {line}");
        let at = pose.pose.expect("it is there");
        assert_eq!(fields[1].parse(), Ok(at.x_m), "x of {line}");
        assert_eq!(fields[2].parse(), Ok(at.y_m), "y of {line}");
    }
    let json: Value = http.get(&format!("/v1/sessions/{session}/trajectory?format=json")).json();
    assert_eq!(json["reference_frame"], "map", "the frame is named");
}

/// Nanoseconds as seconds with all nine decimals.
struct Stamp(i64);

impl std::fmt::Display for Stamp {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}.{:09}", self.0 / 1_000_000_000, self.0 % 1_000_000_000)
    }
}
