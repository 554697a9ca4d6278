//! Which submaps saw the same place.

use std::collections::BTreeSet;

use crate::closures::submap_graph::SubmapPair;

/// Pairs of submaps whose scans may be matched with one another.
#[derive(Debug, Default)]
pub(crate) struct Joined {
    /// Those that closures join, the earlier first.
    pairs: BTreeSet<SubmapPair>,
    /// Of each submap, the landmarks that it or a neighbour saw.
    landmarks: Vec<BTreeSet<usize>>,
    /// Those that are not to be joined, whatever else says so.
    apart: BTreeSet<SubmapPair>,
}

impl Joined {
    pub(crate) fn new(
        pairs: BTreeSet<SubmapPair>,
        landmarks: Vec<BTreeSet<usize>>,
        apart: BTreeSet<SubmapPair>,
    ) -> Self {
        Self { pairs, landmarks, apart }
    }

    /// Whether two are joined; the earlier first.
    pub(crate) fn contains(&self, pair: SubmapPair) -> bool {
        let have_landmark = || !self.landmarks[pair.0].is_disjoint(&self.landmarks[pair.1]);
        !self.apart.contains(&pair) && (self.pairs.contains(&pair) || have_landmark())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn by_closures_and_landmarks_but_not_against_people() {
        let landmarks = [vec![4], vec![2, 4], vec![], vec![2]];
        let landmarks = landmarks.map(BTreeSet::from_iter).to_vec();
        let joined = Joined::new([(0, 2), (2, 3)].into(), landmarks, [(1, 3), (2, 3)].into());
        assert!(joined.contains((0, 2)), "by a closure");
        assert!(joined.contains((0, 1)), "by a landmark");
        assert!(!joined.contains((0, 3)) && !joined.contains((1, 2)), "by nothing");
        assert!(!joined.contains((1, 3)) && !joined.contains((2, 3)), "taken apart");
    }
}
