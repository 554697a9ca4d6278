//! Causal schemas: REST's JSON as messages.

use meetpoint_client::v1;
use serde_json::Value;

use crate::from_json::{present, rows, small, text, truth};

pub(crate) fn schemas(body: &Value) -> v1::ListCausalSchemasResponse {
    let view = |of: &Value| {
        let name = format!("CAUSAL_FACING_{}", text(&of["facing"]));
        let facing = v1::CausalFacing::from_str_name(&name).expect("inward or outward");
        v1::CausalView {
            number: small(&of["number"]),
            facing: facing.into(),
            seen: text(&of["seen"]),
        }
    };
    let outcome = |of: &Value| v1::CausalOutcome {
        view: small(&of["view"]),
        visits: rows(&of["visits"], small),
    };
    let schema = |of: &Value| {
        let name = format!("CAUSAL_ACTION_{}", text(&of["action"]));
        let action = v1::CausalAction::from_str_name(&name).expect("an action");
        v1::CausalSchema {
            number: small(&of["number"]),
            view: small(&of["view"]),
            action: action.into(),
            turn: present(of, "turn").map_or(0, small),
            outcomes: rows(&of["outcomes"], outcome),
            tells_apart: truth(&of["tells_apart"]),
        }
    };
    let pair = |of: &Value| v1::ToldApart {
        visit: small(&of["visit"]),
        earlier: small(&of["earlier"]),
        travels: small(&of["travels"]),
    };
    v1::ListCausalSchemasResponse {
        map: text(&body["map"]),
        session: text(&body["session"]),
        visits: small(&body["visits"]),
        by_steps: truth(&body["by_steps"]),
        views: rows(&body["views"], view),
        schemas: rows(&body["schemas"], schema),
        told_apart: rows(&body["told_apart"], pair),
        told_apart_count: small(&body["told_apart_count"]),
    }
}
