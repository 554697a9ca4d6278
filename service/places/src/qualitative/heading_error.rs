//! How far headings may be trusted.

/// How far a known place may seem turned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeadingError {
    /// In any case: how well open directions are seen, in radians.
    pub slack_rad: f64,
    /// And for every metre of dead reckoning, where headings are summed up from turns; 0 with a
    /// compass.
    pub drift_rad_per_m: f64,
}

impl HeadingError {
    /// Whether headings are absolute.
    pub fn is_compass(&self) -> bool {
        self.drift_rad_per_m == 0.0
    }

    /// After so many metres of dead reckoning, in radians.
    pub fn after_rad(&self, way_m: f64) -> f64 {
        self.slack_rad + self.drift_rad_per_m * way_m
    }
}
