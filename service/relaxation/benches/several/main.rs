//! Several robots, no relative start known: how often one map of landmarks is found in another, and
//! never where it is not.
//!
//! ```text
//! cargo bench -p meetpoint-relaxation --bench several -- [museum] [pairs] [together] [MRCLAM_FOLDER]
//! ```

mod mrclam;
mod mrclam_folder;
mod museum;
mod pairs;
mod together;

use std::path::Path;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).filter(|word| word != "--bench").collect();
    let is_asked = |name: &str| words.is_empty() || words.iter().any(|word| word == name);
    if is_asked("museum") {
        museum::print();
        museum::print_largest();
    }
    if is_asked("pairs") {
        pairs::print();
    }
    if is_asked("together") {
        together::print();
    }
    for folder in words.iter().map(Path::new).filter(|path| path.is_dir()) {
        mrclam::print(folder);
    }
}
