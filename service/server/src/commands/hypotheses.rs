//! `meetpoint hypotheses`: every topological map that fits a travel, which is written down or told of by a
//! robot.

use std::io::Read;
use std::path::{Path, PathBuf};

use anyhow::Context;
use meetpoint_places::{
    Assumptions, Hypothesis, MapTree, MapTreeParams, Observation, Sighting, Travel, next_decision,
};
use meetpoint_proto::v1;
use serde_json::{Value, json};

use super::asked::ServerArgs;
use super::map_hypotheses::{self, Shown};
use super::{schemas, seen_place};

/// Options of `meetpoint hypotheses`.
#[derive(Debug, clap::Args)]
#[expect(clippy::struct_excessive_bools, reason = "each is a word of the command line")]
pub struct HypothesesArgs {
    /// What a robot saw and did, from place to place: each place's ways in clockwise order from the one by which it
    /// came in, the same letter twice where a way goes straight through; each step the number of ways clockwise to
    /// the one it left by, 0 being back. A place's looks may be told behind `@`, and `!` says that there is none other
    /// like it: `ab 1:aba 2:abab@hall 0:a@home!`
    #[arg(value_name = "TRAVEL", required_unless_present_any = ["file", "map"])]
    travel: Option<String>,
    /// The same from a file; `-` for standard input
    #[arg(long, value_name = "FILE", conflicts_with = "travel")]
    file: Option<PathBuf>,
    /// The travel that a robot told of on this map of the service
    #[arg(long, value_name = "MAP", conflicts_with_all = ["travel", "file", "limit"])]
    map: Option<String>,
    /// Which session's; that opened last of those that told of visits, if none is given
    #[arg(long, value_name = "ID", default_value = "", requires = "map")]
    session: String,
    /// What was seen of this place of the simplest map: the local map that the robot's laser drew, gateways and stars
    #[arg(long, value_name = "N", requires = "map")]
    place: Option<u32>,
    /// What was seen, what was done then and what was seen next, before there is any place
    #[arg(long, requires = "map", conflicts_with_all = ["place", "png"])]
    schemas: bool,
    /// Save a drawing of the simplest map, or of the place; `-` for standard output
    #[arg(long, value_name = "FILE", requires = "map")]
    png: Option<PathBuf>,
    /// No two ways cross but at places: no bridges, no stairs
    #[arg(long)]
    planar: bool,
    /// Ways may come back to a place that they pass: corridors in a circle
    #[arg(long)]
    circles: bool,
    /// Maps whose places cannot lie in one frame as odometry says are left out
    #[arg(long, requires = "map")]
    metrical: bool,
    /// Maps kept at most; what is given up on is told
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    limit: u32,
    /// Maps that are printed, the simplest first
    #[arg(long, value_name = "N", default_value_t = 5)]
    show: u32,
    #[command(flatten)]
    server: ServerArgs,
}

/// Prints the maps, what distinguishes them, and what to do to find out.
///
/// # Errors
/// If the travel cannot be read, no map fits it, or nobody told of it.
pub async fn run(args: &HypothesesArgs) -> anyhow::Result<()> {
    let HypothesesArgs { map, session, planar, circles, metrical, show, png, server, .. } = args;
    if let Some(map) = map {
        let (map, session) = (map.clone(), session.clone());
        if args.schemas {
            return schemas::show(&server.client()?, (map, session), server.json).await;
        }
        let tree =
            v1::TreeName { map, session, planar: *planar, circles: *circles, metrical: *metrical };
        if let Some(place) = args.place {
            let png = png.as_deref();
            let shown = seen_place::Shown { tree, place, json: server.json, png };
            return seen_place::show(&server.client()?, shown).await;
        }
        let shown = Shown { tree, n_maps: *show, json: server.json, png: png.as_deref() };
        return map_hypotheses::show(&server.client()?, shown).await;
    }
    run_apart(args)
}

/// The same of a travel that is written down: no service is needed.
fn run_apart(args: &HypothesesArgs) -> anyhow::Result<()> {
    let travel: Travel = written(args)?.trim().parse().context("this is no travel")?;
    let assumptions = Assumptions { has_ordered_paths: !args.circles, is_planar: args.planar };
    let n_hypotheses_max = usize::try_from(args.limit).unwrap_or(usize::MAX);
    let params = MapTreeParams { assumptions, n_hypotheses_max };
    let tree = MapTree::of_travel(params, &travel)?;
    if tree.hypotheses().is_empty() {
        anyhow::bail!("no map fits this travel: something was seen or assumed wrongly");
    }
    if args.server.json {
        println!("{:#}", in_json(&tree));
    } else {
        print!("{}", in_words(&tree, args.show as usize));
    }
    Ok(())
}

fn written(args: &HypothesesArgs) -> anyhow::Result<String> {
    match (&args.travel, &args.file) {
        (Some(travel), _) => Ok(travel.clone()),
        (None, Some(path)) if path == Path::new("-") => {
            let mut text = String::new();
            std::io::stdin().read_to_string(&mut text).context("cannot read standard input")?;
            Ok(text)
        }
        (None, Some(path)) => {
            std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))
        }
        (None, None) => anyhow::bail!("no travel is given"),
    }
}

/// The letter, then letters, of the n-th place.
pub(super) fn place_name(index: usize) -> String {
    let letter = u8::try_from(index % 26).map_or('?', |letter| char::from(b'A' + letter));
    if index < 26 { letter.to_string() } else { format!("{letter}{}", index / 26) }
}

/// Which place each visit was to, by their names in the order of first visits.
fn visits(hypothesis: &Hypothesis, travel: &Travel) -> Vec<String> {
    let sightings = hypothesis.sightings(travel).unwrap_or_default();
    let mut first_visits: Vec<usize> = Vec::new();
    let named = |Sighting { first_visit, .. }: Sighting| {
        let known = first_visits.iter().position(|&known| known == first_visit);
        let index = known.unwrap_or_else(|| {
            first_visits.push(first_visit);
            first_visits.len() - 1
        });
        place_name(index)
    };
    sightings.into_iter().map(named).collect()
}

fn predicted(seen: Option<&Observation>) -> String {
    seen.map_or_else(|| "what nobody has seen".to_owned(), ToString::to_string)
}

fn in_words(tree: &MapTree, n_shown: usize) -> String {
    let (all, travel) = (tree.hypotheses(), tree.travel());
    let given_up = if tree.is_truncated() {
        format!("; {} were given up, the true one may be among them", tree.n_given_up())
    } else {
        String::new()
    };
    let (n_all, n_minimal, n_travels) = (all.len(), tree.minimal().len(), travel.steps.len());
    let mut lines = vec![
        format!(
            "Maps that fit: {n_all}; of these simplest: {n_minimal}; travels: {n_travels}{given_up}"
        ),
        String::new(),
    ];
    lines.extend(all.iter().enumerate().take(n_shown).map(|(index, it)| {
        format!(
            "{:>4}  {} places, {} edges, {} paths, {} ways nobody has gone: {}",
            index + 1,
            it.map.n_places(),
            it.map.n_edges(),
            it.map.n_paths(),
            it.map.agenda(it.at).len(),
            visits(it, travel).join(" ")
        )
    }));
    if n_shown < n_all {
        lines.push(format!("      and {} more", n_all - n_shown));
    }
    lines.extend(advice(all).into_iter().flat_map(|advice| [String::new(), advice]));
    lines.join("\n") + "\n"
}

/// What to do to find out; `None` if there is nothing but exploring.
fn advice(all: &[Hypothesis]) -> Option<String> {
    let decision = next_decision(all)?;
    let number = |of: usize| {
        let id = decision.between[of];
        all.iter().position(|it| it.id == id).map_or(0, |index| index + 1)
    };
    let [a, b] = [0, 1].map(|of| predicted(decision.rehearsal.predicted[of].as_ref()));
    let turns: Vec<String> = decision.rehearsal.turns.iter().map(u8::to_string).collect();
    let turns = turns.join(", ");
    let [of_a, of_b] = [0, 1].map(number);
    Some(format!("To find out, go on by the ways {turns}: map {of_a} expects {a}, map {of_b} {b}"))
}

fn in_json(tree: &MapTree) -> Value {
    let (all, travel) = (tree.hypotheses(), tree.travel());
    let hypotheses = all.iter().map(|it| {
        json!({
            "id": it.id.0,
            "places": it.map.n_places(),
            "edges": it.map.n_edges(),
            "paths": it.map.n_paths(),
            "visits": visits(it, travel),
            "unexplored": it.map.agenda(it.at).into_iter().map(|(_, turns)| turns).collect::<Vec<_>>(),
        })
    });
    let decision = next_decision(all).map(|decision| {
        let expected = decision.rehearsal.predicted.each_ref();
        json!({
            "between": decision.between.map(|id| id.0),
            "turns": decision.rehearsal.turns,
            "expected": expected.map(|seen| seen.as_ref().map(ToString::to_string)),
        })
    });
    json!({
        "travels": travel.steps.len(),
        "hypotheses": hypotheses.collect::<Vec<Value>>(),
        "minimal": tree.minimal().len(),
        "given_up": tree.n_given_up(),
        "next_decision": decision,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Around corners that look alike: back at the first after two, three or four, or never.
    const AROUND: &str = "ab 1:ab 1:ab 1:ab 1:ab";

    fn tree(travel: &str) -> MapTree {
        let params = MapTreeParams { assumptions: Assumptions::HSSH_2004, n_hypotheses_max: 100 };
        MapTree::of_travel(params, &travel.parse().expect("a travel")).expect("good turns")
    }

    #[test]
    fn people_are_told_the_maps_and_what_to_do() {
        let text = in_words(&tree(AROUND), 2);
        assert!(text.starts_with("Maps that fit: ") && text.contains("travels: 4"), "{text}");
        assert!(text.contains("   1  ") && text.contains("ways nobody has gone: A B"), "{text}");
        assert!(text.contains(" more\n"), "the others are counted: {text}");
        assert!(text.contains("To find out, go on by the ways"), "{text}");
    }

    #[test]
    fn machines_are_told_the_same() {
        let tree = tree(AROUND);
        let told = in_json(&tree);
        assert_eq!(
            told["hypotheses"].as_array().map(Vec::len),
            Some(tree.hypotheses().len()),
            "all"
        );
        assert_eq!(told["hypotheses"][0]["visits"][0], "A", "{told}");
        assert_eq!(told["given_up"], 0, "{told}");
        assert!(told["next_decision"]["turns"].is_array(), "{told}");
    }

    #[test]
    fn places_have_names_however_many() {
        assert_eq!([0, 25, 26, 53].map(place_name), ["A", "Z", "A1", "B2"], "in order");
    }
}
