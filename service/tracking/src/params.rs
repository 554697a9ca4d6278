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
    /// How the pose of a robot without a laser is corrected by what its sonars hear.
    pub position: PositionParams,
}

/// Tunables of the position by sonar: Thrun 1998, eq. (4). Every gain can be 0; what counts is how they relate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PositionParams {
    /// Gain `beta_1`: cost of the square metre of distance from the odometry.
    pub odometry_gain_per_m2: f64,
    /// Gain `beta_2`: cost of the square radian.
    pub odometry_gain_per_rad2: f64,
    /// Gain `beta_3` of the correlation, which lies in -1..=1.
    pub correlation_gain: f64,
    /// Gain `beta_4` of a wall's sigma, which lies in 0..=1.
    pub wall_gain: f64,
    /// How the least value is found.
    pub descent: DescentParams,
    /// How walls are heard.
    pub walls: WallParams,
}

/// Tunables of gradient descent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DescentParams {
    /// Length of the first step if it is a shift, in metres.
    pub step_m: f64,
    /// Length of the first step if it is a turn, in radians.
    pub step_rad: f64,
    /// Ends when steps are a smaller share of the first than this.
    pub step_share_min: f64,
    /// Budget, in steps tried.
    pub n_iterations_max: u32,
}

/// Tunables of hearing walls, and of the building's direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WallParams {
    /// Adjacent readings that a wall has to explain, at least 3.
    pub n_readings: usize,
    /// Readings from farther are not looked at, in metres.
    pub range_max_m: f64,
    /// Root of the mean square error that such readings may have, in metres.
    pub error_max_m: f64,
    /// Standard deviation of the direction of a wall, in radians.
    pub direction_std_rad: f64,
    /// Variance that the heading gains by reckoning with every metre, in square radians...
    pub heading_rad2_per_m: f64,
    /// ...and with every radian turned.
    pub heading_rad2_per_rad: f64,
    /// Walls that the building's direction is estimated from; one that is heard when the heading is less sure
    /// counts for less than one.
    pub n_first: f64,
    /// Mean resultant length below which a building has no direction, in 0..=1.
    pub resultant_min: f64,
    /// How fast the resultant length follows, as a share of the way with each wall.
    pub resultant_weight: f64,
}

impl WallParams {
    /// Five readings, as in the paper, whose error is one and a half times that of good ranging modules. Of
    /// rings of 24 in floors of rooms, walls heard so stand within 15 degrees of true in 99.9 of a hundred,
    /// with a deviation of 2.4 degrees. Walls that scatter about the direction by 15 degrees, beyond which they
    /// have no effect, have a resultant length of exp(-(4 * 15°)² / 2) = 0.58. Headings by reckoning are taken to
    /// deviate by 0.8 degrees after a metre and by 1.8 after a turn of a radian.
    pub const INDOOR: Self = Self {
        n_readings: 5,
        range_max_m: 3.0,
        error_max_m: 0.03,
        direction_std_rad: 0.042,
        heading_rad2_per_m: 2e-4,
        heading_rad2_per_rad: 1e-3,
        n_first: 20.0,
        resultant_min: 0.58,
        resultant_weight: 0.02,
    };
}

impl PositionParams {
    /// For rings of 24 on wheels. A firing follows the last by some 0.15 m of way, in which odometry errs by a
    /// centimetre and a degree or less.
    pub const SONAR: Self = Self {
        odometry_gain_per_m2: 10.0,
        odometry_gain_per_rad2: 40.0,
        correlation_gain: 1.5,
        wall_gain: 0.4,
        descent: DescentParams {
            step_m: 0.03,
            step_rad: 0.02,
            step_share_min: 0.01,
            n_iterations_max: 30,
        },
        walls: WallParams::INDOOR,
    };
}

/// Tunables of drawing sonar.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SonarParams {
    /// How a firing is drawn.
    pub model: SonarModel,
    /// How a firing is compared with those before.
    pub following: SonarModel,
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
            model: SonarModel::BY_WAYS,
            following: SonarModel::INDOOR,
            draw_distance_m: 0.15,
            draw_turn_rad: 10.0 * PI / 180.0,
        },
        position: PositionParams::SONAR,
    };
}
