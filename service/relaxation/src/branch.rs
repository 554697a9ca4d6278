//! A hypothesis of a search under way.

use std::sync::Arc;

use crate::chain::Chains;
use crate::frame::Reading;
use crate::landmark::LandmarkKind;
use crate::least_squares::{Bearing, Estimate, Fit};
use crate::past::Past;

/// Steps of a fit after each step's sightings: the last one's result is near already. After one that
/// was smaller than so much, in metres and radians, the next would be by about its square.
const FIT_STEPS: (u32, f64) = (4, 0.01);

/// A hypothesis under way.
#[derive(Clone, Debug)]
pub(crate) struct Branch {
    pub(crate) association: Vec<Option<u32>>,
    pub(crate) log_evidence: f64,
    pub(crate) kinds: Vec<LandmarkKind>,
    pub(crate) fit: Fit,
    /// What is not fitted any more.
    pub(crate) past: Option<Arc<Past>>,
    /// Of landmarks new, false, mistaken and missed.
    log_prior: f64,
    /// Which of the chains the next fit uses.
    pub(crate) chain: usize,
    /// Whether nothing has been seen again yet: the chain's own drift is then taken for granted.
    pub(crate) is_open: bool,
}

impl Branch {
    /// Before anything was seen, with the drift of a root.
    pub(crate) fn root(n_sightings: usize, chains: &Chains, root: usize) -> Self {
        let calibration = chains.chain(root, true).calibration;
        let estimate = Estimate { poses: Vec::new(), landmarks: Vec::new(), calibration };
        Self {
            association: vec![None; n_sightings],
            log_evidence: chains.log_share(root),
            kinds: Vec::new(),
            fit: Fit { estimate, log_evidence: 0.0, cost: 0.0 },
            past: None,
            log_prior: 0.0,
            chain: root,
            is_open: true,
        }
    }

    /// With the sightings of its last step read so, and fitted. `None` if the equations cannot be
    /// solved.
    pub(crate) fn grown(
        &self,
        chains: &Chains,
        bearings: &[Bearing],
        reading: &Reading,
    ) -> Option<Self> {
        let mut branch = self.clone();
        branch.log_prior += reading.log_prior;
        branch.log_evidence += reading.log_prior + reading.log_density;
        let pose = *self.fit.estimate.poses.last()?;
        let mut sees_again = false;
        for (seen, &landmark) in bearings.iter().zip(&reading.landmarks) {
            branch.association[seen.sighting] = landmark;
            let is_new = landmark.is_some_and(|it| self.kinds.len() <= it as usize);
            sees_again |= landmark.is_some() && !is_new;
            if is_new {
                branch.fit.estimate.landmarks.push(pose * seen.offset_m);
            }
        }
        branch.kinds.extend(&reading.new_kinds);
        if !sees_again {
            return Some(branch);
        }
        let chain = chains.chain(branch.chain, false);
        let past = branch.past.as_deref();
        let fit = chain.fit(branch.fit.estimate, &branch.association, past, FIT_STEPS)?;
        branch.is_open = false;
        branch.chain = chains.nearest(&fit.estimate.calibration);
        branch.log_evidence = fit.log_evidence + branch.log_prior;
        branch.fit = fit;
        Some(branch)
    }

    /// Makes the older half of the steps past, once there are twice `n_fitted`.
    pub(crate) fn forget(&mut self, chains: &Chains, n_fitted: usize) {
        let estimate = &self.fit.estimate;
        let first = self.past.as_ref().map_or(0, |past| past.node);
        if estimate.poses.len() < first + 2 * n_fitted {
            return;
        }
        let chain = chains.chain(self.chain, self.is_open);
        let until = (self.past.as_deref(), first + n_fitted);
        // Equations that cannot be solved are fitted on as they are.
        if let Some(past) = Past::until(chain, estimate, &self.association, until) {
            self.past = Some(Arc::new(past));
        }
    }
}
