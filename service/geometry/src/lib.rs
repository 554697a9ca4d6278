//! Poses, transforms, angles, rays and grid frames: the plane that every other crate draws on.

mod angle;
mod grid_frame;
mod pose;

pub use angle::{angle_between, wrap_angle};
pub use grid_frame::{Cell, GridFrame, GridInfo, InvalidResolution};
pub use nalgebra::{Point2, Rotation2, Vector2};
pub use pose::Pose;
