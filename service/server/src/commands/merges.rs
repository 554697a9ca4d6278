//! `meetpoint merges`: where sessions of unknown start lie, and what is decided about it.

use std::path::PathBuf;

use meetpoint_client::Client;
use meetpoint_proto::v1;

use super::asked::{ServerArgs, save};
use super::watched_job::{ended, has_succeeded};

/// Options of `meetpoint merges`.
#[derive(Debug, clap::Args)]
pub struct MergesArgs {
    #[command(subcommand)]
    command: MergesCommand,
}

#[derive(Debug, clap::Subcommand)]
enum MergesCommand {
    /// All merges of a map
    List {
        /// The map; all where nothing is said
        #[arg(long, value_name = "MAP", default_value = "")]
        map: String,
        #[command(flatten)]
        server: ServerArgs,
    },
    /// One merge, with all alignments
    Show {
        #[command(flatten)]
        meant: Meant,
    },
    /// Save a picture of one map laid over the other
    Preview {
        /// The alignment; the first where nothing is said
        #[arg(long, value_name = "ID", default_value = "")]
        alignment: String,
        /// Where to write it; `MERGE.png` where nothing is said
        #[arg(long, short, value_name = "FILE")]
        output: Option<PathBuf>,
        #[command(flatten)]
        meant: Meant,
    },
    /// Put the session where an alignment says, and draw the map with it
    Accept {
        /// The alignment; the first where nothing is said
        #[arg(long, value_name = "ID", default_value = "")]
        alignment: String,
        #[command(flatten)]
        meant: Meant,
        #[command(flatten)]
        said: Said,
    },
    /// Leave the session where it is, whatever merge jobs find
    Reject {
        #[command(flatten)]
        meant: Meant,
        #[command(flatten)]
        said: Said,
    },
    /// Take an accepted merge back, and draw the map without it
    Undo {
        #[command(flatten)]
        meant: Meant,
        #[command(flatten)]
        said: Said,
    },
}

/// Which merge is meant.
#[derive(Debug, clap::Args)]
struct Meant {
    /// The merge
    merge: String,
    #[command(flatten)]
    server: ServerArgs,
}

/// Why something is decided.
#[derive(Debug, clap::Args)]
struct Said {
    /// Why
    #[arg(long, value_name = "TEXT", default_value = "")]
    reason: String,
    /// Who says so
    #[arg(long, value_name = "TEXT", default_value = "")]
    author: String,
}

/// Prints merges, saves a picture, or decides.
///
/// # Errors
/// If there is no such merge, or it is not in the state for that.
pub async fn run(args: MergesArgs) -> anyhow::Result<()> {
    match args.command {
        MergesCommand::List { map, server } => {
            let merges = server.client()?.merges(&map, "").await?;
            print_all(&merges, server.json);
            Ok(())
        }
        MergesCommand::Show { meant: Meant { merge, server } } => {
            print_one(&server.client()?.merge(&merge).await?, server.json);
            Ok(())
        }
        MergesCommand::Preview { alignment, output, meant: Meant { merge, server } } => {
            let png = server.client()?.merge_preview(&merge, &alignment).await?;
            let path = output.unwrap_or_else(|| PathBuf::from(format!("{merge}.png")));
            save(&path, &png)?;
            eprintln!("written: {}", path.display());
            Ok(())
        }
        MergesCommand::Accept { alignment, meant: Meant { merge, server }, said } => {
            let Said { reason, author } = said;
            let request = v1::AcceptMergeRequest { merge, alignment, reason, author };
            let client = server.client()?;
            let v1::AcceptMergeResponse { merge, job } = client.accept_merge(request).await?;
            drawn(&client, merge, &job, server.json).await
        }
        MergesCommand::Reject { meant: Meant { merge, server }, said } => {
            let Said { reason, author } = said;
            let request = v1::RejectMergeRequest { merge, reason, author };
            print_one(&server.client()?.reject_merge(request).await?, server.json);
            Ok(())
        }
        MergesCommand::Undo { meant: Meant { merge, server }, said } => {
            let Said { reason, author } = said;
            let request = v1::UndoMergeRequest { merge, reason, author };
            let client = server.client()?;
            let v1::UndoMergeResponse { merge, job } = client.undo_merge(request).await?;
            drawn(&client, merge, &job, server.json).await
        }
    }
}

/// Waits until the map is drawn by a decision, and prints the merge.
async fn drawn(
    client: &Client,
    merge: Option<v1::Merge>,
    job: &str,
    is_json: bool,
) -> anyhow::Result<()> {
    let mut version = 0;
    if !job.is_empty() {
        let job = ended(client, client.job(job).await?, "draw", is_json).await?;
        has_succeeded(&job)?;
        version = job.result_version;
    }
    if let Some(merge) = merge {
        print_one(&merge, is_json);
        if !is_json && version > 0 {
            println!("map {} is version {version} now", merge.map);
        }
    }
    Ok(())
}

fn print_all(merges: &[v1::Merge], is_json: bool) {
    if is_json {
        let merges: Vec<serde_json::Value> = merges.iter().map(json).collect();
        println!("{}", serde_json::json!({ "merges": merges }));
        return;
    }
    for merge in merges {
        println!("{}", line(merge));
    }
    if merges.is_empty() {
        println!("no merge job has looked at any session");
    }
}

fn print_one(merge: &v1::Merge, is_json: bool) {
    if is_json {
        println!("{}", json(merge));
        return;
    }
    println!("{}", line(merge));
    for (alignment, rank) in merge.alignments.iter().zip(1..) {
        println!("  {rank}. {}", place(alignment));
    }
    if let Some(v1::MergeDecision { by_rule, author, reason, .. }) = &merge.decision {
        let who = if *by_rule { "a rule" } else { "a person" };
        println!("  decided by {who} {author}: {reason}");
    }
}

/// A merge in a line.
fn line(merge: &v1::Merge) -> String {
    format!(
        "{}  session {} on {}: {}, {}: {}",
        merge.id,
        merge.session,
        merge.map,
        verdict(merge),
        state(merge),
        merge.reasons.join("; ")
    )
}

/// An alignment in a line.
fn place(alignment: &v1::MergeAlignment) -> String {
    let v1::Pose { x_m, y_m, theta_rad } = alignment.onto_from_session.unwrap_or_default();
    let onto = match alignment.onto_session.as_str() {
        "" => "in the map".to_owned(),
        session => format!("in session {session}"),
    };
    let margin =
        alignment.margin.map_or_else(String::new, |margin| format!(", margin {margin:.1}"));
    format!(
        "{}  {onto} at ({x_m:.2}, {y_m:.2}) m, turned by {:.1}°: score {:.1}{margin}, {:.0} m² in common ({:.0} %), {:.0} % of the walls agree, {:.0} % contradict",
        alignment.id,
        theta_rad.to_degrees(),
        alignment.score,
        alignment.overlap_m2,
        100.0 * alignment.overlap_share,
        100.0 * alignment.agreement,
        100.0 * alignment.contradiction,
    )
}

fn verdict(merge: &v1::Merge) -> &'static str {
    merge.verdict().as_str_name().trim_start_matches("MERGE_VERDICT_")
}

fn state(merge: &v1::Merge) -> &'static str {
    merge.state().as_str_name().trim_start_matches("MERGE_STATE_")
}

fn json(merge: &v1::Merge) -> serde_json::Value {
    let alignment = |alignment: &v1::MergeAlignment| {
        let v1::Pose { x_m, y_m, theta_rad } = alignment.onto_from_session.unwrap_or_default();
        serde_json::json!({
            "id": alignment.id,
            "onto_session": alignment.onto_session,
            "onto_from_session": { "x_m": x_m, "y_m": y_m, "theta_rad": theta_rad },
            "covariance": alignment.covariance,
            "score": alignment.score,
            "overlap_m2": alignment.overlap_m2,
            "overlap_share": alignment.overlap_share,
            "agreement": alignment.agreement,
            "contradiction": alignment.contradiction,
            "margin": alignment.margin,
        })
    };
    let decision = merge.decision.as_ref().map(|decision| {
        serde_json::json!({
            "alignment": decision.alignment,
            "by_rule": decision.by_rule,
            "author": decision.author,
            "reason": decision.reason,
        })
    });
    serde_json::json!({
        "id": merge.id,
        "map": merge.map,
        "session": merge.session,
        "verdict": verdict(merge),
        "reasons": merge.reasons,
        "state": state(merge),
        "alignments": merge.alignments.iter().map(alignment).collect::<Vec<_>>(),
        "decision": decision,
        "job": merge.job,
        "map_version": merge.map_version,
    })
}
