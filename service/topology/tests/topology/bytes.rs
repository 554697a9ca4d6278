//! Topologies as bytes: the same again, and nothing from bytes that are none.

use meetpoint_topology::{
    Counters, InvalidTopology, Topology, TopologyParams, resegmentation, segmentation,
};
use proptest::prelude::*;

use crate::building::{Building, cluttered, office};

/// A building that has been mapped before, so that its ids do not count up from 0.
fn second_version(building: &Building) -> Topology {
    let mut counters = Counters { next_region: 1000, next_arc: 1 << 40 };
    let found = segmentation(&building.space(1), &TopologyParams::INDOOR);
    let first = Topology::first(&found, &mut counters);
    let mut rebuilt = building.clone();
    rebuilt.free.swap_remove(1);
    first.next(&resegmentation(found, &rebuilt.space(1)), &mut counters).0
}

/// What one byte was put in place of another, or between two, or taken out.
#[derive(Clone, Debug)]
struct Damage {
    at: prop::sample::Index,
    n_lost: usize,
    byte: Option<u8>,
}

fn damage() -> impl Strategy<Value = Damage> {
    (any::<prop::sample::Index>(), 0_usize..4, any::<Option<u8>>())
        .prop_map(|(at, n_lost, byte)| Damage { at, n_lost, byte })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn bytes_bring_back_the_same((building, _) in office()) {
        let topology = second_version(&building);
        let bytes = topology.to_bytes();
        let again = Topology::from_bytes(&bytes);
        prop_assert!(again.as_ref() == Ok(&topology), "the same, not {:?}", again.err());
    }

    #[test]
    fn clutter_too(space in cluttered()) {
        let found = segmentation(&space, &TopologyParams::INDOOR);
        let topology = Topology::first(&found, &mut Counters::default());
        let again = Topology::from_bytes(&topology.to_bytes());
        prop_assert!(again.as_ref() == Ok(&topology), "the same, not {:?}", again.err());
    }

    #[test]
    fn a_part_is_not_the_whole((building, _) in office(), end in any::<prop::sample::Index>()) {
        let bytes = second_version(&building).to_bytes();
        let part = &bytes[..end.index(bytes.len())];
        prop_assert_eq!(Topology::from_bytes(part).err(), Some(InvalidTopology::Short(part.len())));
        let more = [bytes.as_slice(), &[0]].concat();
        prop_assert_eq!(Topology::from_bytes(&more).err(), Some(InvalidTopology::Surplus(1)));
    }

    /// Whatever is read from damaged bytes can be written and read again: it keeps all promises
    /// that a topology makes.
    #[test]
    fn damage_is_told_or_does_no_harm(
        (building, _) in office(),
        damages in prop::collection::vec(prop::collection::vec(damage(), 1..4), 40),
    ) {
        let bytes = second_version(&building).to_bytes();
        for damages in damages {
            let mut damaged = bytes.clone();
            for Damage { at, n_lost, byte } in damages {
                let at = at.index(damaged.len());
                let end = (at + n_lost).min(damaged.len());
                damaged.splice(at..end, byte);
            }
            if let Ok(topology) = Topology::from_bytes(&damaged) {
                let again = Topology::from_bytes(&topology.to_bytes());
                prop_assert!(again.as_ref() == Ok(&topology), "as read, not {:?}", again.err());
            }
        }
    }
}

proptest! {
    #[test]
    fn noise_is_no_topology(noise in prop::collection::vec(any::<u8>(), 0..400)) {
        let formatted = [&[1], noise.as_slice()].concat();
        prop_assert!(Topology::from_bytes(&noise).is_err(), "noise");
        prop_assert!(Topology::from_bytes(&formatted).is_err(), "noise of the right format");
    }
}

#[test]
fn a_huge_rectangle_is_refused_unseen() {
    let mut bytes = vec![1];
    bytes.extend(0.05_f64.to_le_bytes());
    bytes.extend([0; 8]);
    bytes.extend([u32::MAX.to_le_bytes(), u32::MAX.to_le_bytes()].concat());
    let side = u32::MAX;
    let refused = Err(InvalidTopology::Extent { width: side, height: side });
    assert_eq!(Topology::from_bytes(&bytes), refused, "2^64 cells");
}

#[test]
fn an_unknown_format_is_told() {
    assert_eq!(Topology::from_bytes(&[7]), Err(InvalidTopology::Format(7)), "no such format");
    assert_eq!(Topology::from_bytes(&[]), Err(InvalidTopology::Short(0)), "nothing");
}
