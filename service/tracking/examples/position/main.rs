//! Final position error of a sonar robot after fifteen minutes in a building of many rooms (Thrun 1998, Fig. 5),
//! with all sources of information and with each switched off, and with a laser.
//!
//! ```text
//! cargo run --release -p meetpoint-tracking --example position -- [SEEDS [PICTURES]]
//! ```
//!
//! Odometry is made to err so much that it alone ends 11.5 m off. SEEDS are how many buildings, 10 unless
//! told otherwise; PICTURES is a folder for maps as PNG. After each final error stands the mean over the way.

mod travel;
mod variant;

use std::error::Error;

use travel::Travel;
use variant::Variant;

fn main() -> Result<(), Box<dyn Error>> {
    let mut words = std::env::args().skip(1);
    let n_seeds: u64 = words.next().map_or(Ok(10), |word| word.parse())?;
    let pictures = words.next();
    let names: Vec<&str> = Variant::ALL.iter().map(|variant| variant.name()).collect();
    println!("| seed | way, m | odometry | {} |", names.join(" | "));
    println!("|---|---|---|{}", "---|".repeat(names.len()));
    for seed in 0..n_seeds {
        let travel = Travel::new(seed)?;
        let mut cells = vec![
            seed.to_string(),
            format!("{:.0}", travel.length_m()),
            format!("{:.2} m, times {:.2}", travel.odometry_error_m(), travel.factor),
        ];
        for variant in Variant::ALL {
            let found = variant.run(&travel)?;
            cells.push(format!("{:.2} m ({:.2} mean)", found.final_error_m, found.mean_error_m));
            if let Some(folder) = &pictures {
                let path = format!("{folder}/{seed}-{}.png", variant.name().replace(' ', "-"));
                std::fs::write(path, &found.picture)?;
            }
        }
        println!("| {} |", cells.join(" | "));
    }
    Ok(())
}
