//! A topological map: places, their gateways, and which gateway leads to which.

use std::collections::{BTreeSet, VecDeque};
use std::sync::Arc;

use crate::observation::{Observation, View};
use crate::star::Star;

/// A place of one map: in the maps of a tree they are numbered by first arrival. In another map
/// the same number may be another place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PlaceId(pub u32);

/// A gateway of a place. A robot that arrived through it is said to be at it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Gateway {
    /// Whose gateway.
    pub place: PlaceId,
    /// Which of the place's star, clockwise; in the maps of a tree 0 is the one of the first
    /// arrival.
    pub index: u8,
}

/// A place, as a map knows it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// Its local topology.
    pub star: Star,
    /// What else is known of its looks, by any visit.
    pub view: Option<View>,
    /// Where its gateways begin among those of all places.
    first_slot: usize,
}

/// A path at one of its places.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pass {
    /// The place.
    pub place: PlaceId,
    /// The gateway by which the path comes in; `None` if it begins here.
    pub enters: Option<u8>,
    /// The gateway by which it leaves; `None` if it ends here.
    pub leaves: Option<u8>,
}

/// Places and how their gateways hang together.
///
/// Invariant: links are mutual, and none leads from a gateway to itself.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct PlaceMap {
    /// Shared with the maps that this one was extended from and into.
    places: Vec<Arc<Place>>,
    /// Of every gateway, place by place: where it leads, if that is known.
    links: Vec<Option<Gateway>>,
    n_links: usize,
    n_paths: usize,
}

impl PlaceMap {
    /// Number of places.
    pub fn n_places(&self) -> usize {
        self.places.len()
    }

    /// Number of known edges between places.
    pub fn n_edges(&self) -> usize {
        self.n_links
    }

    /// Number of paths: path fragments that are not known to continue each other count as several.
    pub fn n_paths(&self) -> usize {
        self.n_paths
    }

    /// Memory that the map takes, without places, which maps of one tree share, in bytes.
    pub(crate) fn n_bytes(&self) -> usize {
        self.places.capacity() * size_of::<Arc<Place>>()
            + self.links.capacity() * size_of::<Option<Gateway>>()
    }

    /// All paths, each as its places in order: as many as [`Self::n_paths`]. A circular one is
    /// listed from its lowest place. O(gateways).
    pub fn paths(&self) -> Vec<Vec<PlaceId>> {
        let places = |path: Vec<Pass>| path.into_iter().map(|pass| pass.place).collect();
        self.passes().into_iter().map(places).collect()
    }

    /// The same with the gateways by which each path enters and leaves its places.
    pub fn passes(&self) -> Vec<Vec<Pass>> {
        let mut listed: BTreeSet<Gateway> = BTreeSet::new();
        let mut paths = Vec::new();
        // Where one comes in who follows a path from its end, or from anywhere where it has none.
        let ends = self.gateways().filter(|&gateway| {
            self.leads_to(gateway).is_none() || self.continuation(gateway).is_none()
        });
        for end in ends.chain(self.gateways()) {
            if listed.contains(&end) {
                continue;
            }
            let mut path = Vec::new();
            let mut at = Some(end);
            if self.leads_to(end).is_some() && self.continuation(end).is_none() {
                listed.insert(end);
                path.push(Pass { place: end.place, enters: None, leaves: Some(end.index) });
                at = self.leads_to(end);
            }
            for gateway in at.into_iter().flat_map(|at| self.path_inward(at)) {
                let onward = self.continuation(gateway);
                listed.extend([Some(gateway), onward].into_iter().flatten());
                path.push(Pass {
                    place: gateway.place,
                    enters: Some(gateway.index),
                    leaves: onward.map(|onward| onward.index),
                });
            }
            paths.push(path);
        }
        paths
    }

    /// All places, in the order of their ids.
    pub fn places(&self) -> impl Iterator<Item = (PlaceId, &Place)> {
        (0..).map(PlaceId).zip(self.places.iter().map(AsRef::as_ref))
    }

    /// The place of that id, if there is one.
    pub fn place(&self, id: PlaceId) -> Option<&Place> {
        self.places.get(id.0 as usize).map(AsRef::as_ref)
    }

    /// All gateways of all places.
    pub fn gateways(&self) -> impl Iterator<Item = Gateway> {
        let of = |(place, known): (PlaceId, &Place)| {
            (0..known.star.n_gateways()).map(move |index| Gateway { place, index })
        };
        self.places().flat_map(of)
    }

    /// Where one arrives who leaves through `gateway`; `None` if nobody has been there.
    pub fn leads_to(&self, gateway: Gateway) -> Option<Gateway> {
        self.links[self.known(gateway.place).first_slot + usize::from(gateway.index)]
    }

    /// The gateway where the path of `gateway` leaves the same place again, if it passes.
    pub fn continuation(&self, gateway: Gateway) -> Option<Gateway> {
        let index = self.known(gateway.place).star.continuation(gateway.index)?;
        Some(Gateway { index, ..gateway })
    }

    /// The gateway `turn` further clockwise at the same place.
    pub fn turned(&self, gateway: Gateway, turn: u8) -> Gateway {
        let n_gateways = self.known(gateway.place).star.n_gateways();
        // At most 32 gateways: the sum is far below 256.
        Gateway { index: (gateway.index + turn % n_gateways) % n_gateways, ..gateway }
    }

    /// The gateway `turn` further back, counter-clockwise, at the same place.
    pub(crate) fn turned_back(&self, gateway: Gateway, turn: u8) -> Gateway {
        let n_gateways = self.known(gateway.place).star.n_gateways();
        Gateway { index: (gateway.index + n_gateways - turn % n_gateways) % n_gateways, ..gateway }
    }

    /// What one sees who arrives at `gateway`.
    pub fn observation(&self, gateway: Gateway) -> Observation {
        let place = self.known(gateway.place);
        Observation { star: place.star.read_from(gateway.index), view: place.view.clone() }
    }

    /// Whether one who arrives at `gateway` may see `seen` there.
    pub fn may_look(&self, gateway: Gateway, seen: &Observation) -> bool {
        let place = self.known(gateway.place);
        seen.fits(place.view.as_ref()) && place.star.looks_from(gateway.index, &seen.star)
    }

    /// All gateways on the way of one who stands at `from` and makes these turns: `from`, and
    /// where each travel ends. `None` once an edge is not known.
    pub fn arrivals(
        &self,
        from: Gateway,
        turns: impl IntoIterator<Item = u8>,
    ) -> Option<Vec<Gateway>> {
        let mut arrivals = vec![from];
        let mut at = from;
        for turn in turns {
            at = self.leads_to(self.turned(at, turn))?;
            arrivals.push(at);
        }
        Some(arrivals)
    }

    /// The exploration agenda: for every gateway that nobody left or came in through, the turns
    /// of a shortest travel from `from` to beyond it; nearest first, then clockwise.
    ///
    /// A breadth-first search, O(gateways).
    pub fn agenda(&self, from: Gateway) -> Vec<(Gateway, Vec<u8>)> {
        self.nearest(from, |gateway| self.leads_to(gateway).is_none())
    }

    /// The gateways that are wanted, each with the turns of a shortest travel from `from` to beyond
    /// it; nearest first, then clockwise.
    pub(crate) fn nearest(
        &self,
        from: Gateway,
        is_wanted: impl Fn(Gateway) -> bool,
    ) -> Vec<(Gateway, Vec<u8>)> {
        let mut reached = vec![false; self.places.len()];
        let mut queue = VecDeque::from([(from, Vec::new())]);
        let mut found = Vec::new();
        reached[from.place.0 as usize] = true;
        while let Some((at, turns)) = queue.pop_front() {
            for turn in 0..self.known(at.place).star.n_gateways() {
                let gateway = self.turned(at, turn);
                let beyond = || turns.iter().copied().chain([turn]).collect::<Vec<u8>>();
                if is_wanted(gateway) {
                    found.push((gateway, beyond()));
                }
                if let Some(next) = self.leads_to(gateway)
                    && !reached[next.place.0 as usize]
                {
                    reached[next.place.0 as usize] = true;
                    queue.push_back((next, beyond()));
                }
            }
        }
        found
    }

    /// A map of places that look so from their gateways 0, and of edges between gateways. `None` if an edge has
    /// an end that no place has, or that another edge has.
    pub fn joined(places: &[Observation], edges: &[[Gateway; 2]]) -> Option<Self> {
        let mut map = Self::default();
        for seen in places {
            map.add_place(seen);
        }
        for &[a, b] in edges {
            let is_free = |end: Gateway| {
                map.gateways().any(|known| known == end) && map.leads_to(end).is_none()
            };
            if a == b || !is_free(a) || !is_free(b) {
                return None;
            }
            map.link(a, b);
        }
        Some(map)
    }

    /// Adds a place that looks as seen; its gateway 0 is the one it is seen from.
    ///
    /// # Panics
    /// Never: a place is tens of bytes, and so many would be more than any memory holds.
    pub(crate) fn add_place(&mut self, seen: &Observation) -> PlaceId {
        let n_places = u32::try_from(self.places.len()).expect("fewer than 2^32 places");
        let first_slot = self.links.len();
        self.links.resize(first_slot + seen.star.openings().len(), None);
        self.n_paths += seen.star.n_fragments();
        let Observation { star, view } = seen.clone();
        self.places.push(Arc::new(Place { star, view, first_slot }));
        PlaceId(n_places)
    }

    /// Says that `a` leads to `b` and back. Neither may lead anywhere yet.
    pub(crate) fn link(&mut self, a: Gateway, b: Gateway) {
        debug_assert!(a != b, "an edge has two ends");
        if !self.are_of_one_path(a, b) {
            self.n_paths -= 1;
        }
        for (from, to) in [(a, b), (b, a)] {
            let slot = self.known(from.place).first_slot + usize::from(from.index);
            debug_assert!(self.links[slot].is_none(), "a gateway leads to one place");
            self.links[slot] = Some(to);
        }
        self.n_links += 1;
    }

    /// Keeps the view seen at a place that nobody had compared before, and that it is unique.
    pub(crate) fn learn_view(&mut self, place: PlaceId, seen: &Observation) {
        let Some(view) = &seen.view else { return };
        let known = &mut self.places[place.0 as usize];
        if known.view.as_ref().is_none_or(|known| !known.is_unique && view.is_unique) {
            Arc::make_mut(known).view = Some(view.clone());
        }
    }

    /// The gateways along the path that enters a place at `gateway`, from there inward: where it
    /// enters each place, until it ends or nobody knows further. A circular path is listed once.
    pub(crate) fn path_inward(&self, gateway: Gateway) -> impl Iterator<Item = Gateway> {
        let next = move |&at: &Gateway| {
            let onward = self.leads_to(self.continuation(at)?)?;
            (onward != gateway).then_some(onward)
        };
        std::iter::successors(Some(gateway), next)
    }

    /// Whether the path that enters at `a`, which leads nowhere yet, is the one that enters at `b`.
    pub(crate) fn are_of_one_path(&self, a: Gateway, b: Gateway) -> bool {
        // Both are ends of their paths, so that one path has them as its two ends.
        self.path_inward(a).last().and_then(|end| self.continuation(end)) == Some(b)
    }

    fn known(&self, id: PlaceId) -> &Place {
        &self.places[id.0 as usize]
    }
}
