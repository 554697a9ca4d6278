//! What people decide about an exploration.

use meetpoint_places::PlaceId;
use meetpoint_places::qualitative::{ExplorerParams, PilotParams, Scale, SelectionRule};

/// Farther readings count as this far, in metres: as NX hears.
const RANGE_MAX_M: f64 = 6.0;

/// How an exploration begins.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Begun {
    /// The sensor; empty for the first that looks all around.
    pub(crate) sensor: String,
    /// Whether headings are a compass's.
    pub(crate) has_compass: bool,
    pub(crate) selection: SelectionRule,
    /// In metres.
    pub(crate) corridor_width_m: f64,
    pub(crate) n_rehearsal_edges_max: usize,
}

impl Begun {
    /// In the corridors of the paper; without a compass, which nobody told of.
    pub(crate) const DEFAULT: Self = Self {
        sensor: String::new(),
        has_compass: false,
        selection: SelectionRule::LeastRotation,
        corridor_width_m: 2.0,
        n_rehearsal_edges_max: ExplorerParams::NX_WITHOUT_COMPASS.n_rehearsal_edges_max,
    };

    /// For the explorer.
    pub(crate) fn params(&self, n_places_max: usize) -> ExplorerParams {
        let of =
            if self.has_compass { ExplorerParams::NX } else { ExplorerParams::NX_WITHOUT_COMPASS };
        let scale = Scale::of_corridors(self.corridor_width_m, RANGE_MAX_M);
        ExplorerParams {
            pilot: PilotParams { scale, ..of.pilot },
            selection: self.selection,
            n_rehearsal_edges_max: self.n_rehearsal_edges_max,
            n_places_max,
            ..of
        }
    }
}

/// What was decided.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Decided {
    /// To begin anew.
    Begun(Begun),
    /// Which direction comes first from then on.
    Selected(SelectionRule),
    /// That a place is home, or that it is not.
    Marked {
        /// The place.
        place: PlaceId,
        /// Whether it is.
        is_home: bool,
    },
}

/// A decision, and when it was made.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Decision {
    /// It holds from behind this batch on.
    pub(crate) after_batch: u64,
    pub(crate) decided: Decided,
    /// For people: why, and who.
    pub(crate) said_by: [String; 2],
    /// By the service's clock, nanoseconds since 1970.
    pub(crate) time_ns: i64,
}
