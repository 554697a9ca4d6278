//! The way of a session and its landmarks as a picture: the way blue from a green start, what was
//! seen along it as orange dots, landmarks as red ones in an ellipse of two standard deviations.

use std::f64::consts::TAU;

use meetpoint_geometry::{Point2, Vector2};

use super::sheet::{Colour, Sheet};
use crate::error::Error;

const WAY: Colour = [31, 80, 180];
const START: Colour = [30, 150, 60];
const SEEN: Colour = [240, 140, 30];
const LANDMARK: Colour = [200, 30, 40];

/// What an ellipse shows, in standard deviations.
const DEVIATIONS: f64 = 2.0;
/// Corners of an ellipse.
const N_CORNERS: u32 = 48;

/// What is drawn, in metres.
#[derive(Clone, Debug, Default)]
pub(crate) struct Way {
    pub(crate) points: Vec<Point2<f64>>,
    /// Where the robot was when it saw a landmark.
    pub(crate) seen: Vec<Point2<f64>>,
    /// Landmarks, and their covariances: xx, xy, yy in square metres.
    pub(crate) landmarks: Vec<(Point2<f64>, [f64; 3])>,
}

impl Way {
    fn all_points(&self) -> impl Iterator<Item = Point2<f64>> + '_ {
        let landmarks = self.landmarks.iter().map(|(at, _)| *at);
        self.points.iter().copied().chain(landmarks)
    }
}

/// A PNG of `shown` on a sheet that holds `other` too, so that both can be laid over each other.
///
/// # Errors
/// [`Error::Internal`] if it cannot be written.
pub(crate) fn png(shown: &Way, other: &Way) -> Result<Vec<u8>, Error> {
    let mut sheet = Sheet::new(shown.all_points().chain(other.all_points()));
    sheet.rule();
    for pair in shown.points.windows(2) {
        sheet.line(pair[0], pair[1], WAY, 1);
    }
    for &at in &shown.seen {
        sheet.dot(at, SEEN, 3);
    }
    if let Some(&start) = shown.points.first() {
        sheet.dot(start, START, 6);
    }
    for &(at, covariance_m2) in &shown.landmarks {
        let corners = ellipse(at, covariance_m2);
        for pair in corners.windows(2) {
            sheet.line(pair[0], pair[1], LANDMARK, 0);
        }
        sheet.dot(at, LANDMARK, 4);
    }
    sheet.encoded()
}

/// The ellipse of [`DEVIATIONS`] about a place, closed: by the Cholesky root of its covariance.
fn ellipse(at: Point2<f64>, [xx, xy, yy]: [f64; 3]) -> Vec<Point2<f64>> {
    let a = xx.max(0.0).sqrt();
    let b = if 0.0 < a { xy / a } else { 0.0 };
    let c = (yy - b * b).max(0.0).sqrt();
    let corner = |index: u32| {
        let (sin, cos) = (TAU * f64::from(index) / f64::from(N_CORNERS)).sin_cos();
        at + DEVIATIONS * Vector2::new(a * cos, b * cos + c * sin)
    };
    (0..=N_CORNERS).map(corner).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ellipses_are_as_wide_as_they_say() {
        let corners = ellipse(Point2::new(1.0, 2.0), [0.25, 0.1, 0.09]);
        let widest = corners.iter().map(|at| at.x).fold(f64::MIN, f64::max);
        let highest = corners.iter().map(|at| at.y).fold(f64::MIN, f64::max);
        assert!((widest - 2.0).abs() < 1e-9, "two deviations of half a metre: {widest}");
        assert!((highest - 2.6).abs() < 2e-3, "two of 0.3 m: {highest}");
    }

    #[test]
    fn whatever_comes_is_a_picture() {
        let far = [f64::NAN, f64::INFINITY, 1e5, -1e5, 0.0].map(|x_m| Point2::new(x_m, 1.0));
        let landmarks = vec![(far[2], [f64::NAN, 1.0, -1.0])];
        let wild = Way { points: far.to_vec(), seen: far.to_vec(), landmarks };
        for (shown, other) in [(&Way::default(), &wild), (&wild, &Way::default())] {
            let bytes = png(shown, other).expect("a picture");
            assert!(bytes.starts_with(b"\x89PNG"), "a PNG");
        }
        let empty = png(&Way::default(), &Way::default()).expect("a picture");
        assert!(empty.len() < 2000, "a small empty sheet");
    }
}
