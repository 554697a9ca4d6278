//! The repository is as its style asks for: borders between crates, names, lengths, coverage of
//! the protocol by scenarios, documents that name what exists.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;

/// Crates that compute and know nothing of networks, databases or runtimes.
const PURE_CRATES: [&str; 9] = [
    "service/geometry",
    "service/occupancy",
    "service/tracking",
    "service/topology",
    "service/planning",
    "service/relaxation",
    "service/merging",
    "service/places",
    "service/sim",
];
/// What they must not know.
const IMPURE: [&str; 6] = ["tokio", "sqlx", "tonic", "axum", "hyper", "meetpoint-storage"];
/// File names that say nothing.
const FORBIDDEN_STEMS: [&str; 7] =
    ["util", "utils", "common", "helpers", "misc", "types", "manager"];
/// Lines of a file, at most. A ratchet: it may be lowered, not raised.
const N_LINES_MAX: usize = 460;
/// Folders of the repository that documents name files of.
const TOP_FOLDERS: [&str; 8] =
    ["proto", "service", "storage", "migrations", "clients", "tests", ".ci", ".cargo"];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn read(path: &str) -> String {
    fs::read_to_string(root().join(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// All files of the repository with that extension, but what was built.
fn files(extension: &str) -> Vec<PathBuf> {
    let (mut found, mut folders) = (Vec::new(), vec![root()]);
    while let Some(folder) = folders.pop() {
        let entries = fs::read_dir(&folder).expect("a folder of the repository");
        for path in entries.map(|entry| entry.expect("an entry").path()) {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            if path.is_dir() && name != "target" && name != ".git" {
                folders.push(path);
            } else if path.extension().is_some_and(|found| found == extension) {
                found.push(path);
            }
        }
    }
    assert!(!found.is_empty(), "no .{extension} files under {}", root().display());
    found
}

/// Names of all dependencies of a manifest, those of its tests too.
fn dependencies(manifest: &Path) -> Vec<String> {
    let text = fs::read_to_string(manifest).expect("a manifest");
    let manifest: toml::Table = text.parse().expect("a manifest is TOML");
    ["dependencies", "dev-dependencies", "build-dependencies"]
        .iter()
        .filter_map(|section| manifest.get(*section)?.as_table())
        .flat_map(|table| table.keys().cloned())
        .collect()
}

#[test]
fn pure_crates_know_arithmetic_only() {
    for name in PURE_CRATES {
        let found = dependencies(&root().join(name).join("Cargo.toml"));
        for impure in IMPURE {
            assert!(!found.iter().any(|found| found.starts_with(impure)), "{name}: {impure}");
        }
    }
}

#[test]
fn sql_stays_in_storage() {
    for manifest in files("toml").iter().filter(|path| path.ends_with("Cargo.toml")) {
        if dependencies(manifest).iter().any(|name| name == "sqlx") {
            let shown = manifest.display().to_string();
            assert!(manifest.ends_with("storage/Cargo.toml"), "{shown} names sqlx");
        }
    }
}

#[test]
fn files_are_named_after_a_noun_and_short() {
    for path in files("rs") {
        let (shown, stem) = (path.display(), path.file_stem().unwrap_or_default());
        let forbidden = FORBIDDEN_STEMS.iter().any(|name| stem == *name);
        assert!(!forbidden, "{shown}: a name that says nothing");
        let text = fs::read_to_string(&path).expect("a source file");
        let n_lines = text.lines().count();
        assert!(n_lines <= N_LINES_MAX, "{shown}: {n_lines} lines, at most {N_LINES_MAX}");
        let left_out = concat!("#[", "ignore");
        assert!(!text.contains(left_out), "{shown}: a test that is left out");
    }
}

/// The sources of the scenarios, one after the other.
fn scenarios() -> String {
    let folder = root().join("tests/service");
    let entries = fs::read_dir(folder).expect("the scenarios");
    let read = |entry: fs::DirEntry| fs::read_to_string(entry.path()).expect("a source file");
    entries.map(|entry| read(entry.expect("an entry"))).collect()
}

/// `CreateMap` becomes `create_map`.
fn snake_case(name: &str) -> String {
    let mut snake = String::new();
    for letter in name.chars() {
        if letter.is_ascii_uppercase() && !snake.is_empty() {
            snake.push('_');
        }
        snake.push(letter.to_ascii_lowercase());
    }
    snake
}

#[test]
fn every_rpc_is_called_by_a_scenario() {
    let scenarios = scenarios();
    let mut n_rpcs = 0;
    for path in files("proto") {
        let text = fs::read_to_string(&path).expect("a .proto file");
        for line in text.lines() {
            let Some(rpc) = line.trim().strip_prefix("rpc ") else { continue };
            let name = rpc.split('(').next().unwrap_or_default();
            n_rpcs += 1;
            let call = format!(".{}(", snake_case(name));
            assert!(scenarios.contains(&call), "no scenario calls {name}");
        }
    }
    assert!(20 < n_rpcs, "{n_rpcs} calls were found in the .proto files");
}

/// A text with `{anything}` as `{}`.
fn without_names(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    let mut is_inside = false;
    for letter in text.chars() {
        match letter {
            '{' => plain.push_str("{}"),
            '}' => {}
            letter if !is_inside => plain.push(letter),
            _ => {}
        }
        is_inside = letter == '{' || (is_inside && letter != '}');
    }
    plain
}

#[test]
fn every_route_is_asked_by_a_scenario() {
    let scenarios: Vec<String> = scenarios().lines().map(without_names).collect();
    let document: Value =
        serde_json::from_str(&read("clients/openapi.json")).expect("the document is JSON");
    let paths = document["paths"].as_object().expect("paths");
    assert!(15 < paths.len(), "{} routes", paths.len());
    for path in paths.keys() {
        let plain = without_names(path);
        // A route ends where the text, its query or its ending begins.
        let asked = ["\"", "?", "."].map(|end| format!("\"{plain}{end}"));
        let is_asked = scenarios.iter().any(|line| asked.iter().any(|text| line.contains(text)));
        assert!(is_asked, "no scenario asks {path}");
    }
}

#[test]
fn every_setting_is_explained() {
    let text = read("service/server/settings.toml");
    let mut before = "";
    for line in text.lines() {
        if line.contains('=') && !line.starts_with('#') {
            // Keys that follow each other share the comment above them.
            let is_explained = before.starts_with('#') || before.contains('=');
            assert!(is_explained, "`{line}` has no comment");
        }
        before = line;
    }
}

/// What stands in backticks and looks like a file of the repository.
fn named_files(text: &str) -> Vec<String> {
    let looks_like_path = |word: &&str| {
        let plain = |c: char| c.is_ascii_alphanumeric() || "._-/".contains(c);
        let first = word.split('/').next().unwrap_or_default();
        word.contains('/') && TOP_FOLDERS.contains(&first) && word.chars().all(plain)
    };
    text.split('`').skip(1).step_by(2).filter(looks_like_path).map(str::to_owned).collect()
}

#[test]
fn documents_name_what_exists() {
    for document in ["README.md", "ARCHITECTURE.md", "FIGURES.md"] {
        for name in named_files(&read(document)) {
            assert!(root().join(&name).exists(), "{document} names {name}, which is not there");
        }
    }
}

#[test]
fn the_checks_see_what_they_look_for() {
    assert_eq!(without_names("/v1/maps/{map}/x?a={b}"), "/v1/maps/{}/x?a={}", "names are left out");
    assert_eq!(snake_case("ListMapVersions"), "list_map_versions", "as the stubs are called");
    assert_eq!(
        named_files("see `storage/src`, `x.rs`, `/v1/maps` and `service/{a,b}`"),
        ["storage/src"],
        "files of the repository only"
    );
}
