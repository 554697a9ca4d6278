//! Tunables of live mapping.

use std::f64::consts::PI;

use meetpoint_occupancy::{BeamModel, SonarModel};

/// Tunables of live mapping. Lengths are metres and angles radians, whatever the cells' size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MappingParams {
    /// What a beam says of the cells that it meets.
    pub beam_model: BeamModel,
    /// The map that scans are matched against.
    pub field: FieldParams,
    /// How scans are matched.
    pub matching: MatchParams,
    /// When a scan is believed and drawn.
    pub trust: TrustParams,
    /// How sonar is drawn.
    pub sonar: SonarParams,
}

/// Tunables of drawing sonar.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SonarParams {
    /// How a firing is interpreted.
    pub model: SonarModel,
    /// A firing is drawn if the robot moved this far since it drew the last, in metres...
    pub draw_distance_m: f64,
    /// ...or turned this far, in radians.
    pub draw_turn_rad: f64,
}

/// Tunables of the likelihood field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldParams {
    /// Standard deviation of a hit about its wall, in metres.
    pub hit_std_m: f64,
    /// Log-odds from which a cell counts as wall.
    pub occupied_log_odds_min: f32,
}

/// Tunables of matching a scan against the field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MatchParams {
    /// Hits farther than this are not matched, in metres.
    pub range_max_m: f64,
    /// Hits farther than this from the next weigh less, in metres.
    pub gap_m: f64,
    /// Points of a scan that the correlative search looks at, at most; up to 256.
    pub n_search_points_max: usize,
    /// Step of the search's headings, in radians.
    pub search_step_rad: f64,
    /// Half the search window of a robot that stands, in metres.
    pub search_half_m: f64,
    /// Half the search window of a robot that stands, in radians.
    pub search_half_rad: f64,
    /// What the window grows by for each metre driven, in metres.
    pub search_half_per_m: f64,
    /// What the window grows by for each radian turned, in radians.
    pub search_half_per_rad: f64,
    /// Gain `beta_1` of Thrun 1998, eq. (4), over `beta_3`: loss of mean correlation for the square
    /// metre of distance from the odometry.
    pub odometry_gain_per_m2: f64,
    /// Gain `beta_2` over `beta_3`: loss of mean correlation for the square radian.
    pub odometry_gain_per_rad2: f64,
    /// The most that both may cost together, so that odometry which jumps does not decide.
    pub odometry_loss_max: f64,
    /// Budget of the descent, in iterations.
    pub n_iterations_max: u32,
}

/// When a scan is believed and drawn. Agreement is the mean of the likelihood field over the hits of
/// a scan that fall on mapped space; the shares below are of what is usual for the session.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrustParams {
    /// What counts as usual when a session opens, in 0..=1.
    pub usual_agreement_start: f64,
    /// How fast "usual" follows, as a share of the way with each scan that is not lost.
    pub usual_weight: f64,
    /// Share of the scan's hits that must fall on mapped space for the map to have a say.
    pub known_share_min: f64,
    /// Below this share of the usual agreement the descent from the prediction is not enough, and a
    /// search is made.
    pub search_share: f64,
    /// Below this share the search is widened.
    pub doubt_share: f64,
    /// Below this share a scan is not drawn.
    pub draw_share: f64,
    /// Below this share the tracker searches widely, and believes what it finds far off if that
    /// is beyond doubt.
    pub wide_share: f64,
    /// Below this share the tracker is lost.
    pub lost_share: f64,
    /// The same for a robot that may be anywhere near, at its start or after a hole in the data.
    pub adrift_share: f64,
    /// Half the window of a search in doubt, in metres.
    pub doubt_half_m: f64,
    /// Half the window of a search in doubt, in radians.
    pub doubt_half_rad: f64,
    /// Half the window that a tracker searches that has lost its way or begins, in metres.
    pub lost_half_m: f64,
    /// Half the window that a tracker searches that has lost its way or begins, in radians; all
    /// headings from the second scan in vain on.
    pub lost_half_rad: f64,
    /// What the half window grows by with each scan in vain, in metres.
    pub lost_half_growth_m: f64,
    /// The half window grows up to this, in metres.
    pub lost_half_max_m: f64,
    /// After this many scans in vain only every so many-th is searched widely.
    pub n_lost_scans_max: u32,
    /// Step of the headings of the wider searches, in radians.
    pub wide_step_rad: f64,
    /// A scan is drawn if the robot moved this far since it drew the last, in metres...
    pub draw_distance_m: f64,
    /// ...or turned this far, in radians.
    pub draw_turn_rad: f64,
}

impl MappingParams {
    /// For 2-D lasers on wheeled robots in buildings; found on three public logs together.
    pub const INDOOR: Self = Self {
        beam_model: BeamModel::INDOOR,
        field: FieldParams { hit_std_m: 0.05, occupied_log_odds_min: 0.0 },
        matching: MatchParams {
            range_max_m: 40.0,
            gap_m: 0.1,
            n_search_points_max: 64,
            search_step_rad: PI / 360.0,
            search_half_m: 0.15,
            search_half_rad: 4.0 * PI / 180.0,
            search_half_per_m: 0.3,
            search_half_per_rad: 0.3,
            odometry_gain_per_m2: 1.0,
            odometry_gain_per_rad2: 1.0,
            odometry_loss_max: 0.3,
            n_iterations_max: 10,
        },
        trust: TrustParams {
            usual_agreement_start: 0.8,
            usual_weight: 0.003,
            known_share_min: 0.1,
            search_share: 0.95,
            doubt_share: 0.85,
            draw_share: 0.5,
            wide_share: 0.45,
            lost_share: 0.35,
            adrift_share: 0.7,
            doubt_half_m: 0.4,
            doubt_half_rad: 20.0 * PI / 180.0,
            lost_half_m: 1.5,
            lost_half_rad: PI / 2.0,
            lost_half_growth_m: 0.25,
            lost_half_max_m: 4.0,
            n_lost_scans_max: 6,
            wide_step_rad: PI / 180.0,
            draw_distance_m: 0.5,
            draw_turn_rad: 15.0 * PI / 180.0,
        },
        sonar: SonarParams {
            model: SonarModel::INDOOR,
            draw_distance_m: 0.15,
            draw_turn_rad: 10.0 * PI / 180.0,
        },
    };
}
