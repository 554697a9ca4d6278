//! Inverse sensor model of a laser beam: what one reading says about the cells it meets.
//!
//! The beam says "free" of the cells that it crosses, "occupied" of the cell in which it ends, and
//! nothing of what lies behind (S. Thrun, "Learning metric-topological maps for indoor mobile robot
//! navigation", Artificial Intelligence 99 (1998), section 2.1, for a sensor whose cone is a line).

/// How a planar laser scans. Beam `i` points at `angle_min_rad + i * angle_increment_rad`,
/// counter-clockwise from the sensor's x axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LaserGeometry {
    /// Direction of beam 0, in radians.
    pub angle_min_rad: f64,
    /// From one beam to the next, in radians; negative for a laser that turns clockwise.
    pub angle_increment_rad: f64,
    /// Beams a scan. Readings beyond this number are not looked at.
    pub n_beams: u32,
    /// Readings up to this are invalid, in metres.
    pub range_min_m: f64,
    /// Readings from this on mean that nothing was hit, in metres.
    pub range_max_m: f64,
}

/// What a range means (REP 117).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reading {
    /// Something stands so many metres away.
    Hit(f64),
    /// Nothing stands within the sensor's range.
    Nothing,
    /// The sensor could not say: NaN, -inf, negative or too near.
    Invalid,
}

impl LaserGeometry {
    /// What a range of this laser means.
    #[inline]
    pub fn reading(&self, range_m: f32) -> Reading {
        let range_m = f64::from(range_m);
        if range_m >= self.range_max_m {
            Reading::Nothing
        } else if range_m > self.range_min_m && range_m > 0.0 {
            Reading::Hit(range_m)
        } else {
            Reading::Invalid
        }
    }

    /// Direction of a beam from the sensor's x axis, in radians.
    #[inline]
    pub fn bearing_rad(&self, beam: u32) -> f64 {
        self.angle_min_rad + f64::from(beam) * self.angle_increment_rad
    }

    /// The readings of a scan with their directions in radians, in the order of the beams; never
    /// more than `n_beams`.
    pub fn readings(&self, ranges_m: &[f32]) -> impl Iterator<Item = (f64, Reading)> {
        (0..self.n_beams)
            .zip(ranges_m)
            .map(|(beam, &range_m)| (self.bearing_rad(beam), self.reading(range_m)))
    }
}

/// What a beam adds to the log-odds of the cells that it meets, and how the grid forgets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BeamModel {
    /// Log-odds of "occupied" before any reading, dimensionless.
    pub log_odds_prior: f32,
    /// What a hit adds, dimensionless, positive.
    pub log_odds_hit: f32,
    /// What crossing a cell adds, dimensionless, negative.
    pub log_odds_miss: f32,
    /// No cell's log-odds leave ±this, so that a changed world is soon believed.
    pub log_odds_bound: f32,
    /// Decay factor gamma of a cell's log-odds towards the prior with each reading that observes
    /// it, in [0, 1].
    pub decay: f32,
    /// How far a new hit moves the mean of a cell's hits, as a share of the way, in (0, 1].
    pub hit_weight: f32,
    /// Hits farther than this are not drawn, only the way there is cleared; in metres.
    pub hit_range_max_m: f64,
    /// Cells are cleared up to this distance, in metres, also by readings that hit nothing.
    pub clear_range_max_m: f64,
}

impl BeamModel {
    /// For 2-D lasers in buildings. A hit outweighs two beams that pass (0.70 against 0.40 a
    /// reading), since a beam grazes the walls that it passes; the bounds are 3 % and 97 %; gamma
    /// is that of Thrun 1998, section 2.4.
    pub const INDOOR: Self = Self {
        log_odds_prior: 0.0,
        log_odds_hit: 0.85,
        log_odds_miss: -0.4,
        log_odds_bound: 3.5,
        decay: 0.9999,
        hit_weight: 0.5,
        hit_range_max_m: 40.0,
        clear_range_max_m: 5.0,
    };

    /// A cell's log-odds after one more reading that adds `evidence`: decayed towards the prior,
    /// then added to, then bounded (Thrun 1998, eq. (1) in log-odds, and section 2.4 with the decay
    /// in the log-odds). NaN for `log_odds` is a cell never observed, which stands at the prior.
    #[inline]
    pub fn updated(&self, log_odds: f32, evidence: f32) -> f32 {
        let before = if log_odds.is_nan() { self.log_odds_prior } else { log_odds };
        let decayed = self.log_odds_prior + self.decay * (before - self.log_odds_prior);
        (decayed + evidence).clamp(-self.log_odds_bound, self.log_odds_bound)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LASER: LaserGeometry = LaserGeometry {
        angle_min_rad: 0.0,
        angle_increment_rad: 1.0,
        n_beams: 3,
        range_min_m: 0.1,
        range_max_m: 30.0,
    };

    #[test]
    fn readings_follow_rep_117() {
        for invalid in [f32::NAN, f32::NEG_INFINITY, -1.0, 0.0, 0.05] {
            assert_eq!(LASER.reading(invalid), Reading::Invalid, "{invalid} says nothing");
        }
        assert_eq!(LASER.reading(2.0), Reading::Hit(2.0), "within the limits");
        for nothing in [30.0, 81.83, f32::INFINITY] {
            assert_eq!(LASER.reading(nothing), Reading::Nothing, "{nothing} hit nothing");
        }
    }

    #[test]
    fn surplus_ranges_are_not_read() {
        assert_eq!(LASER.readings(&[1.0; 9]).count(), 3, "as many as the geometry has beams");
        assert_eq!(LASER.readings(&[1.0; 2]).count(), 2, "or as the scan has");
    }

    #[test]
    fn evidence_decays_to_the_prior_and_is_bounded() {
        let model = BeamModel { log_odds_prior: -0.5, decay: 0.5, ..BeamModel::INDOOR };
        assert_eq!(model.updated(f32::NAN, 0.0), -0.5, "never observed is the prior");
        assert_eq!(model.updated(1.5, 0.0), 0.5, "half way back to the prior");
        assert_eq!(model.updated(3.4, 5.0), 3.5, "bounded");
    }
}
