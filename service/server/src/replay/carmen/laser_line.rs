//! The lines that hold a scan.

use meetpoint_geometry::Pose;

use super::{BadLine, Beams, Laser, LaserTag, Message, Scan, fields::Fields};

/// Fields behind the readings of a `ROBOTLASERn` line: two poses, two velocities, two distances,
/// an axis, three trailers.
const ROBOT_TAIL: usize = 14;

/// `FLASER n [range...] x y theta odom_x odom_y odom_theta` and the trailers.
pub(super) fn old(tag: LaserTag, mut fields: Fields<'_>) -> Result<Message<'_>, BadLine> {
    let n_beams = fields.count(1)?;
    let ranges_m = fields.readings("range", n_beams)?;
    // The laser's pose, or a corrected one: the odometry stands behind it.
    fields.pose()?;
    let odometry = Some(fields.pose()?);
    let stamp_ns = fields.trailers()?;
    Ok(Message::Scan(Scan {
        stamp_ns,
        laser: Laser { tag, n_beams, beams: None },
        ranges_m,
        remissions: Vec::new(),
        odometry,
        robot_from_laser: None,
    }))
}

/// `RAWLASERn`: parameters, ranges and remissions, and the trailers.
pub(super) fn raw(n: u8, mut fields: Fields<'_>) -> Result<Message<'_>, BadLine> {
    let body = Body::read(&mut fields, true)?;
    let stamp_ns = fields.trailers()?;
    Ok(Message::Scan(body.scan(LaserTag::Raw(n), stamp_ns, None)?))
}

/// `ROBOTLASERn`: as `RAWLASERn`, then the laser's pose, the robot's, and settings of the robot.
/// Old logs lack the remission mode; the count of fields tells.
pub(super) fn robot(n: u8, fields: Fields<'_>) -> Result<Message<'_>, BadLine> {
    let with_mode = robot_with(n, fields.clone(), true);
    match with_mode {
        Ok(message) => Ok(message),
        Err(error) => robot_with(n, fields, false).map_err(|_| error),
    }
}

fn robot_with(n: u8, mut fields: Fields<'_>, has_mode: bool) -> Result<Message<'_>, BadLine> {
    let body = Body::read(&mut fields, has_mode)?;
    match fields.n_left() {
        ROBOT_TAIL => {}
        more if ROBOT_TAIL < more => return Err(BadLine::TooMany(more - ROBOT_TAIL)),
        _ => return Err(BadLine::Missing("pose, setting or stamp")),
    }
    let laser_pose = fields.pose()?;
    let robot_pose = fields.pose()?;
    for setting in ["laser_tv", "laser_rv", "forward distance", "side distance", "turn axis"] {
        fields.text(setting)?;
    }
    let stamp_ns = fields.trailers()?;
    let poses = Some((robot_pose, laser_pose));
    Ok(Message::Scan(body.scan(LaserTag::Robot(n), stamp_ns, poses)?))
}

/// What `RAWLASERn` and `ROBOTLASERn` share.
struct Body {
    n_beams: u32,
    beams: Beams,
    ranges_m: Vec<f32>,
    remissions: Vec<f32>,
}

impl Body {
    fn read(fields: &mut Fields<'_>, has_mode: bool) -> Result<Self, BadLine> {
        fields.text("laser type")?;
        let angle_min_rad = fields.number("start angle")?;
        let field_of_view_rad = fields.number("field of view")?;
        let resolution_rad = fields.number("angular resolution")?;
        let range_max_m = fields.number("maximum range")?;
        fields.text("accuracy")?;
        if has_mode {
            fields.text("remission mode")?;
        }
        let n_beams = fields.count(1)?;
        let ranges_m = fields.readings("range", n_beams)?;
        let n_remissions = fields.count(0)?;
        let remissions = fields.readings("remission", n_remissions)?;
        let angle_increment_rad = increment_rad(resolution_rad, field_of_view_rad, n_beams)?;
        let beams = Beams { angle_min_rad, angle_increment_rad, range_max_m };
        Ok(Self { n_beams, beams, ranges_m, remissions })
    }

    fn scan(
        self,
        tag: LaserTag,
        stamp_ns: i64,
        poses: Option<(Pose, Pose)>,
    ) -> Result<Scan, BadLine> {
        let Self { n_beams, beams, ranges_m, remissions } = self;
        beams.check(n_beams)?;
        Ok(Scan {
            stamp_ns,
            laser: Laser { tag, n_beams, beams: Some(beams) },
            ranges_m,
            remissions,
            odometry: poses.map(|(robot, _)| robot),
            robot_from_laser: poses.map(|(robot, laser)| robot.step_to(laser)),
        })
    }
}

/// The angle between beams; where the line leaves it out (0), that which fills the field of view.
fn increment_rad(resolution_rad: f64, field_of_view_rad: f64, n: u32) -> Result<f64, BadLine> {
    if resolution_rad != 0.0 {
        return Ok(resolution_rad);
    }
    match field_of_view_rad / f64::from(n.saturating_sub(1).max(1)) {
        0.0 => Err(BadLine::WrongBeams("no angle between them")),
        increment_rad => Ok(increment_rad),
    }
}
