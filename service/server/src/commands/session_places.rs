//! The distinctive places that a robot has found which explores as it is told, and how far it is.

use std::path::Path;

use meetpoint_client::Client;
use meetpoint_proto::v1;

use super::asked::save;
use crate::rest::QualitativeDetail;

/// What is to be shown.
pub(super) struct Shown<'a> {
    pub(super) session: String,
    /// JSON, for machines.
    pub(super) json: bool,
    /// Where the drawing of the graph is to be saved, if one is wanted.
    pub(super) png: Option<&'a Path>,
}

/// Prints what is known and saves the drawing.
pub(super) async fn show(client: &Client, shown: Shown<'_>) -> anyhow::Result<()> {
    let Shown { session, json, png } = shown;
    let request = v1::GetQualitativeExplorationRequest { session, picture: png.is_some() };
    let told = client.qualitative_exploration(request).await?;
    if let Some(path) = png {
        save(path, &told.png)?;
    }
    if json {
        println!("{:#}", serde_json::to_value(QualitativeDetail::from(told))?);
    } else if png != Some(Path::new("-")) {
        print!("{}", in_words(&told));
    }
    Ok(())
}

fn in_words(told: &v1::GetQualitativeExplorationResponse) -> String {
    let v1::GetQualitativeExplorationResponse {
        exploration,
        step,
        whereabouts,
        outlook,
        places,
        edges,
        agenda,
        rehearsal,
        rehearsals,
        rehearsals_refuted,
        surprises,
        png: _,
    } = told;
    let exploration = exploration.clone().unwrap_or_default();
    let mut lines: Vec<String> = places.iter().map(place_line).collect();
    lines.extend(edges.iter().map(edge_line));
    lines.extend(agenda.iter().map(agenda_line));
    let folded = if exploration.folded { ", its beams folded into cones" } else { "" };
    let left_out = match exploration.firings_left_out {
        0 => String::new(),
        n => format!(", {n} left out"),
    };
    let step = step.unwrap_or_default();
    lines.push(format!(
        "session {}: {} places, {} edges by {}{folded}; {} firings{left_out}, {} steps, {rehearsals} \
         rehearsals ({rehearsals_refuted} refuted), {surprises} surprises",
        exploration.session,
        places.len(),
        edges.len(),
        exploration.sensor,
        step.firings,
        step.steps,
    ));
    lines.extend(whereabouts.as_ref().map(where_line));
    lines.extend(outlook.as_ref().map(outlook_line));
    lines.extend(rehearsal.as_ref().map(rehearsal_line));
    lines.push(step_line(&step));
    lines.join("\n") + "\n"
}

fn direction(of: Option<v1::PlaceDirection>) -> String {
    let v1::PlaceDirection { place, direction } = of.unwrap_or_default();
    format!("{place}.{direction}")
}

fn place_line(place: &v1::DistinctivePlace) -> String {
    let v1::Point { x_m, y_m } = place.position.unwrap_or_default();
    let way = |way: &v1::OpenDirection| match way.leads_to {
        Some(to) => direction(Some(to)),
        None => "?".to_owned(),
    };
    let ways: Vec<String> = place.directions.iter().map(way).collect();
    let home = if place.home { ", home" } else { "" };
    format!(
        "place {}{home}: {} to {}; near ({x_m:.1}, {y_m:.1}) m, {} visits",
        place.number,
        place.star,
        ways.join(", "),
        place.visits
    )
}

fn edge_line(edge: &v1::TravelEdge) -> String {
    let mean = |of: Option<v1::Averaged>| of.and_then(|of| of.mean);
    let width = mean(edge.width_m).map_or_else(String::new, |m| format!(", {m:.1} m wide"));
    format!(
        "edge {} to {}: {}, {:.1} m{width}, turns {:.2} rad, {} traversals",
        direction(edge.from),
        direction(edge.to),
        edge.strategy().as_str_name().trim_start_matches("CONTROL_STRATEGY_").to_lowercase(),
        mean(edge.length_m).unwrap_or(0.0),
        mean(edge.turned_rad).unwrap_or(0.0),
        edge.traversals
    )
}

fn agenda_line(item: &v1::UnexploredDirection) -> String {
    let turns: Vec<String> = item.turns.iter().map(u32::to_string).collect();
    format!("unexplored {}: by the turns {}", direction(item.at), turns.join(", "))
}

fn where_line(at: &v1::TopologicalWhereabouts) -> String {
    use v1::TopologicalWhereaboutsKind as Kind;
    match at.kind() {
        Kind::AtPlace => format!(
            "it is at a place, where it came by {}, and faces direction {}",
            direction(at.place),
            at.facing.unwrap_or(0)
        ),
        Kind::OnEdge => format!("it is on the edge that it left for by {}", direction(at.place)),
        Kind::InQuestion => format!(
            "it left by {}; whether it came in by {} is what it finds out",
            direction(at.place),
            direction(at.may_be)
        ),
        Kind::Nowhere | Kind::Unspecified => "it has not come to any place yet".to_owned(),
    }
}

fn outlook_line(outlook: &v1::Outlook) -> String {
    let strategy =
        outlook.strategy().as_str_name().trim_start_matches("CONTROL_STRATEGY_").to_lowercase();
    format!(
        "it has {} ways before it and {} things near; {}; on by {strategy}",
        outlook.open_directions,
        outlook.objects.len(),
        outlook.rule
    )
}

fn rehearsal_line(rehearsal: &v1::QualitativeRehearsal) -> String {
    let route: Vec<String> = rehearsal.route.iter().map(|leg| direction(Some(*leg))).collect();
    let v1::QualitativeRehearsal { done, expected, others, .. } = rehearsal;
    let outcome = match rehearsal.as_predicted {
        None => "not there yet",
        Some(true) => "as predicted, on its way back",
        Some(false) => "not as predicted, on its way back",
    };
    format!(
        "rehearsal by {}, at the end of which `{expected}` is to be seen: {done} edges done, {outcome}; \
         {others} others may be tested",
        route.join(", ")
    )
}

fn step_line(step: &v1::QualitativeStep) -> String {
    match (step.kind(), step.state()) {
        (v1::StepKind::Done, v1::QualitativeState::GaveUp) => {
            "there are more places than are kept: it gave up".to_owned()
        }
        (v1::StepKind::Done, _) => "nothing is left to be explored".to_owned(),
        (v1::StepKind::Turn, _) => format!("next: turn by {:.2} rad", step.turn_rad.unwrap_or(0.0)),
        (v1::StepKind::Move, _) => format!("next: move by {:.2} m", step.move_m.unwrap_or(0.0)),
        (v1::StepKind::Look | v1::StepKind::Unspecified, _) => "next: look again".to_owned(),
    }
}
