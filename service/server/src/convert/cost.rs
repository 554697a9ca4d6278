//! Costs and profiles on the wire, in the journal and in the domain.

use meetpoint_geometry::Point2;
use meetpoint_planning::{Shape, WeightParams};
use meetpoint_proto::v1;
use prost::Message;

use super::{plan, slug};
use crate::error::Error;
use crate::planning::{Cost, CostKind, CostOrigin, Decision, Profile, RADIUS_MAX_M, Removal};

/// Characters of a reason and of an author.
const TEXT_LEN_MAX: usize = 200;
/// Characters of a client's key.
const KEY_LEN_MAX: usize = 255;
/// Characters of a cost's id: a UUID.
const ID_LEN_MAX: usize = 36;
/// Points of a polygon or line: what a person draws.
const N_POINTS_MAX: usize = 1000;
/// Factors of zones and preferences: a cell's weight is a byte.
const FACTOR_MAX: f64 = 8.0;
/// Longest toll, in metres: no detour within a building is as long.
const TOLL_MAX_M: f64 = 10_000.0;
/// Widest line, in metres.
const WIDTH_MAX_M: f64 = 100.0;
/// Farthest that a preference for clearance reaches, in metres.
const CLEARANCE_MAX_M: f64 = 10.0;

/// Why, and who says so.
pub(crate) struct Said {
    pub(crate) reason: String,
    pub(crate) author: String,
    pub(crate) origin: CostOrigin,
}

/// Checks why something is so and who says so.
pub(crate) fn said(reason: &str, author: &str, origin: i32) -> Result<Said, Error> {
    use v1::CostOrigin as Wire;
    let known =
        Wire::try_from(origin).map_err(|_| Error::field("origin", format!("{origin} is none")))?;
    Ok(Said {
        reason: slug::text("reason", reason, TEXT_LEN_MAX)?,
        author: slug::text("author", author, TEXT_LEN_MAX)?,
        origin: match known {
            Wire::Unspecified | Wire::Operator => CostOrigin::Operator,
            Wire::Evidence => CostOrigin::Evidence,
        },
    })
}

/// A cost to be made, under the id that it gets.
pub(crate) fn cost(id: String, wire: v1::Cost) -> Result<Cost, Error> {
    let v1::Cost {
        id: _,
        kind,
        reason,
        author,
        origin,
        cost_revision: _,
        create_time_ns: _,
        client_key,
    } = wire;
    let Said { reason, author, origin } = said(&reason, &author, origin)?;
    Ok(Cost {
        id,
        kind: cost_kind(kind.ok_or_else(|| Error::field("cost.kind", "missing"))?)?,
        reason,
        author,
        origin,
        revision: 0,
        time_ns: 0,
        client_key: slug::text("client_key", &client_key, KEY_LEN_MAX)?,
    })
}

fn cost_kind(wire: v1::cost::Kind) -> Result<CostKind, Error> {
    use v1::cost::Kind;
    match wire {
        Kind::Closure(v1::ArcClosure { arc }) => Ok(CostKind::Closure(arc)),
        Kind::Toll(v1::ArcToll { arc, toll_m }) => {
            Ok(CostKind::Toll { arc, toll_m: checked_toll_m(toll_m)? })
        }
        Kind::Obstacle(v1::Obstacle { shape }) => match shape {
            Some(v1::obstacle::Shape::Polygon(polygon)) => {
                Ok(CostKind::Obstacle(Shape::Polygon(points("polygon", polygon.points, 3)?)))
            }
            Some(v1::obstacle::Shape::Polyline(line)) => {
                let v1::Polyline { points: ends, width_m } = line;
                let width_m = within("polyline.width_m", width_m, 0.0, WIDTH_MAX_M, "m")?;
                let points = points("polyline", ends, 2)?;
                Ok(CostKind::Obstacle(Shape::Polyline { points, width_m }))
            }
            None => Err(Error::field("obstacle", "neither polygon nor polyline")),
        },
        Kind::Zone(v1::Zone { polygon, factor }) => {
            let polygon = polygon.ok_or_else(|| Error::field("zone.polygon", "missing"))?;
            Ok(CostKind::Zone {
                polygon: points("zone.polygon", polygon.points, 3)?,
                factor: within("zone.factor", factor, 1.0, FACTOR_MAX, "times")?,
            })
        }
    }
}

/// A toll that can be set.
pub(crate) fn checked_toll_m(toll_m: f64) -> Result<f64, Error> {
    if 0.0 < toll_m && toll_m <= TOLL_MAX_M {
        return Ok(toll_m);
    }
    Err(Error::field("toll_m", format!("{toll_m} m, must be above 0 m, up to {TOLL_MAX_M} m")))
}

/// An id as callers send it.
pub(crate) fn cost_id(id: &str) -> Result<String, Error> {
    slug::text("id", id, ID_LEN_MAX)
}

fn points(field: &str, wire: Vec<v1::Point>, n_min: usize) -> Result<Vec<Point2<f64>>, Error> {
    if !(n_min..=N_POINTS_MAX).contains(&wire.len()) {
        let problem = format!("{} points, must be {n_min} to {N_POINTS_MAX}", wire.len());
        return Err(Error::field(format!("{field}.points"), problem));
    }
    let point = |(at, wire)| plan::point(&format!("{field}.points[{at}]"), Some(wire));
    wire.into_iter().enumerate().map(point).collect()
}

fn within(field: &str, value: f64, least: f64, most: f64, unit: &str) -> Result<f64, Error> {
    if (least..=most).contains(&value) {
        return Ok(value);
    }
    Err(Error::field(field, format!("{value} {unit}, must be {least} to {most} {unit}")))
}

/// A profile to be declared.
pub(crate) fn profile(wire: v1::Profile) -> Result<Profile, Error> {
    let v1::Profile {
        name,
        robot_radius_m,
        clearance_distance_m,
        clearance_factor,
        occupancy_factor,
    } = wire;
    // 0 stands for none, as an absent field reads.
    let factor = |name: &str, factor: f64| {
        let factor = if factor == 0.0 { 1.0 } else { factor };
        within(&format!("profile.{name}"), factor, 1.0, FACTOR_MAX, "times")
    };
    let distance = "profile.clearance_distance_m";
    Ok(Profile {
        name: slug::slug("profile.name", &name)?,
        radius_m: within("profile.robot_radius_m", robot_radius_m, 0.0, RADIUS_MAX_M, "m")?,
        weights: WeightParams {
            clearance_distance_m: within(
                distance,
                clearance_distance_m,
                0.0,
                CLEARANCE_MAX_M,
                "m",
            )?,
            clearance_factor: factor("clearance_factor", clearance_factor)?,
            occupancy_factor: factor("occupancy_factor", occupancy_factor)?,
        },
    })
}

/// A profile for the wire.
pub(crate) fn profile_to_wire(profile: &Profile) -> v1::Profile {
    let Profile { name, radius_m, weights } = profile;
    let WeightParams { clearance_distance_m, clearance_factor, occupancy_factor } = *weights;
    v1::Profile {
        name: name.clone(),
        robot_radius_m: *radius_m,
        clearance_distance_m,
        clearance_factor,
        occupancy_factor,
    }
}

/// A cost for the wire.
pub(crate) fn cost_to_wire(cost: &Cost) -> v1::Cost {
    let Cost { id, kind, reason, author, origin, revision, time_ns, client_key } = cost;
    v1::Cost {
        id: id.clone(),
        kind: Some(kind_to_wire(kind)),
        reason: reason.clone(),
        author: author.clone(),
        origin: origin_to_wire(*origin),
        cost_revision: *revision,
        create_time_ns: *time_ns,
        client_key: client_key.clone(),
    }
}

fn origin_to_wire(origin: CostOrigin) -> i32 {
    match origin {
        CostOrigin::Operator => v1::CostOrigin::Operator.into(),
        CostOrigin::Evidence => v1::CostOrigin::Evidence.into(),
    }
}

fn kind_to_wire(kind: &CostKind) -> v1::cost::Kind {
    use v1::cost::Kind;
    match kind {
        CostKind::Closure(arc) => Kind::Closure(v1::ArcClosure { arc: *arc }),
        CostKind::Toll { arc, toll_m } => Kind::Toll(v1::ArcToll { arc: *arc, toll_m: *toll_m }),
        CostKind::Obstacle(shape) => {
            let shape = match shape {
                Shape::Polygon(points) => v1::obstacle::Shape::Polygon(polygon(points)),
                Shape::Polyline { points, width_m } => {
                    let points = polygon(points).points;
                    v1::obstacle::Shape::Polyline(v1::Polyline { points, width_m: *width_m })
                }
            };
            Kind::Obstacle(v1::Obstacle { shape: Some(shape) })
        }
        CostKind::Zone { polygon: points, factor } => {
            Kind::Zone(v1::Zone { polygon: Some(polygon(points)), factor: *factor })
        }
    }
}

fn polygon(points: &[Point2<f64>]) -> v1::Polygon {
    v1::Polygon { points: points.iter().map(|&point| plan::point_to_wire(point)).collect() }
}

/// What the journal is to hold of a decision.
pub(crate) fn payload(decision: &Decision) -> Vec<u8> {
    use v1::cost_decision::Kind;
    let kind = match decision {
        Decision::Put(cost) => Kind::Put(cost_to_wire(cost)),
        Decision::Remove(Removal { id, reason, author, origin }) => {
            Kind::Removal(v1::CostRemoval {
                id: id.clone(),
                reason: reason.clone(),
                author: author.clone(),
                origin: origin_to_wire(*origin),
            })
        }
        Decision::Declare(profile) => Kind::Profile(profile_to_wire(profile)),
        Decision::Undeclare(name) => {
            Kind::ProfileRemoval(v1::ProfileRemoval { name: name.clone() })
        }
    };
    v1::CostDecision { kind: Some(kind) }.encode_to_vec()
}

/// What the journal holds of a decision.
///
/// # Errors
/// [`Error::Internal`] if it holds what the door never lets through.
pub(crate) fn recorded(payload: &[u8]) -> Result<Decision, Error> {
    let v1::CostDecision { kind } = v1::CostDecision::decode(payload).map_err(Error::internal)?;
    let kind = kind.ok_or_else(|| Error::internal("a recorded cost without kind"))?;
    decision(kind).map_err(|error| Error::internal(format!("a recorded cost: {error}")))
}

fn decision(wire: v1::cost_decision::Kind) -> Result<Decision, Error> {
    use v1::cost_decision::Kind;
    match wire {
        Kind::Put(wire) => Ok(Decision::Put(cost(wire.id.clone(), wire)?)),
        Kind::Removal(v1::CostRemoval { id, reason, author, origin }) => {
            let Said { reason, author, origin } = said(&reason, &author, origin)?;
            Ok(Decision::Remove(Removal { id, reason, author, origin }))
        }
        Kind::Profile(wire) => Ok(Decision::Declare(profile(wire)?)),
        Kind::ProfileRemoval(v1::ProfileRemoval { name }) => Ok(Decision::Undeclare(name)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn there_and_back(decision: &Decision) {
        assert_eq!(recorded(&payload(decision)).ok().as_ref(), Some(decision), "as it was");
    }

    #[test]
    fn decisions_are_kept_whole() {
        let square = [(0.0, 0.0), (2.0, 0.0), (2.0, 1.5)].map(|(x, y)| Point2::new(x, y)).to_vec();
        for kind in [
            CostKind::Closure(7),
            CostKind::Toll { arc: 7, toll_m: 12.5 },
            CostKind::Obstacle(Shape::Polygon(square.clone())),
            CostKind::Obstacle(Shape::Polyline { points: square.clone(), width_m: 0.1 }),
            CostKind::Zone { polygon: square, factor: 2.5 },
        ] {
            there_and_back(&Decision::Put(Cost {
                id: "a".into(),
                kind,
                reason: "wet floor".into(),
                author: "ann".into(),
                origin: CostOrigin::Evidence,
                revision: 0,
                time_ns: 0,
                client_key: "k".into(),
            }));
        }
        there_and_back(&Decision::Remove(Removal {
            id: "a".into(),
            reason: "dry".into(),
            author: String::new(),
            origin: CostOrigin::Operator,
        }));
        let weights = WeightParams {
            clearance_distance_m: 0.5,
            clearance_factor: 2.0,
            occupancy_factor: 1.0,
        };
        there_and_back(&Decision::Declare(Profile { name: "cart".into(), radius_m: 0.4, weights }));
        there_and_back(&Decision::Undeclare("cart".into()));
        assert!(recorded(b"\x0a\xff").is_err(), "what is no decision");
    }
}
