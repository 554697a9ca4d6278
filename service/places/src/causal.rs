//! Causal schemas: what a robot saw, what it did then, and what it saw next, before there is any place.
//!
//! The second level of the Spatial Semantic Hierarchy (HSSH 2004, section II): schemas `<x, a, x'>` between
//! states and `view(x, v)`. A visit has two states: facing inward at the gateway where the robot came in, and
//! facing outward at the one by which it left; a turn leads from the one to the other, a travel from there to
//! the next visit. The view at a state is the star as read from that gateway (section III-D), and the place's
//! looks where somebody compared them.
//!
//! Views and schemas are numbered from 0 in the order in which they were met, so that a longer travel
//! only adds to them. Where one view and action had different outcomes, the states were different ones: that is what
//! tells places apart that look alike. Time O(steps log steps), and O(steps²) of [`told_apart`].

use std::collections::BTreeMap;
use std::fmt;

use crate::observation::Observation;
use crate::travel::Travel;

/// Which way a robot looks that stands in a gateway.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Facing {
    /// It has just come in.
    Inward,
    /// It is about to leave.
    Outward,
}

/// What is seen at a distinctive state.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct CausalView {
    /// Which way the robot looks.
    pub facing: Facing,
    /// The place, its star read from the gateway in which the robot stands.
    pub seen: Observation,
}

/// To which side one turns who came in by one gateway and leaves by another; by the order of the star, without
/// any angle (section III-C).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum TurnSide {
    /// Out again where one came in.
    Around,
    /// On along the path.
    Straight,
    /// Through a gateway on the left of the path.
    Left,
    /// Through a gateway on the right of the path.
    Right,
    /// The path that was come by ends here: it has no sides.
    Ended,
}

/// What a robot does at a distinctive state.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Action {
    /// From where it came in to the gateway so many further on, clockwise: 0 is where it came in.
    Turn {
        /// How many further on.
        gateways: u8,
        /// To which side that is.
        side: TurnSide,
    },
    /// Along the path to the next place.
    Travel,
}

/// What came of an action.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Outcome {
    /// The view afterwards, by its number.
    pub view: usize,
    /// The visits at which the action was begun, ascending.
    pub visits: Vec<usize>,
}

/// A view, an action, and every view that it led to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CausalSchema {
    /// The view before, by its number.
    pub view: usize,
    /// What was done.
    pub action: Action,
    /// In the order in which they were met; at least one.
    pub outcomes: Vec<Outcome>,
}

/// What a travel says of views and actions.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CausalWorld {
    /// Every view, by its number.
    pub views: Vec<CausalView>,
    /// Every view and action.
    pub schemas: Vec<CausalSchema>,
}

impl CausalWorld {
    /// Whether the same was done at what looked the same, with outcomes that no place has both: the states were
    /// different ones.
    pub fn tells_apart(&self, schema: &CausalSchema) -> bool {
        let outcomes = || schema.outcomes.iter().map(|outcome| &self.views[outcome.view].seen);
        outcomes().any(|one| outcomes().any(|other| differ(one, other)))
    }
}

/// Two visits that looked alike, and were to different states as what followed shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ToldApart {
    /// The later one.
    pub visit: usize,
    /// The earlier one.
    pub earlier: usize,
    /// After so many turns and travels, the same from both, another view was seen; at least 1.
    pub n_travels: usize,
}

/// The side of the gateway `gateways` further on than the one that the star is read from.
pub(crate) fn side(seen: &Observation, gateways: u8) -> TurnSide {
    match seen.star.continuation(0) {
        _ if gateways == 0 => TurnSide::Around,
        None => TurnSide::Ended,
        Some(onward) if gateways == onward => TurnSide::Straight,
        // Clockwise from behind the left side comes first.
        Some(onward) if gateways < onward => TurnSide::Left,
        Some(_) => TurnSide::Right,
    }
}

/// Whether no place looks so both times. Looks that were not compared fit all.
fn differ(one: &Observation, other: &Observation) -> bool {
    one.star != other.star || !one.fits(other.view.as_ref())
}

/// The schemas of a travel.
pub fn causal_world(travel: &Travel) -> CausalWorld {
    let mut world = CausalWorld::default();
    let mut views = BTreeMap::new();
    let mut schemas = BTreeMap::new();
    let mut arrived = number(&mut world.views, &mut views, inward(&travel.first));
    let mut here = &travel.first;
    for (visit, step) in travel.steps.iter().enumerate() {
        let action = Action::Turn { gateways: step.turn, side: side(here, step.turn) };
        let left = number(&mut world.views, &mut views, outward(here, step.turn));
        met(&mut world.schemas, &mut schemas, (arrived, action), (left, visit));
        arrived = number(&mut world.views, &mut views, inward(&step.seen));
        met(&mut world.schemas, &mut schemas, (left, Action::Travel), (arrived, visit));
        here = &step.seen;
    }
    world
}

/// Pairs of visits that looked alike on arrival and were to different states, by the later visit, then the
/// earlier: from both the robot made the same turns, as long as it saw the same, and then saw something else.
pub fn told_apart(travel: &Travel) -> Vec<ToldApart> {
    let n_visits = travel.steps.len() + 1;
    let are_different = |visit, earlier| {
        let seen = travel.seen(visit).zip(travel.seen(earlier));
        seen.is_some_and(|(one, other)| differ(one, other))
    };
    let mut apart = Vec::new();
    // Of the visit after this one against every earlier: after how many travels another view was seen.
    let mut next: Vec<Option<usize>> = vec![None; n_visits + 1];
    for visit in (0..n_visits).rev() {
        let mut now = vec![None; n_visits + 1];
        for earlier in 0..visit {
            now[earlier] = if are_different(visit, earlier) {
                Some(0)
            } else {
                let turns = [visit, earlier].map(|at| travel.steps.get(at).map(|step| step.turn));
                let is_same = turns[0].is_some() && turns[0] == turns[1];
                next[earlier + 1].filter(|_| is_same).map(|n_travels| n_travels + 1)
            };
            if let Some(n_travels) = now[earlier].filter(|&n_travels| 0 < n_travels) {
                apart.push(ToldApart { visit, earlier, n_travels });
            }
        }
        next = now;
    }
    apart.sort_unstable();
    apart
}

fn inward(seen: &Observation) -> CausalView {
    CausalView { facing: Facing::Inward, seen: seen.clone() }
}

fn outward(seen: &Observation, gateway: u8) -> CausalView {
    let Observation { star, view } = seen;
    let seen = Observation { star: star.read_from(gateway), view: view.clone() };
    CausalView { facing: Facing::Outward, seen }
}

/// The number of a view, which is given one if it is new.
fn number(
    views: &mut Vec<CausalView>,
    known: &mut BTreeMap<CausalView, usize>,
    view: CausalView,
) -> usize {
    *known.entry(view).or_insert_with_key(|view| {
        views.push(view.clone());
        views.len() - 1
    })
}

/// Takes in that an action at a visit had an outcome.
fn met(
    schemas: &mut Vec<CausalSchema>,
    known: &mut BTreeMap<(usize, Action), usize>,
    (view, action): (usize, Action),
    (outcome, visit): (usize, usize),
) {
    let at = *known.entry((view, action)).or_insert_with(|| {
        schemas.push(CausalSchema { view, action, outcomes: Vec::new() });
        schemas.len() - 1
    });
    let outcomes = &mut schemas[at].outcomes;
    match outcomes.iter_mut().find(|known| known.view == outcome) {
        Some(known) => known.visits.push(visit),
        None => outcomes.push(Outcome { view: outcome, visits: vec![visit] }),
    }
}

/// `in aba@hall` or `out aba`.
impl fmt::Display for CausalView {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let facing = match self.facing {
            Facing::Inward => "in",
            Facing::Outward => "out",
        };
        write!(f, "{facing} {}", self.seen)
    }
}
