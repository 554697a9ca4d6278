//! All maps that fit a travel, from their definition: every way to say at which place and
//! through which gateway each visit was, checked against the axioms at the end.

use std::collections::{BTreeMap, BTreeSet};

use meetpoint_places::{Assumptions, Sighting, Star, Travel};

/// A place and one of its gateways.
type At = (usize, usize);

/// A map, as what it says of every visit.
struct Candidate<'a> {
    travel: &'a Travel,
    arrivals: Vec<At>,
    /// Of every place: its star as seen at its first visit.
    stars: Vec<Star>,
}

/// A map that fits, in the words of the tree.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Fitting {
    pub(crate) n_places: usize,
    pub(crate) n_paths: usize,
    pub(crate) sightings: Vec<Sighting>,
}

/// All maps that fit, in order.
pub(crate) fn all_maps(travel: &Travel, assumptions: Assumptions) -> BTreeSet<Fitting> {
    let first =
        Candidate { travel, arrivals: vec![(0, 0)], stars: vec![travel.first.star.clone()] };
    let mut fitting = BTreeSet::new();
    assign(&first, assumptions, &mut fitting);
    fitting
}

/// Says every possible thing of the next visit.
fn assign(candidate: &Candidate<'_>, assumptions: Assumptions, fitting: &mut BTreeSet<Fitting>) {
    let visit = candidate.arrivals.len();
    let Some(seen) = candidate.travel.seen(visit) else {
        fitting.extend(candidate.fitting(assumptions));
        return;
    };
    let n_gateways = seen.star.openings().len();
    let n_places = candidate.stars.len();
    let known = (0..n_places).flat_map(|place| (0..n_gateways).map(move |at| (place, at)));
    for at in known.chain([(n_places, 0)]) {
        let arrivals = candidate.arrivals.iter().copied().chain([at]).collect();
        let mut stars = candidate.stars.clone();
        if at.0 == n_places {
            stars.push(seen.star.clone());
        }
        assign(&Candidate { arrivals, stars, ..*candidate }, assumptions, fitting);
    }
}

impl Candidate<'_> {
    fn n_gateways(&self, place: usize) -> usize {
        self.stars[place].openings().len()
    }

    /// The map in the words of the tree, if the axioms hold.
    fn fitting(&self, assumptions: Assumptions) -> Option<Fitting> {
        if !self.stars_agree() {
            return None;
        }
        let edges = self.edges()?;
        let (n_paths, are_ordered) = self.paths(&edges);
        let holds = self.views_agree()
            && (are_ordered || !assumptions.has_ordered_paths)
            && (self.is_planar(&edges) || !assumptions.is_planar);
        let first_of = |place| self.arrivals.iter().position(|arrival| arrival.0 == place);
        let sighting = |&(place, at): &At| Sighting {
            first_visit: first_of(place).expect("its own at least"),
            gateway: u8::try_from(at).expect("few gateways"),
        };
        let sightings = self.arrivals.iter().map(sighting).collect();
        holds.then_some(Fitting { n_places: self.stars.len(), n_paths, sightings })
    }

    /// Axioms 1 to 3: where each gateway leads, if that is one other gateway, and back.
    fn edges(&self) -> Option<BTreeMap<At, At>> {
        let mut edges = BTreeMap::new();
        for (pair, step) in self.arrivals.windows(2).zip(&self.travel.steps) {
            let ((place, came), to) = (pair[0], pair[1]);
            let from = (place, (came + usize::from(step.turn)) % self.n_gateways(place));
            let before = [edges.insert(from, to), edges.insert(to, from)];
            let is_new = before == [None, None];
            let is_known = before == [Some(to), Some(from)];
            if from == to || !(is_new || is_known) {
                return None;
            }
        }
        Some(edges)
    }

    /// Axiom 4.
    fn stars_agree(&self) -> bool {
        self.arrivals.iter().enumerate().all(|(visit, &(place, at))| {
            let seen = &self.travel.seen(visit).expect("a visit").star;
            let star = &self.stars[place];
            let n = self.n_gateways(place);
            seen.openings().len() == n
                && (0..n).all(|i| star.openings()[(at + i) % n] == seen.openings()[i])
        })
    }

    /// Axiom 5, pair by pair.
    fn views_agree(&self) -> bool {
        let visits = || self.arrivals.iter().enumerate();
        visits().all(|(one, at_one)| {
            visits().all(|(other, at_other)| {
                let view = |visit| self.travel.seen(visit).and_then(|seen| seen.view.as_ref());
                let (Some(one), Some(other)) = (view(one), view(other)) else { return true };
                let is_same_name = one.name == other.name;
                if at_one.0 == at_other.0 {
                    is_same_name
                } else {
                    !(is_same_name && (one.is_unique || other.is_unique))
                }
            })
        })
    }

    /// Number of paths, and whether none meets a place twice (axiom 6).
    fn paths(&self, edges: &BTreeMap<At, At>) -> (usize, bool) {
        // A gateway's path is named for the least gateway on it.
        let mut name: BTreeMap<At, At> = (0..self.stars.len())
            .flat_map(|place| (0..self.n_gateways(place)).map(move |at| (place, at)))
            .map(|at| (at, at))
            .collect();
        let all: Vec<At> = name.keys().copied().collect();
        let joined = |&(place, at): &At| {
            let star = &self.stars[place];
            let onward = usize::from(star.openings()[at].continues_after);
            (place, (at + onward) % self.n_gateways(place))
        };
        for _ in &all {
            for at in &all {
                let beside = [Some(joined(at)), edges.get(at).copied()];
                let least = beside.into_iter().flatten().map(|beside| name[&beside]).min();
                let least = least.expect("itself at least").min(name[at]);
                name.insert(*at, least);
            }
        }
        let paths: BTreeSet<At> = name.values().copied().collect();
        let meets_twice = |path: &At| {
            let on: Vec<At> = all.iter().copied().filter(|at| name[at] == *path).collect();
            let fragments: BTreeSet<At> = on.iter().map(|at| (*at).min(joined(at))).collect();
            let places: BTreeSet<usize> = on.iter().map(|at| at.0).collect();
            let n_edges = on.iter().filter(|at| edges.contains_key(at)).count() / 2;
            places.len() < fragments.len() || fragments.len() <= n_edges
        };
        (paths.len(), !paths.iter().any(meets_twice))
    }

    /// Axiom 7, Euler's formula: faces are the orbits of "along the edge, then the next edge
    /// clockwise".
    fn is_planar(&self, edges: &BTreeMap<At, At>) -> bool {
        let next_edge = |(place, at): At| {
            let n = self.n_gateways(place);
            (1..=n).map(|turn| (place, (at + turn) % n)).find(|gateway| edges.contains_key(gateway))
        };
        let mut left: BTreeSet<At> = edges.keys().copied().collect();
        let mut n_faces = usize::from(left.is_empty());
        while let Some(mut at) = left.pop_first() {
            n_faces += 1;
            loop {
                at = next_edge(edges[&at]).expect("the edge it came by");
                if !left.remove(&at) {
                    break;
                }
            }
        }
        self.stars.len() + n_faces == edges.len() / 2 + 2
    }
}
