//! Put down and taken up again, on one thread or several: the same bits.

use std::num::NonZero;

use meetpoint_relaxation::{Em, EmParams, Start};
use proptest::prelude::*;

use crate::square_loop::{loop_params, travel};

#[test]
fn taken_up_it_goes_on_bit_for_bit() {
    let (travel, _) = travel(7, 0.003);
    let params = loop_params(&travel);
    let threads = EmParams { n_threads: NonZero::new(3).expect("not zero"), ..params };
    let mut whole = Em::new(&travel, params, Start::Controls);
    let mut parts = Em::new(&travel, threads, Start::Controls).to_bytes();
    for _ in 0..4 {
        let expected = whole.iterate();
        let mut part = Em::from_bytes(&travel, threads, &parts).expect("our own bytes");
        assert_eq!(part.iterate(), expected, "the same figures");
        parts = part.to_bytes();
        assert_eq!(parts, whole.to_bytes(), "the same map");
        assert_eq!(part.path(), whole.path(), "the same path");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn damaged_bytes_are_refused(cut in 0_usize..200, flipped in 0_usize..60, bit in 0_u32..8) {
        let (travel, _) = travel(3, 0.0);
        let params = loop_params(&travel);
        let bytes = Em::new(&travel, params, Start::Map(&[])).to_bytes();
        let cut_bytes = &bytes[..bytes.len() - 1 - cut.min(bytes.len() - 1)];
        prop_assert!(Em::from_bytes(&travel, params, cut_bytes).is_err());
        let mut damaged = bytes.clone();
        damaged[flipped] ^= 1 << bit;
        // Whatever comes back, nothing panics.
        let _ = Em::from_bytes(&travel, params, &damaged);
    }
}
