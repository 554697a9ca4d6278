//! `meetpoint replay`: sends recorded data as a robot would, over the public gRPC API only.
//!
//! A recording is read twice: once to declare its sensors, once to send it. The client's key of a
//! session is made from the recording's content and the options, and the same recording always
//! gives the same batches: a second replay finds the session of the first and goes on where that
//! stopped.

mod account;
mod assignment;
mod batches;
mod carmen;
mod completion;
mod content;
mod cutter;
mod lines;
mod log_source;
mod mrclam;
mod options;
mod progress;
mod recording;
mod report;
mod section;
mod stamp;
mod survey;

use std::path::PathBuf;

use crate::commands::ServerArgs;
use assignment::assignments;
pub use options::{Rate, StartOption};
use recording::Recording;
pub use section::Place;

/// Options of `meetpoint replay`.
#[derive(Clone, Debug, clap::Args)]
pub struct ReplayArgs {
    /// CARMEN logs, plain or gzipped, each of which becomes a session; or MRCLAM folders, in which each
    /// robot does
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// The map to draw; it is made if there is none of that name
    #[arg(long, value_name = "MAP")]
    map: String,
    /// The robot's name; made from the file's name where none is given. Several robots of a folder are
    /// numbered: `NAME-1`
    #[arg(long, value_name = "NAME")]
    robot: Option<String>,
    /// Where the robot begins: `known` (the map's origin), `unknown`, or a pose `X,Y,THETA` in
    /// metres and radians
    ///
    /// By default known. Of several robots of a folder the first begins at the map's origin, and nobody
    /// knows where the others do
    #[arg(long, value_name = "START", allow_hyphen_values = true)]
    start: Option<StartOption>,
    /// Only the robot of that number of an MRCLAM folder
    #[arg(long, value_name = "N")]
    source_robot: Option<u32>,
    /// Forget which landmark of an MRCLAM folder was seen: all look alike
    #[arg(long)]
    anonymous_landmarks: bool,
    /// How fast to send: `max`, or a multiple of real time such as `1x` or `10x`
    #[arg(long, value_name = "RATE", default_value = "max")]
    rate: Rate,
    /// Begin here: seconds (`90`, `0.5s`) or a share of the log (`0.25`, `25%`)
    #[arg(long, value_name = "PLACE")]
    from: Option<Place>,
    /// Stop before this place
    #[arg(long, value_name = "PLACE")]
    to: Option<Place>,
    /// Edge of a cell of a new map, in metres; the service's default where none is given
    #[arg(long, value_name = "METRES", default_value_t = 0.0, hide_default_value = true)]
    resolution: f64,
    #[command(flatten)]
    server: ServerArgs,
}

/// Replays every file and folder, one after the other, and waits until all of each is mapped and in a
/// version.
///
/// # Errors
///
/// If anything of that was not done; what is needed to go on is in the message.
pub async fn run(args: ReplayArgs) -> anyhow::Result<()> {
    let client = args.server.client()?;
    for file in &args.files {
        for assignment in assignments(&args, file)? {
            let recording = Recording::open(&args, assignment).await?;
            let account = recording.content.account();
            let report = recording.replay(&client).await?;
            if args.server.json {
                println!("{}", report.to_json(account));
            } else {
                println!("{report}");
                for line in report::left_out(account) {
                    println!("{line}");
                }
                println!("{}", report.next_step());
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Command {
        #[command(flatten)]
        replay: ReplayArgs,
    }

    /// The client's key of a session for a log of `n_scans` scans and more options.
    async fn key(n_scans: u32, name: &str, options: &[&str]) -> String {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join(name);
        let lines = (0..n_scans).map(|i| format!("FLASER 1 2 0 0 0 {i} 0 0 {i}.5 h 0"));
        std::fs::write(&file, lines.collect::<Vec<_>>().join("\n")).expect("a free disk");
        let words = [&["replay", "FILE", "--map", "lab"], options].concat();
        let args = Command::try_parse_from(words).map_err(|error| error.to_string());
        let args = args.expect("good options").replay;
        let mut assigned = assignments(&args, &file).expect("a log needs nothing more");
        let recording = Recording::open(&args, assigned.remove(0)).await.expect("a good log");
        recording.client_key()
    }

    #[tokio::test]
    async fn the_same_recording_finds_its_session_again() {
        let one = key(9, "a.log", &[]).await;
        assert_eq!(one, key(9, "b.clf", &[]).await, "whatever the file is called");
        assert_eq!(one, key(9, "a.log", &["--rate", "1x"]).await, "however fast it is sent");
        assert_eq!(one, key(9, "a.log", &["--start", "0,0,0"]).await, "known is the origin");
        assert_ne!(one, key(8, "a.log", &[]).await, "another recording");
        assert_ne!(one, key(9, "a.log", &["--start", "unknown"]).await, "another start");
        assert_ne!(one, key(9, "a.log", &["--to", "4s"]).await, "another part");
        assert!(one.len() <= 128, "the service takes it: {one}");
    }

    #[tokio::test]
    async fn a_file_without_scans_says_what_it_holds() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("notes.txt");
        std::fs::write(&file, "dear diary\nODOM 1\n").expect("a free disk");
        let args = Command::try_parse_from(["replay", "FILE", "--map", "lab"]).map_err(|_| ());
        let args = args.expect("good options").replay;
        let assignment = assignments(&args, &file).expect("a log needs nothing more").remove(0);
        let Err(error) = Recording::open(&args, assignment).await else { panic!("no scans in it") };
        let text = error.to_string();
        assert!(text.contains("no laser scan in 2 lines"), "{text}");
        assert!(text.contains("line 2: no y"), "{text}");
    }
}
