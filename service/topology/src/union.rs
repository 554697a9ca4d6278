//! Disjoint sets of numbers, joined pair by pair.
//!
//! R. Tarjan, "Efficiency of a good but not linear set union algorithm", Journal of the ACM 22
//! (1975), with path halving; the smallest member is the root, so that the result does not depend
//! on the order of the joins.

/// Sets of the numbers from 0 on.
#[derive(Clone, Debug)]
pub(crate) struct Union {
    parent: Vec<u32>,
}

impl Union {
    /// Every number below `n` on its own.
    pub(crate) fn new(n: u32) -> Self {
        Self { parent: (0..n).collect() }
    }

    /// The smallest member of the set that holds `member`.
    pub(crate) fn root(&mut self, mut member: u32) -> u32 {
        while self.parent[member as usize] != member {
            let above = self.parent[self.parent[member as usize] as usize];
            self.parent[member as usize] = above;
            member = above;
        }
        member
    }

    /// Makes one set of two: the root that stays and the one that was; `None` if they were one.
    pub(crate) fn join(&mut self, a: u32, b: u32) -> Option<[u32; 2]> {
        let (a, b) = (self.root(a), self.root(b));
        if a == b {
            return None;
        }
        let (root, leaf) = (a.min(b), a.max(b));
        self.parent[leaf as usize] = root;
        Some([root, leaf])
    }
}
