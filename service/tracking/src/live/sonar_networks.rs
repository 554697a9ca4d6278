//! The two sets of weights by which a ring is read.

use std::sync::Arc;

use meetpoint_occupancy::Network;

/// One set for each purpose. What draws best repeats itself from firing to firing, which weights trained on ways allow
/// for; what follows a robot best says of each firing what it says by itself. Either does worse at the other's work.
#[derive(Clone, Debug)]
pub struct SonarNetworks {
    /// What a firing adds to the map.
    pub drawing: Arc<Network>,
    /// What a firing is compared by with those before, to find where the robot is (T98, eq. (3)).
    pub following: Arc<Network>,
}

impl SonarNetworks {
    /// Those that come with the service.
    pub fn shipped() -> Self {
        Self { drawing: Arc::new(Network::by_ways()), following: Arc::new(Network::shipped()) }
    }
}
