//! What people said of a travel's maps, in words that hold whatever else is assumed.
//!
//! A map is told by what it says of every visit. So what was decided about it does not depend on
//! limits or on what else was kept, and a hypothesis has the same id in every tree that has it.

use meetpoint_places::Sighting;
use meetpoint_storage::{ContentHash, SessionId};

/// Hexadecimal digits of an id that stand for what the map says: 64 bits.
const N_DIGITS: usize = 16;

/// That somebody said that a map is true.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Assertion {
    /// Its id.
    pub(crate) hypothesis: String,
    /// What it says of every visit until then.
    pub(crate) sightings: Vec<Sighting>,
    /// For people.
    pub(crate) reason: String,
    /// For people.
    pub(crate) author: String,
    /// By the service's clock, nanoseconds since 1970.
    pub(crate) time_ns: i64,
}

/// The id of a map that says this of the visits of a session: how many these are, and a digest.
pub(crate) fn hypothesis_id(session: SessionId, sightings: &[Sighting]) -> String {
    let mut bytes = session.0.as_bytes().to_vec();
    for Sighting { first_visit, gateway } in sightings {
        bytes.extend((*first_visit as u64).to_le_bytes());
        bytes.push(*gateway);
    }
    let digest = ContentHash::of(&bytes).to_string();
    format!("{}-{}", sightings.len(), digest.get(..N_DIGITS).unwrap_or_default())
}

/// The visits that the map of that id is of; `None` if it is no id.
pub(crate) fn visits_of_id(id: &str) -> Option<usize> {
    let (n_visits, digest) = id.split_once('-')?;
    let is_digest =
        digest.len() == N_DIGITS && digest.bytes().all(|digit| digit.is_ascii_hexdigit());
    is_digest.then(|| n_visits.parse().ok()).flatten()
}

#[cfg(test)]
mod tests {
    use uuid::Uuid;

    use super::*;

    #[test]
    fn ids_tell_sessions_visits_and_maps_apart() {
        let [ann, bob] = [1, 2].map(|id| SessionId(Uuid::from_u128(id)));
        let new = |visit| Sighting { first_visit: visit, gateway: 0 };
        let back = [new(0), new(1), new(0)];
        let on = [new(0), new(1), new(2)];
        let ids = [
            hypothesis_id(ann, &back),
            hypothesis_id(ann, &on),
            hypothesis_id(ann, &on[..2]),
            hypothesis_id(bob, &back),
        ];
        let different: std::collections::BTreeSet<&String> = ids.iter().collect();
        assert_eq!(different.len(), ids.len(), "one each: {ids:?}");
        let visits = ids.each_ref().map(|id| visits_of_id(id));
        assert_eq!(visits, [Some(3), Some(3), Some(2), Some(3)], "as they say");
        for bad in ["", "3", "3-", "x-0123456789abcdef", "3-0123456789abcdeg", "3-01"] {
            assert_eq!(visits_of_id(bad), None, "`{bad}` is no id");
        }
    }
}
