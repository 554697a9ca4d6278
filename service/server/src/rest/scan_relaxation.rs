//! What a relaxation by scans says of itself, in JSON.

use meetpoint_proto::v1;
use serde::Serialize;
use utoipa::ToSchema;

use super::geometry::Pose;
use super::integer::Unsigned64;

/// By what a session was relaxed.
#[derive(Clone, Copy, Debug, Serialize, ToSchema)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
pub(crate) enum RelaxMethod {
    /// Not told by the service of that version.
    Unspecified,
    /// Expectation maximisation over poses and landmarks.
    Landmarks,
    /// Closures, a pose graph, and scans matched with one another.
    Scans,
}

impl From<v1::RelaxMethod> for RelaxMethod {
    fn from(wire: v1::RelaxMethod) -> Self {
        match wire {
            v1::RelaxMethod::Unspecified => Self::Unspecified,
            v1::RelaxMethod::Landmarks => Self::Landmarks,
            v1::RelaxMethod::Scans => Self::Scans,
        }
    }
}

/// What a relaxation by scans says of itself.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct ScanRelaxation {
    scans: u32,
    /// Closures of the session, or between it and others, that the poses rest on.
    closures_accepted: u32,
    /// Those that were considered beside them.
    closures_refused: u32,
    /// Sum of the squared residuals of the pose graph, of all sessions relaxed together, in units of
    /// their covariance, by live poses.
    chi2_before: f64,
    /// The same by the relaxed poses.
    chi2_after: f64,
    /// Of the scans of all sessions relaxed together, drawn by live poses.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    before: Option<GridSharpness>,
    /// The same by the relaxed poses.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    after: Option<GridSharpness>,
    /// Sightings that the poses rest on beside the scans: of landmarks that have an identity and were
    /// seen from several places, by whichever sessions are relaxed together.
    sightings_in_graph: u32,
    /// The other sightings: they say where their landmarks are, seen from poses found without them.
    sightings_fitted_only: u32,
    /// Those among the latter whose landmark was seen from several places, but not where it was: an
    /// identity that was misread, or that several landmarks have.
    sightings_doubted: u32,
    /// Where the robot's lasers sit and look, by what odometry and scans say of the same steps: a laser
    /// that is declared at a pose sits at this times that pose. Next to nothing where all are as declared.
    /// It is told and not applied: poses are those of the robot whose lasers are as declared. Absent of a
    /// session without odometry.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    lasers_moved: Option<Pose>,
}

/// How sharp a grid is: the less entropy, the sharper.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct GridSharpness {
    /// Cells that some reading observed.
    cells: Unsigned64,
    /// Sum of their entropies, in bits.
    entropy_bits: f64,
    /// Mean entropy of one, in bits.
    entropy_mean_bits: f64,
}

impl From<v1::ScanRelaxation> for ScanRelaxation {
    fn from(wire: v1::ScanRelaxation) -> Self {
        let v1::ScanRelaxation {
            scans,
            closures_accepted,
            closures_refused,
            chi2_before,
            chi2_after,
            before,
            after,
            sightings_in_graph,
            sightings_fitted_only,
            sightings_doubted,
            lasers_moved,
        } = wire;
        Self {
            scans,
            closures_accepted,
            closures_refused,
            chi2_before,
            chi2_after,
            before: before.map(GridSharpness::from),
            after: after.map(GridSharpness::from),
            sightings_in_graph,
            sightings_fitted_only,
            sightings_doubted,
            lasers_moved: lasers_moved.map(Pose::from),
        }
    }
}

impl From<v1::GridSharpness> for GridSharpness {
    fn from(wire: v1::GridSharpness) -> Self {
        let v1::GridSharpness { cells, entropy_bits, entropy_mean_bits } = wire;
        Self { cells: Unsigned64(cells), entropy_bits, entropy_mean_bits }
    }
}
