//! The causal schemas of a travel in lines.

use meetpoint_client::Client;
use meetpoint_proto::v1;

use crate::rest::CausalSchemas;

/// Prints them.
pub(super) async fn show(
    client: &Client,
    (map, session): (String, String),
    json: bool,
) -> anyhow::Result<()> {
    let told = client.causal_schemas(v1::ListCausalSchemasRequest { map, session }).await?;
    if json {
        println!("{:#}", serde_json::to_value(CausalSchemas::from(told))?);
    } else {
        print!("{}", in_words(&told));
    }
    Ok(())
}

fn in_words(told: &v1::ListCausalSchemasResponse) -> String {
    let view = |number: u32| {
        let view = told.views.get(number as usize);
        view.map_or_else(String::new, |view| match view.facing() {
            v1::CausalFacing::Outward => format!("out {}", view.seen),
            _ => format!("in {}", view.seen),
        })
    };
    let schema = |schema: &v1::CausalSchema| {
        let action = schema.action().as_str_name().trim_start_matches("CAUSAL_ACTION_");
        let action = action.to_lowercase().replace('_', " ");
        let turn = match schema.action() {
            v1::CausalAction::Travel => String::new(),
            _ => format!(" {}", schema.turn),
        };
        let outcomes: Vec<String> = schema
            .outcomes
            .iter()
            .map(|outcome| format!("{} {:?}", view(outcome.view), outcome.visits))
            .collect();
        let apart = if schema.tells_apart { " (different places)" } else { "" };
        format!("<{}, {action}{turn}> -> {}{apart}", view(schema.view), outcomes.join(" or "))
    };
    let mut lines: Vec<String> = told.schemas.iter().map(schema).collect();
    lines.extend(told.told_apart.iter().map(|pair| {
        let v1::ToldApart { visit, earlier, travels } = pair;
        format!(
            "visits {earlier} and {visit} look alike and are not, as {travels} travels on shows"
        )
    }));
    let more = (told.told_apart_count as usize).saturating_sub(told.told_apart.len());
    if 0 < more {
        lines.push(format!("and {more} more such pairs"));
    }
    lines.push(format!(
        "{} views and {} schemas of {} visits of session {}",
        told.views.len(),
        told.schemas.len(),
        told.visits,
        told.session
    ));
    lines.join("\n") + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::convert::causal;

    #[test]
    fn people_are_told_what_tells_places_apart() {
        let travel = "abb 1:abab 2:ab 1:abb 1:ab".parse().expect("a travel");
        let text = in_words(&causal::to_wire(&travel));
        for line in [
            "<in abb, turn 1> -> out aab [0, 3]\n",
            "<out aab, travel> -> in abab [0] or in ab [3] (different places)\n",
            "<in abab, go straight 2> -> out abab [1]\n",
            "visits 0 and 3 look alike and are not, as 1 travels on shows\n",
        ] {
            assert!(text.contains(line), "{line} in\n{text}");
        }
    }
}
