//! The maps of places that fit a robot's travel, as the service tells them.

use std::path::Path;

use meetpoint_client::Client;
use meetpoint_proto::v1;

use super::asked::save;
use super::hypotheses::place_name;
use crate::rest::HypothesisList;

/// What is to be shown.
pub(super) struct Shown<'a> {
    pub(super) tree: v1::TreeName,
    /// Maps, at most.
    pub(super) n_maps: u32,
    /// JSON, for machines.
    pub(super) json: bool,
    /// Where the drawing of the simplest is to be saved, if one is wanted.
    pub(super) png: Option<&'a Path>,
}

/// Prints the maps and saves the drawing.
pub(super) async fn show(client: &Client, shown: Shown<'_>) -> anyhow::Result<()> {
    let Shown { tree, n_maps, json, png } = shown;
    let request = v1::ListHypothesesRequest {
        tree: Some(tree.clone()),
        page_size: n_maps.max(1),
        page_token: String::new(),
    };
    let told = client.hypotheses(request).await?;
    if let Some(path) = png {
        let request =
            v1::GetHypothesisRequest { tree: Some(tree), hypothesis: String::new(), picture: true };
        save(path, &client.hypothesis(request).await?.png)?;
    }
    if json {
        println!("{:#}", serde_json::to_value(HypothesisList::from(told))?);
    } else {
        print!("{}", in_words(&told));
    }
    Ok(())
}

fn in_words(told: &v1::ListHypothesesResponse) -> String {
    let v1::ListHypothesesResponse {
        tree,
        hypotheses,
        next_page_token: _,
        difference,
        next_decision,
    } = told;
    let tree = tree.clone().unwrap_or_default();
    let mut lines = vec![format!(
        "Maps that fit: {}; of these simplest: {}; visits: {} of session {}",
        tree.consistent,
        tree.minimal,
        tree.visits,
        tree.name.unwrap_or_default().session
    )];
    if tree.by_steps {
        lines.push(
            "read from its firings: it told of no visits, and is told step by step".to_owned(),
        );
    }
    if tree.truncated {
        lines.push(format!("{} were given up, the true one may be among them", tree.given_up));
    }
    if 0 < tree.visits_left_out {
        lines.push(format!(
            "{} visits were left out: {}",
            tree.visits_left_out, tree.left_out_reason
        ));
    }
    lines.extend(tree.assertions.iter().map(|said| {
        let holds = if said.in_force { "" } else { ", which none of these is" };
        let v1::HypothesisAssertion { hypothesis, author, reason, .. } = said;
        format!("Said to be true: {hypothesis}{holds} ({author}: {reason})")
    }));
    lines.push(String::new());
    lines.extend(hypotheses.iter().map(line));
    let n_more = (tree.consistent as usize).saturating_sub(hypotheses.len());
    if 0 < n_more {
        lines.push(format!("      and {n_more} more"));
    }
    if let Some(v1::HypothesisDifference { visit, first_visit, other_first_visit }) = difference {
        let said = |first: u32| {
            if first == *visit {
                "a new place".to_owned()
            } else {
                format!("that of visit {first}")
            }
        };
        let (first, second) = (said(*first_visit), said(*other_first_visit));
        lines.push(format!("\nVisit {visit} was to {first} by map 1, to {second} by map 2"));
    }
    lines.extend(next_decision.iter().map(|decision| advice(decision, hypotheses)));
    lines.join("\n") + "\n"
}

fn line(map: &v1::Hypothesis) -> String {
    let v1::Hypothesis { id, rank, minimal: _, places, edges, paths, unexplored, visits } = map;
    let visits: Vec<String> = visits.iter().map(|&place| place_name(place as usize)).collect();
    format!(
        "{rank:>4}  {id}  {places} places, {edges} edges, {paths} paths, {unexplored} ways nobody has \
         gone: {}",
        visits.join(" ")
    )
}

/// What to do to find out.
fn advice(decision: &v1::HypothesisDecision, listed: &[v1::Hypothesis]) -> String {
    let v1::HypothesisDecision { hypothesis, other_hypothesis, turns, expected, other_expected } =
        decision;
    let name = |id: &String| {
        let rank = listed.iter().find(|map| map.id == *id).map(|map| map.rank.to_string());
        rank.unwrap_or_else(|| id.clone())
    };
    let seen = |seen: &String| {
        if seen.is_empty() { "what nobody has seen".to_owned() } else { seen.clone() }
    };
    let turns: Vec<String> = turns.iter().map(u32::to_string).collect();
    format!(
        "\nTo find out, go on by the ways {}: map {} expects {}, map {} {}",
        turns.join(", "),
        name(hypothesis),
        seen(expected),
        name(other_hypothesis),
        seen(other_expected)
    )
}
