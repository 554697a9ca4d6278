//! Maps that were made elsewhere: imported once, and mapped on.

use meetpoint_client::v1;

use crate::door::{Door, FIRST_PAGE, eventually, finished, refused};
use crate::drive::{SimulatedDrive, driven, opened, opening, send};
use crate::running::{Launch, empty_folder, meetpoint};

/// Mean distance from the truth that a trajectory may have on an imported map, in metres: a cell.
const ERROR_MAX_M: f64 = 0.05;

/// The YAML of a map of 0.1 m a cell whose lower-left corner is there.
fn yaml(origin: &str) -> String {
    format!(
        "image: room.pgm\nresolution: 0.1\norigin: {origin}\nnegate: 0\noccupied_thresh: 0.65\n\
         free_thresh: 0.196\n"
    )
}

/// A PGM of a drawing, top row first: `#` occupied, `.` free, else unknown.
pub(crate) fn pgm(drawing: &[&str]) -> Vec<u8> {
    let (width, height) = (drawing[0].len(), drawing.len());
    let grey = |symbol| match symbol {
        '#' => 0,
        '.' => 254,
        _ => 205,
    };
    let pixels = drawing.iter().flat_map(|row| row.chars().map(grey));
    format!("P5\n{width} {height}\n255\n").into_bytes().into_iter().chain(pixels).collect()
}

/// Pixels that the header of a binary PGM promises.
fn pgm_pixels(image: &[u8]) -> usize {
    let head = String::from_utf8_lossy(&image[..40]).into_owned();
    let numbers = head.split_whitespace().skip(1).take(2).map(str::parse::<usize>);
    numbers.map(|n| n.expect("a width and a height")).product()
}

const ROOM: [&str; 3] = ["####__", "#..#__", "####__"];

async fn a_map_is_imported_once<D: Door>(door: &D) {
    let (text, image) = (yaml("[-1.0, 0.52, 0.0]"), pgm(&ROOM));
    let made = door.import("attic", &text, &image).await.expect("a good map");
    assert_eq!((made.map_version, made.already_imported), (1, false), "{made:?}");
    let map = made.map.as_ref().expect("the map is told");
    assert_eq!((map.resolution_m, map.published_version), (0.1, 1), "made on the way: {map:?}");
    let cells = made.cells.expect("its cells are told");
    assert_eq!((cells.width, cells.height), (6, 3), "{cells:?}");
    assert_eq!((cells.free, cells.occupied, cells.unknown), (2, 10, 6), "{cells:?}");
    assert!((cells.shift_y_m + 0.02).abs() < 1e-9, "onto the lattice: {cells:?}");
    assert_eq!(made.warnings.len(), 1, "which is told: {made:?}");
    let version = door.version("attic", 0).await.expect("it is published");
    assert_eq!((version.origin.as_str(), version.number), ("import", 1), "{version:?}");
    assert_eq!(version.journal_position, made.journal_position, "{version:?}");
    let grid = door.grid("attic", 0, None).await.expect("a grid");
    let origin = grid.origin.expect("it has an origin");
    assert_eq!((origin.x_m, origin.y_m, grid.width), (-1.0, 0.5, 4), "what is known: {grid:?}");
    let row = [88, 88, 88, 88, 88, 12, 12, 88, 88, 88, 88, 88];
    assert_eq!(grid.cells, row, "lowest row first, as sure as 88 %");

    let again = door.import("attic", &text, &image).await.expect("the same again");
    let expected = v1::ImportMapResponse { already_imported: true, ..made };
    assert_eq!(again, expected, "the same answer");
    let (versions, _) = door.versions("attic", FIRST_PAGE).await.expect("versions");
    assert_eq!(versions.len(), 1, "no second version: {versions:?}");
    let other = pgm(&["###", "#.#", "###"]);
    refused(door.import("attic", &text, &other).await, "MAP_NOT_EMPTY");
}

async fn what_is_no_map_is_refused<D: Door>(door: &D) {
    let image = pgm(&ROOM);
    for (origin, resolution, field) in [
        ("[0, 0]", "0.1", "yaml"),
        ("[0, 0, 0]", "0.001", "yaml.resolution"),
        ("[1e9, 0, 0]", "0.1", "yaml.origin"),
    ] {
        let text = yaml(origin).replace("0.1\n", &format!("{resolution}\n"));
        let wrong = refused(door.import("cellar", &text, &image).await, "INVALID_FIELD");
        assert_eq!(wrong.fact("field"), field, "{wrong:?}");
    }
    let good = yaml("[0, 0, 0]");
    for wrong in [&b""[..], b"GIF89a", b"P5\n4 4\n255\n...", &pgm(&["__", "__"])] {
        let wrong = refused(door.import("cellar", &good, wrong).await, "INVALID_FIELD");
        assert_eq!(wrong.fact("field"), "image", "{wrong:?}");
    }
    let huge = b"P5\n100000 100000\n255\n";
    let huge = refused(door.import("cellar", &good, huge).await, "MAP_TOO_LARGE");
    assert_eq!(huge.fact("limit_cells"), "16777216", "{huge:?}");
    let long = vec![0; 1_100_000];
    let long = refused(door.import("cellar", &good, &long).await, "MESSAGE_TOO_LARGE");
    assert_eq!(long.fact("limit_bytes"), "1000000", "{long:?}");
    refused(door.import("No Id", &good, &image).await, "INVALID_FIELD");
    refused(door.map("cellar").await, "MAP_NOT_FOUND");
    door.create_map("cellar", 0.05).await.expect("nothing was made");
    let coarse = refused(door.import("cellar", &good, &image).await, "INVALID_FIELD");
    assert_eq!(coarse.fact("field"), "yaml.resolution", "the map has others: {coarse:?}");
}

async fn all<D: Door>(door: &D) {
    a_map_is_imported_once(door).await;
    what_is_no_map_is_refused(door).await;
}

/// Few bytes, so that too many are quickly made.
fn launch(data: &std::path::Path) -> Launch {
    Launch::at(data).setting("limits.import_bytes_max", 1_000_000)
}

#[tokio::test(flavor = "multi_thread")]
async fn over_grpc() {
    let data = empty_folder();
    let service = launch(data.path()).start();
    all(&service.grpc()).await;
    let headless =
        v1::ImportMapRequest { kind: Some(v1::import_map_request::Kind::Image(b"P5".to_vec())) };
    let refusal = service.grpc().maps.import_map(tokio_stream::iter([headless])).await;
    let refusal = crate::door::Refused::from(refusal.expect_err("the head is first"));
    assert_eq!(refusal.code, "INVALID_FIELD", "{refusal:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn over_rest() {
    let data = empty_folder();
    let service = launch(data.path()).start();
    all(&service.rest()).await;
    let map = "cellar";
    let form = |kind: &str, body: &str| {
        let headers = [("content-type", kind)];
        let path = format!("/v1/maps/{map}/imports");
        service.http().post_with(&path, &headers, body.as_bytes()).problem()["code"].clone()
    };
    assert_eq!(form("application/json", "{}"), "UNSUPPORTED_MEDIA_TYPE", "no form");
    let kind = "multipart/form-data; boundary=x";
    assert_eq!(form(kind, "no form"), "MALFORMED_BODY", "not what it says");
    let part = "--x\r\ncontent-disposition: form-data; name=\"paint\"\r\n\r\nred\r\n--x--\r\n";
    assert_eq!(form(kind, part), "MALFORMED_BODY", "not a part of it");
    assert_eq!(form(kind, &part.replace("paint", "yaml")), "INVALID_FIELD", "no image");
}

/// What one robot mapped, another finds its way on, after a crash too; and all of it comes out of
/// the journal again.
#[tokio::test(flavor = "multi_thread")]
async fn robots_go_on_where_a_map_was_imported() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    let drive = SimulatedDrive::through_the_hall(3);
    let batches = drive.batches(20);
    let first = driven(&service.grpc(), "hall", &drive, &batches).await;
    finished(&service.grpc(), &first).await;
    let (map, http) = ("hall", service.http());
    let file = |format| http.get(&format!("/v1/maps/{map}/grid?format={format}"));
    let (text, image) = (file("yaml").text(), file("pgm").body);
    let made = service.grpc().import("copy", &text, &image).await.expect("our own map");
    assert_eq!(made.warnings, Vec::<String>::new(), "nothing to tell");
    let cells = made.cells.expect("its cells are told");
    let pixels = &image[image.len() - pgm_pixels(&image)..];
    let count = |grey: u8| pixels.iter().map(|&pixel| u64::from(pixel == grey)).sum::<u64>();
    assert_eq!(
        (cells.free, cells.occupied),
        (count(254), count(0)),
        "what is exported is imported"
    );
    service.kill();

    let service = Launch::at(data.path()).start();
    let door = service.grpc();
    let request = opening("copy", "second", std::slice::from_ref(&drive.sensor));
    let session = opened(&door, request).await;
    send(&door, &session, &batches).await;
    let session = finished(&door, &session).await;
    assert!(!session.lost, "it knows where it is");
    let request = v1::GetTrajectoryRequest { session: session.id, ..Default::default() };
    let (found, _) = door.trajectory(request).await.expect("it is mapped");
    let (error_m, odometry_m) = drive.mean_errors_m(&found);
    assert!(error_m < ERROR_MAX_M, "{error_m} m; odometry alone {odometry_m} m");
    assert!(door.import("copy", &text, &image).await.expect("as before").already_imported, "kept");
    refused(door.import("hall", &text, &image).await, "MAP_NOT_EMPTY");

    let before = door.grid("copy", 0, None).await.expect("a grid");
    let job = door.create_job("copy").await.expect("a job");
    let done = eventually("the job's end", || async {
        let now = door.job(&job.id).await.expect("it was made");
        now.done.then_some(now)
    })
    .await;
    let rebuilt = door.grid("copy", done.result_version, None).await.expect("a grid");
    assert!(before.map_version < rebuilt.map_version, "a new version: {done:?}");
    assert!(before.cells == rebuilt.cells, "from the journal, to the last bit");
}

#[test]
fn by_the_command() {
    let (data, maps) = (empty_folder(), empty_folder());
    let service = Launch::at(data.path()).start();
    let path = maps.path().join("The Attic.yaml");
    std::fs::write(&path, yaml("[0, 0, 3.14]")).expect("a writable folder");
    let run = |arguments: &[&str]| {
        let (file, url) = (path.to_str().expect("plain text"), service.url());
        let all = [&["map", "import", file, "--server", &url], arguments].concat();
        let done = meetpoint(&all).output().expect("the binary under test starts");
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        (done.status.code(), text(&done.stdout), text(&done.stderr))
    };
    let (status, _, told) = run(&[]);
    assert_eq!(status, Some(1), "the image is missing");
    assert!(told.contains("cannot read the image") && told.contains("room.pgm"), "{told}");
    std::fs::write(maps.path().join("room.pgm"), pgm(&ROOM)).expect("a writable folder");
    let (status, told, warned) = run(&[]);
    assert_eq!(status, Some(0), "{warned}");
    assert!(told.starts_with("map the-attic, version 1: 6 x 3 cells of 0.1 m from"), "{told}");
    assert!(warned.contains("warning: the origin's heading of 3.14 rad"), "{warned}");
    let (status, told, _) = run(&["--json"]);
    let told: serde_json::Value = serde_json::from_str(&told).expect("JSON");
    assert_eq!((status, &told["already_imported"]), (Some(0), &true.into()), "{told}");
    let (status, told, _) = run(&["--map", "loft"]);
    assert_eq!(status, Some(0), "under another name");
    assert!(told.starts_with("map loft, version 1"), "{told}");
}
