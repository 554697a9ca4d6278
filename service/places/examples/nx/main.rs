//! NX explores its environments. `nx [SEEDS]`: at 0, 5 and 10 % random sensor error, with a compass and
//! without. `nx matching [SEEDS]`: with and without what tells places apart. `nx widths [SEEDS]`: in
//! corridors of other widths. `nx noise [SEEDS]`: with larger errors and fewer firings. `nx watch
//! ENVIRONMENT ERROR SEED [without]` tells of one exploration and draws it.

mod table;
mod trail;
mod watch;

use meetpoint_places::qualitative::ExplorerParams;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let n_seeds = |text: &str| text.parse().expect("a number of seeds");
    match words[..] {
        ["watch", name, error, seed] => {
            watch::tell(name, error, seed, ExplorerParams::NX);
        }
        ["watch", name, error, seed, "without"] => {
            watch::tell(name, error, seed, ExplorerParams::NX_WITHOUT_COMPASS);
        }
        ["matching", seeds] => table::of_matching(n_seeds(seeds)),
        ["matching"] => table::of_matching(10),
        ["noise", seeds] => table::of_noise(n_seeds(seeds)),
        ["noise"] => table::of_noise(10),
        ["widths", seeds] => table::of_widths(n_seeds(seeds)),
        ["widths"] => table::of_widths(10),
        [seeds] => table::of_errors(n_seeds(seeds)),
        _ => table::of_errors(10),
    }
}
