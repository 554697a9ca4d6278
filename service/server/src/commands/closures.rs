//! `meetpoint closures`: what relax jobs took for the same place; switches one off or on.

use meetpoint_proto::v1;

use super::asked::ServerArgs;

/// Options of `meetpoint closures`.
#[derive(Debug, clap::Args)]
pub struct ClosuresArgs {
    /// The map
    #[arg(long, value_name = "MAP")]
    map: String,
    /// Only those of which a moment is this session's
    #[arg(long, value_name = "ID", default_value = "")]
    session: String,
    /// Let no relax job rest poses on this closure
    #[arg(long, value_name = "ID", conflicts_with = "on")]
    off: Option<String>,
    /// Leave this closure to the judgement of relax jobs again
    #[arg(long, value_name = "ID")]
    on: Option<String>,
    /// Why it is switched
    #[arg(long, value_name = "TEXT", default_value = "")]
    reason: String,
    #[command(flatten)]
    server: ServerArgs,
}

/// Prints the ledger, or the closure that was switched.
///
/// # Errors
/// If there is no such map or closure.
pub async fn run(args: ClosuresArgs) -> anyhow::Result<()> {
    let client = args.server.client()?;
    let ClosuresArgs { map, session, off, on, reason, server } = args;
    let author = String::new();
    let switched = if let Some(closure) = off {
        let request = v1::SwitchClosureOffRequest { map: map.clone(), closure, reason, author };
        Some(client.switch_closure_off(request).await?)
    } else if let Some(closure) = on {
        let request = v1::SwitchClosureOnRequest { map: map.clone(), closure, reason, author };
        Some(client.switch_closure_on(request).await?)
    } else {
        None
    };
    let closures = match &switched {
        Some(closure) => vec![closure.clone()],
        None => client.closures(&map, &session).await?,
    };
    if server.json {
        let closures: Vec<serde_json::Value> = closures.iter().map(json).collect();
        println!("{}", serde_json::json!({ "map": map, "closures": closures }));
        return Ok(());
    }
    for closure in &closures {
        println!("{}", line(closure));
    }
    if closures.is_empty() {
        println!("no relax job has considered any closure of map {map}");
    }
    if closures.iter().any(|closure| closure.relax_needed) {
        println!("to take effect: meetpoint relax --map {map}");
    }
    Ok(())
}

/// A closure in a line.
fn line(closure: &v1::Closure) -> String {
    let place = |at: Option<v1::Point>| {
        at.map_or_else(|| "?".to_owned(), |at| format!("({:.2}, {:.2}) m", at.x_m, at.y_m))
    };
    format!(
        "{}  {} at {} to {} at {}{}: score {:.3}, {:.3} m and {:.2}° off, {}{}",
        closure.id,
        seconds(closure.from_time_ns),
        place(closure.from_position),
        seconds(closure.to_time_ns),
        place(closure.to_position),
        sessions(closure),
        closure.score,
        closure.residual_m,
        closure.residual_rad.to_degrees(),
        verdict(closure),
        if closure.switched_off { ", switched off" } else { "" },
    )
}

/// Whose moments they are, where these are two sessions'.
fn sessions(closure: &v1::Closure) -> String {
    let v1::Closure { from_session, to_session, .. } = closure;
    if from_session == to_session {
        return String::new();
    }
    format!(" (session {from_session} to session {to_session})")
}

fn seconds(stamp_ns: i64) -> String {
    format!(
        "{}.{:03} s",
        stamp_ns.div_euclid(1_000_000_000),
        stamp_ns.rem_euclid(1_000_000_000) / 1_000_000
    )
}

/// What a relax job made of it, for people.
fn verdict(closure: &v1::Closure) -> &'static str {
    if closure.verdict == i32::from(v1::ClosureVerdict::Accepted) {
        return "accepted";
    }
    match v1::ClosureRefusal::try_from(closure.refusal).unwrap_or_default() {
        v1::ClosureRefusal::Unspecified => "refused",
        v1::ClosureRefusal::SwitchedOff => "refused: it was switched off",
        v1::ClosureRefusal::Ambiguous => "refused: it fits elsewhere too",
        v1::ClosureRefusal::FewScansAgree => "refused: too few scans agree",
        v1::ClosureRefusal::Contradicted => "refused: what was seen contradicts it",
        v1::ClosureRefusal::Unsupported => "refused: it is far off and alone",
        v1::ClosureRefusal::Inconsistent => "refused: the others say otherwise",
    }
}

fn json(closure: &v1::Closure) -> serde_json::Value {
    serde_json::json!({
        "id": closure.id,
        "from_session": closure.from_session,
        "from_time_ns": closure.from_time_ns,
        "to_session": closure.to_session,
        "to_time_ns": closure.to_time_ns,
        "score": closure.score,
        "residual_m": closure.residual_m,
        "residual_rad": closure.residual_rad,
        "chi2": closure.chi2,
        "verdict": verdict(closure),
        "switched_off": closure.switched_off,
        "relax_needed": closure.relax_needed,
    })
}
