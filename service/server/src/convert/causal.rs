//! Causal schemas on the wire.

use meetpoint_places::{
    Action, CausalView, CausalWorld, Facing, Outcome, ToldApart, Travel, TurnSide, causal_world,
    told_apart,
};
use meetpoint_proto::v1;

use super::hypothesis::small;

/// Pairs of visits that are told.
const N_TOLD_APART_MAX: usize = 1000;

/// What a travel says of views and actions, without whose it is.
pub(crate) fn to_wire(travel: &Travel) -> v1::ListCausalSchemasResponse {
    let world = causal_world(travel);
    let apart = told_apart(travel);
    let views = world.views.iter().enumerate().map(|(number, view)| {
        let CausalView { facing, seen } = view;
        let facing = match facing {
            Facing::Inward => v1::CausalFacing::Inward,
            Facing::Outward => v1::CausalFacing::Outward,
        };
        v1::CausalView { number: small(number), facing: facing.into(), seen: seen.to_string() }
    });
    v1::ListCausalSchemasResponse {
        visits: small(travel.steps.len() + 1),
        views: views.collect(),
        schemas: schemas(&world),
        told_apart: apart.iter().take(N_TOLD_APART_MAX).map(pair).collect(),
        told_apart_count: small(apart.len()),
        ..v1::ListCausalSchemasResponse::default()
    }
}

fn schemas(world: &CausalWorld) -> Vec<v1::CausalSchema> {
    let outcome = |Outcome { view, visits }: &Outcome| v1::CausalOutcome {
        view: small(*view),
        visits: visits.iter().copied().map(small).collect(),
    };
    let numbered = world.schemas.iter().enumerate().map(|(number, schema)| {
        let (action, turn) = action(schema.action);
        v1::CausalSchema {
            number: small(number),
            view: small(schema.view),
            action: action.into(),
            turn: turn.into(),
            outcomes: schema.outcomes.iter().map(outcome).collect(),
            tells_apart: world.tells_apart(schema),
        }
    });
    numbered.collect()
}

fn action(action: Action) -> (v1::CausalAction, u8) {
    match action {
        Action::Travel => (v1::CausalAction::Travel, 0),
        Action::Turn { gateways, side } => {
            let action = match side {
                TurnSide::Around => v1::CausalAction::TurnAround,
                TurnSide::Straight => v1::CausalAction::GoStraight,
                TurnSide::Left => v1::CausalAction::TurnLeft,
                TurnSide::Right => v1::CausalAction::TurnRight,
                TurnSide::Ended => v1::CausalAction::Turn,
            };
            (action, gateways)
        }
    }
}

fn pair(pair: &ToldApart) -> v1::ToldApart {
    let ToldApart { visit, earlier, n_travels } = *pair;
    v1::ToldApart { visit: small(visit), earlier: small(earlier), travels: small(n_travels) }
}
