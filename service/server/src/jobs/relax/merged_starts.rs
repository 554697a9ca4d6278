//! How sure it is where a session lies that was merged into the map: what its alignment said.

use meetpoint_geometry::{Point2, Pose};
use meetpoint_storage::{MergeState, SessionId};

use super::Relaxing;
use super::finding::place;
use crate::convert::merge;
use crate::error::Error;

/// Frames that lie in one another, at most: a robot a frame.
const N_FRAMES_MAX: usize = 64;

/// Covariance of a pose: x and y in metres, theta in radians, row by row.
pub(super) type Covariance = [[f64; 3]; 3];

/// A frame that lies in the map's, or in that of another session, with an error of its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct UnsureFrame {
    /// Its origin in the map's frame.
    origin: Point2<f64>,
    /// Of its pose, in the frame that it lies in.
    covariance: Covariance,
    /// How that one is turned in the map's.
    turn_rad: f64,
}

impl Relaxing<'_> {
    /// The frames by whose errors a session's place in the map is wrong: its own, if it was merged, and those
    /// that this lies in. None for a session whose start was told, nor where it is not known of one of them how
    /// surely it lies: that is as good as told.
    pub(super) async fn unsure_frames(
        &self,
        session: SessionId,
    ) -> Result<Vec<UnsureFrame>, Error> {
        let (mut frames, mut next) = (Vec::new(), Some(session));
        while let Some(session) = next.take().filter(|_| frames.len() < N_FRAMES_MAX) {
            let found = self.service.store.merge(merge::id_of(session)).await?;
            let Some(found) = found.filter(|found| found.state == MergeState::Accepted) else {
                break;
            };
            let found = merge::to_wire(&found)?;
            let accepted = found.decision.map(|decision| decision.alignment).unwrap_or_default();
            let mut alignments = found.alignments.iter();
            let Some(found) = alignments.find(|it| it.id == accepted) else {
                return Ok(Vec::new());
            };
            let &[xx, xy, xt, yy, yt, tt] = found.covariance.as_slice() else {
                return Ok(Vec::new());
            };
            let (onto, _) = merge::place(found)?;
            let own = place(&self.service.session_record(&session.0.to_string()).await?);
            let turn_rad = match onto {
                Some(onto) => {
                    place(&self.service.session_record(&onto.0.to_string()).await?).theta_rad
                }
                None => 0.0,
            };
            let covariance = [[xx, xy, xt], [xy, yy, yt], [xt, yt, tt]];
            frames.push(UnsureFrame { origin: own.position(), covariance, turn_rad });
            next = onto;
        }
        Ok(frames)
    }
}

/// Covariance in the map's frame of a pose that lies in all of these frames; `None` without any.
pub(super) fn covariance_of(pose: Pose, frames: &[UnsureFrame]) -> Option<Covariance> {
    let carried = frames.iter().map(|frame| {
        let (sin, cos) = frame.turn_rad.sin_cos();
        let arm = pose.position() - frame.origin;
        // A frame that turns swings what lies far from its origin.
        let by = [[cos, -sin, -arm.y], [sin, cos, arm.x], [0.0, 0.0, 1.0]];
        sandwiched(by, frame.covariance)
    });
    carried.reduce(|a, b| {
        std::array::from_fn(|row| std::array::from_fn(|column| a[row][column] + b[row][column]))
    })
}

/// `by * covariance * by^T`.
fn sandwiched(by: Covariance, covariance: Covariance) -> Covariance {
    let entry = |row: usize, column: usize| {
        let pairs = (0..3).flat_map(|i| (0..3).map(move |j| (i, j)));
        pairs.map(|(i, j)| by[row][i] * covariance[i][j] * by[column][j]).sum()
    };
    std::array::from_fn(|row| std::array::from_fn(|column| entry(row, column)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn far_from_its_origin_a_frame_that_turns_is_less_sure() {
        let told = covariance_of(Pose::IDENTITY, &[]);
        assert_eq!(told, None, "a start that was told has its own");
        let covariance = [[0.01, 0.0, 0.0], [0.0, 0.04, 0.0], [0.0, 0.0, 1e-4]];
        let frame = UnsureFrame { origin: Point2::new(5.0, 2.0), covariance, turn_rad: 0.0 };
        let here = covariance_of(Pose::new(5.0, 2.0, 1.0), &[frame]).expect("one frame");
        assert_eq!(here, covariance, "at its origin");
        let there = covariance_of(Pose::new(25.0, 2.0, 1.0), &[frame]).expect("one frame");
        assert!((there[1][1] - 0.08).abs() < 1e-12, "20 m away, 0.01 rad are 0.2 m: {there:?}");
        assert!((there[1][2] - 0.002).abs() < 1e-12, "and go with the turn: {there:?}");
        let quarter = UnsureFrame { turn_rad: std::f64::consts::FRAC_PI_2, ..frame };
        let turned = covariance_of(Pose::new(5.0, 2.0, 0.0), &[quarter, frame]).expect("two");
        assert!((turned[0][0] - 0.05).abs() < 1e-12, "x of the one is y of the other: {turned:?}");
    }
}
