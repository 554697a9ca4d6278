//! Data that no robot would send.

use meetpoint_geometry::Pose;
use meetpoint_relaxation::{
    Detector, Em, EmParams, Landmark, LandmarkKind, Motion, Sighting, Start, StartBelief, Step,
    Travel,
};
use nalgebra::{Matrix2, Point2};
use proptest::prelude::*;

use crate::worlds::{grid, params};

fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        Just(f64::NAN),
        Just(f64::INFINITY),
        Just(1.0e300),
        Just(-3.0e9),
        Just(0.0),
        -5.0_f64..5.0,
    ]
}

fn step() -> impl Strategy<Value = Step> {
    let sighting = (number(), number(), any::<u32>(), any::<Option<u32>>()).prop_map(
        |(range_m, bearing_rad, landmark_type, identity)| Sighting {
            identity,
            landmark_type,
            range_m,
            bearing_rad,
        },
    );
    let leg = (number(), number(), number()).prop_map(|(x_m, y_m, theta_rad)| Pose {
        x_m,
        y_m,
        theta_rad,
    });
    let legs = proptest::collection::vec(leg, 0..3);
    let sightings = proptest::collection::vec(sighting, 0..12);
    (legs, sightings).prop_map(|(legs, sightings)| Step { motion: Motion::new(legs), sightings })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn does_no_harm(
        steps in proptest::collection::vec(step(), 0..4),
        range_max_m in number(),
        half_field_of_view_rad in number(),
        (x, y, variance) in (number(), number(), number()),
    ) {
        let detector = Detector { range_max_m, half_field_of_view_rad };
        let travel = Travel { detector, steps };
        let start = StartBelief::At(Pose { x_m: x, y_m: y, theta_rad: 0.0 });
        let params = EmParams { selection_share: 1e-3, ..params(grid(6, 5), start) };
        let landmark = Landmark {
            position: Point2::new(x, y),
            covariance_m2: Matrix2::identity() * variance,
            kind: LandmarkKind::Type(0),
            certainty: variance,
        };
        for start in [Start::Controls, Start::Map(&[landmark])] {
            let mut em = Em::new(&travel, params, start);
            em.iterate();
            let figures = em.iterate();
            prop_assert!(figures.log_likelihood.is_some_and(f64::is_finite), "{:?}", figures);
            let map = em.map().expect("made");
            prop_assert!(map.probabilities().iter().all(|any| (0.0..=1.001).contains(any)));
            let path = em.path();
            prop_assert!(path.is_none_or(|path| path.poses.iter().all(|pose| pose.is_finite())));
        }
    }
}
