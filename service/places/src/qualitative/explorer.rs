//! The explorer: from place to place until nothing is left on the agenda (KB 1988, sections 2.4, 2.5).

use std::f64::consts::PI;

use meetpoint_geometry::{Point2, angle_between};

use super::arrival::Arrival;
use super::heading_error::HeadingError;
use super::itinerary::Itinerary;
use super::outlook::Outlook;
use super::pilot::{Outcome, Pilot, PilotParams};
use super::place_graph::PlaceGraph;
use super::readings::{Command, Readings};
use super::trial::{Next, Rehearsing, Trial, turned_against};
use crate::place_map::{Gateway, PlaceId};

/// Of several directions to explore at a place, which comes first (KB 1988, section 3).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SelectionRule {
    /// The one that needs the least rotation.
    LeastRotation,
    /// The one that needs the most, so that what is explored grows all around.
    MostRotation,
}

/// How NX explores.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExplorerParams {
    /// How it moves.
    pub pilot: PilotParams,
    /// Which direction comes first.
    pub selection: SelectionRule,
    /// How far a known place may seem turned.
    pub heading_error: HeadingError,
    /// A position by dead reckoning may be off by this share of the way; `+inf` if it tells nothing.
    pub drift_share: f64,
    /// And by this, in metres: where on a place's summit a robot stops.
    pub position_slack_m: f64,
    /// A rehearsal leads so many edges away, at most: the paper's "search radius".
    pub n_rehearsal_edges_max: usize,
    /// Gives up with more places than these.
    pub n_places_max: usize,
}

impl ExplorerParams {
    /// The paper's robot, with its compass, in corridors of about 2 m.
    pub const NX: Self = Self {
        pilot: PilotParams::CORRIDORS_OF_2_M,
        selection: SelectionRule::LeastRotation,
        heading_error: HeadingError { slack_rad: 0.6, drift_rad_per_m: 0.0 },
        drift_share: 0.06,
        position_slack_m: 1.5,
        n_rehearsal_edges_max: 1,
        n_places_max: 200,
    };

    /// The same without a compass: headings are summed up from the turns of its wheels.
    pub const NX_WITHOUT_COMPASS: Self = Self {
        heading_error: HeadingError { drift_rad_per_m: 0.01, ..Self::NX.heading_error },
        drift_share: 0.15,
        n_rehearsal_edges_max: 2,
        ..Self::NX
    };
}

/// What the explorer is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExplorerState {
    /// Looking for the first place.
    Starting,
    /// On the way into the unknown.
    Exploring,
    /// Testing whether a place is one that it knows.
    Rehearsing,
    /// On the way to a place that has something unexplored.
    Travelling,
    /// Everything is explored.
    Complete,
    /// There are more places than it may keep.
    GaveUp,
}

/// Where a robot is, topologically (KB 1988, section 2.4).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Whereabouts {
    /// At a place.
    AtPlace {
        /// Which gateway it came by.
        came_by: Gateway,
        /// Where it looks.
        heading_rad: f64,
    },
    /// On an edge.
    OnEdge {
        /// Where it left; `None` before the first place.
        since: Option<Gateway>,
        /// Where it looks.
        heading_rad: f64,
    },
    /// Rehearsing: beyond a gateway into the unexplored is a known place, or a new one that looks
    /// like it, and the robot is on its way to find out.
    InQuestion {
        /// Where it left, into the unexplored.
        since: Gateway,
        /// Where it may have come in there.
        may_be: Gateway,
        /// Where it looks.
        heading_rad: f64,
    },
}

#[derive(Clone, Debug)]
enum Purpose {
    Start,
    Explore { from: Gateway },
    Travel { from: Gateway },
    Rehearse { trial: Box<Trial>, candidate: Gateway },
    Nothing,
}

/// NX, as a state machine: readings in, small motions out.
#[derive(Clone, Debug)]
pub struct Explorer {
    params: ExplorerParams,
    pilot: Pilot,
    graph: PlaceGraph,
    purpose: Purpose,
    state: ExplorerState,
    /// The place where the robot is or was last, by the gateway that it came by, and as it looks now.
    here: Option<(Gateway, Arrival)>,
    itinerary: Itinerary,
    /// Metres of dead reckoning since the last place.
    way_m: f64,
    n_rehearsals: u32,
    n_refuted: u32,
    n_surprises: u32,
}

impl Explorer {
    /// An explorer that knows nothing.
    pub fn new(params: ExplorerParams) -> Self {
        Self {
            params,
            pilot: Pilot::new(params.pilot),
            graph: PlaceGraph::default(),
            purpose: Purpose::Start,
            state: ExplorerState::Starting,
            here: None,
            itinerary: Itinerary::default(),
            way_m: 0.0,
            n_rehearsals: 0,
            n_refuted: 0,
            n_surprises: 0,
        }
    }

    /// What is known so far.
    pub fn graph(&self) -> &PlaceGraph {
        &self.graph
    }

    /// Every place where it arrived, as it looked then: what it made of that is left out.
    pub fn itinerary(&self) -> &Itinerary {
        &self.itinerary
    }

    pub(crate) fn itinerary_mut(&mut self) -> &mut Itinerary {
        &mut self.itinerary
    }

    /// What it is about.
    pub fn state(&self) -> ExplorerState {
        self.state
    }

    /// How it explores.
    pub fn params(&self) -> &ExplorerParams {
        &self.params
    }

    /// Which direction comes first from now on.
    pub fn select(&mut self, selection: SelectionRule) {
        self.params.selection = selection;
    }

    /// Says that a place is "home" from now on, the only one where the robot sees that mark, or that it is not;
    /// false if there is no such place.
    pub fn mark_home(&mut self, place: PlaceId, is_home: bool) -> bool {
        self.graph.mark(place, is_home)
    }

    /// What the newest readings say; `None` before the first.
    pub fn outlook(&self) -> Option<Outlook> {
        self.pilot.outlook()
    }

    /// The rehearsal under way, if there is one.
    pub fn rehearsing(&self) -> Option<Rehearsing> {
        let Purpose::Rehearse { trial, candidate } = &self.purpose else { return None };
        Some(trial.rehearsing(*candidate))
    }

    /// The place where the robot is or was last, by the gateway that it came by; `None` before the first.
    pub fn last_place(&self) -> Option<Gateway> {
        self.here.as_ref().map(|(came_by, _)| *came_by)
    }

    /// Rehearsals begun.
    pub fn n_rehearsals(&self) -> u32 {
        self.n_rehearsals
    }

    /// Rehearsals that went otherwise than predicted.
    pub fn n_refuted(&self) -> u32 {
        self.n_refuted
    }

    /// How often a place did not look as known at the end of a known edge.
    pub fn n_surprises(&self) -> u32 {
        self.n_surprises
    }

    /// Where the robot is.
    pub fn whereabouts(&self) -> Whereabouts {
        let heading_rad = self.pilot.heading_rad();
        match (&self.purpose, &self.here) {
            (Purpose::Rehearse { trial, candidate }, _) => {
                Whereabouts::InQuestion { since: trial.from, may_be: *candidate, heading_rad }
            }
            (Purpose::Explore { from } | Purpose::Travel { from }, _)
                if !self.pilot.is_at_place() =>
            {
                Whereabouts::OnEdge { since: Some(*from), heading_rad }
            }
            (_, Some((came_by, _))) => Whereabouts::AtPlace { came_by: *came_by, heading_rad },
            (_, None) => Whereabouts::OnEdge { since: None, heading_rad },
        }
    }

    /// Takes in what the robot reads, and says what it is to do next. Afterwards it reads again.
    pub fn next(&mut self, readings: &Readings) -> Command {
        self.way_m += readings.moved_m.abs();
        if matches!(self.purpose, Purpose::Nothing) {
            return Command::Done;
        }
        match self.pilot.next(readings) {
            Outcome::Under(command) => command,
            Outcome::Arrived(arrival) => {
                self.arrived(*arrival);
                if matches!(self.purpose, Purpose::Nothing) { Command::Done } else { Command::Look }
            }
        }
    }

    fn arrived(&mut self, arrival: Arrival) {
        self.itinerary.arrived(&arrival);
        match std::mem::replace(&mut self.purpose, Purpose::Nothing) {
            Purpose::Start => self.take_as_new(None, arrival),
            Purpose::Explore { from } => {
                let candidates = self.candidates(from.place, &arrival);
                self.try_next(Trial::new(from, self.way_m, arrival, candidates));
            }
            Purpose::Travel { from } => self.travelled(from, arrival),
            Purpose::Rehearse { mut trial, candidate } => {
                match trial.arrived(&arrival, &self.graph, &self.params.heading_error) {
                    Next::Leave(heading_rad) => {
                        self.leave(heading_rad);
                        self.purpose = Purpose::Rehearse { trial, candidate };
                    }
                    Next::Back(is_as_predicted) => {
                        self.judge(*trial, candidate, &arrival, is_as_predicted);
                    }
                }
            }
            Purpose::Nothing => {}
        }
    }

    fn leave(&mut self, heading_rad: f64) {
        self.itinerary.left(heading_rad);
        self.pilot.leave(heading_rad);
    }

    /// Unexplored gateways of known places that a robot may have come in by, the likeliest last.
    fn candidates(&self, from: PlaceId, arrival: &Arrival) -> Vec<Gateway> {
        let off_m = |place: PlaceId| {
            let known = self.graph.place(place).map(|known| known.seen.position);
            known.map_or(f64::INFINITY, |at: Point2<f64>| (at - arrival.position).norm())
        };
        // A way that leads back to where it began turns by a whole turn, less than half of it there
        // (H. Hopf, Umlaufsatz).
        let turned_rad = arrival.traversal.map_or(0.0, |traversal| traversal.turned_rad.abs());
        let may_close = |place: PlaceId| place != from || 0.8 * PI < turned_rad;
        let may_be = |gateway: &Gateway| {
            let way_m = self.way_m + self.graph.reckoned_m(from, gateway.place);
            let reach_m = self.params.position_slack_m + self.params.drift_share * way_m;
            let turned = turned_against(
                arrival,
                &self.graph,
                *gateway,
                0.0,
                self.params.heading_error.after_rad(way_m),
            );
            off_m(gateway.place) <= reach_m && turned.is_some() && may_close(gateway.place)
        };
        let mut found: Vec<Gateway> = self.graph.agenda().filter(may_be).collect();
        found.sort_by(|a, b| off_m(b.place).total_cmp(&off_m(a.place)));
        found
    }

    /// Tests the next candidate, or takes the place for a new one.
    fn try_next(&mut self, mut trial: Trial) {
        // The gateway where the robot left cannot be the one where it came in.
        trial.candidates.retain(|candidate| *candidate != trial.from);
        let Some(candidate) = trial.candidates.pop() else {
            self.take_as_new(Some(trial.from), trial.seen);
            return;
        };
        let route = self.graph.rehearsal(candidate.place, self.params.n_rehearsal_edges_max);
        // Where no known edge could tell, only dead reckoning or the mark of home does.
        let is_told = trial.seen.is_home || self.params.drift_share.is_finite();
        match trial.begin(candidate, route, &self.graph) {
            Some(heading_rad) if !trial.seen.is_home => {
                self.n_rehearsals += 1;
                self.state = ExplorerState::Rehearsing;
                self.leave(heading_rad);
                self.purpose = Purpose::Rehearse { trial: Box::new(trial), candidate };
            }
            _ if is_told => self.take_as_known(trial.from, candidate, trial.seen),
            _ => self.try_next(trial),
        }
    }

    /// Back from a rehearsal.
    fn judge(
        &mut self,
        trial: Trial,
        candidate: Gateway,
        arrival: &Arrival,
        is_as_predicted: bool,
    ) {
        // Dead reckoning goes on from the first arrival: the way there and back told nothing.
        self.way_m = trial.way_m;
        self.pilot.set_position(trial.seen.position);
        if let Some(turned_rad) = arrival.turned_against(&trial.seen, trial.left_by(candidate)) {
            self.turn_frame(turned_rad);
        }
        if is_as_predicted {
            self.take_as_known(trial.from, candidate, trial.seen);
        } else {
            self.n_refuted += 1;
            self.try_next(trial);
        }
    }

    fn take_as_new(&mut self, from: Option<Gateway>, seen: Arrival) {
        if self.params.n_places_max <= self.graph.map().n_places() {
            self.state = ExplorerState::GaveUp;
            return;
        }
        let place = self.graph.add(seen.clone(), from.map(|from| (from.place, self.way_m)));
        self.way_m = 0.0;
        let came_by = Gateway { place, index: 0 };
        if let (Some(from), Some(traversal)) = (from, &seen.traversal) {
            self.graph.link(from, came_by, traversal);
        }
        self.go_on(came_by, seen);
    }

    fn take_as_known(&mut self, from: Gateway, came_by: Gateway, seen: Arrival) {
        if let Some(traversal) = &seen.traversal {
            self.graph.link(from, came_by, traversal);
        }
        let seen = self.recognise(came_by, seen);
        self.go_on(came_by, seen);
    }

    /// Dead reckoning begins anew at a place that is known: what is seen, as it looks from then on.
    fn recognise(&mut self, came_by: Gateway, seen: Arrival) -> Arrival {
        let Some(known) = self.graph.place(came_by.place) else { return seen };
        self.way_m = 0.0;
        self.pilot.set_position(known.seen.position);
        let seen = match seen.turned_against(&known.seen, came_by.index) {
            Some(turned_rad) if self.turn_frame(turned_rad) => seen.turned(-turned_rad),
            _ => seen,
        };
        self.graph.visited(came_by, &seen);
        seen
    }

    /// Takes it that what was seen is turned because the robot's headings have drifted; false with a
    /// compass, which does not drift.
    fn turn_frame(&mut self, turned_rad: f64) -> bool {
        let has_drifted = !self.params.heading_error.is_compass();
        if has_drifted {
            self.pilot.turn_frame(turned_rad);
            self.itinerary.turn_frame(turned_rad);
        }
        has_drifted
    }

    /// At the end of a known edge.
    fn travelled(&mut self, from: Gateway, arrival: Arrival) {
        let Some(at) = self.graph.map().leads_to(from) else { return };
        let way_m = self.way_m + self.graph.reckoned_m(from.place, at.place);
        let turn_max_rad = self.params.heading_error.after_rad(way_m);
        let seen = match turned_against(&arrival, &self.graph, at, 0.0, turn_max_rad) {
            Some(_) => {
                if let Some(traversal) = &arrival.traversal {
                    self.graph.travelled(from, traversal);
                }
                self.recognise(at, arrival)
            }
            None => {
                // The edge is known better than a look is sure.
                self.n_surprises += 1;
                let Some(known) = self.graph.place(at.place) else { return };
                known.seen.clone().come_by(usize::from(at.index))
            }
        };
        self.go_on(at, seen);
    }

    /// At a place that is in the graph: to the next direction on the agenda.
    fn go_on(&mut self, came_by: Gateway, seen: Arrival) {
        let agenda = self.graph.map().agenda(came_by);
        let rotation_rad = |gateway: Gateway| {
            let heading_rad = seen.heading_to(came_by.index, gateway.index);
            angle_between(self.pilot.heading_rad(), heading_rad).abs()
        };
        let here = agenda.iter().filter(|(gateway, _)| gateway.place == came_by.place);
        let by_rotation = |a: &&(Gateway, Vec<u8>), b: &&(Gateway, Vec<u8>)| {
            rotation_rad(a.0).total_cmp(&rotation_rad(b.0))
        };
        let chosen = match self.params.selection {
            SelectionRule::LeastRotation => here.min_by(by_rotation),
            SelectionRule::MostRotation => here.max_by(by_rotation),
        };
        // Elsewhere, at the nearest place: the first turn towards it.
        let turn = chosen.or(agenda.first()).and_then(|(_, turns)| turns.first().copied());
        let Some(turn) = turn else {
            self.here = Some((came_by, seen));
            self.state = ExplorerState::Complete;
            return;
        };
        let from = self.graph.map().turned(came_by, turn);
        self.leave(seen.heading_to(came_by.index, from.index));
        self.here = Some((came_by, seen));
        (self.purpose, self.state) = if self.graph.map().leads_to(from).is_some() {
            (Purpose::Travel { from }, ExplorerState::Travelling)
        } else {
            (Purpose::Explore { from }, ExplorerState::Exploring)
        };
    }
}
