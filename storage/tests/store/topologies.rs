//! Topologies of versions: stored once, ids that only grow, regions that ended.

use meetpoint_storage::{
    ContentHash, EndedRegion, Error, JournalSeq, NewSnapshot, NewTopology, NextIds,
};

use crate::fixture::{Fixture, hall};
use crate::versions::{lease, snapshot};

fn topology(content: &[u8], next: u64, ended: &[(u64, &[(u64, u64)])]) -> NewTopology {
    let ended = ended.iter().map(|&(region, heirs)| EndedRegion { region, heirs: heirs.to_vec() });
    NewTopology {
        hash: ContentHash::of(content),
        bytes: Some(content.to_vec()),
        next_ids: NextIds { region: next, arc: 2 * next },
        ended: ended.collect(),
    }
}

#[tokio::test]
async fn a_topology_is_found_by_its_version_and_stored_once() {
    let Fixture { store, .. } = &Fixture::new().await;
    let lease = lease(store).await;
    let content = vec![7; 5000];
    let mut new = NewSnapshot { topology: Some(topology(&content, 3, &[])), ..snapshot(&lease) };
    store.save_snapshot(&new).await.expect("the lease is in force");
    new.topology = Some(NewTopology { bytes: None, ..topology(&content, 3, &[]) });
    store.save_snapshot(&new).await.expect("its topology is there already");
    new.topology = None;
    store.save_snapshot(&new).await.expect("a version may have none");
    let of = async |number| store.topology(&hall(), number).await;
    let expected = Some((ContentHash::of(&content), content));
    assert_eq!(of(1).await.expect("reading works"), expected, "as it was saved");
    assert_eq!(of(2).await.expect("reading works"), expected, "by its hash");
    assert_eq!(of(3).await.expect("reading works"), None, "none");
    assert!(matches!(of(4).await, Err(Error::NoSuchVersion { number: 4, .. })), "no such version");
    new.topology = Some(NewTopology { bytes: None, ..topology(b"unknown", 3, &[]) });
    store.save_snapshot(&new).await.expect("the lease is in force");
    assert!(matches!(of(4).await, Err(Error::Damaged(_))), "its content is missing");
}

#[tokio::test]
async fn ids_only_grow_and_what_ended_is_told() {
    let Fixture { store, .. } = &Fixture::new().await;
    let next = async || store.next_ids(&hall()).await.expect("the map exists");
    assert_eq!(next().await, NextIds::default(), "from 0");
    let lease = lease(store).await;
    let versions = [
        topology(b"a", 3, &[]),
        topology(b"b", 5, &[(1, &[(0, 90), (3, 10)]), (2, &[])]),
        // Made with an older count, as if by a slip: nothing goes back.
        topology(b"c", 4, &[(4, &[(0, 1)]), (1, &[(9, 9)])]),
    ];
    for topology in versions {
        let new = NewSnapshot { topology: Some(topology), ..snapshot(&lease) };
        store.save_snapshot(&new).await.expect("the lease is in force");
    }
    store.publish_version(&hall(), 1, 600).await.expect("1 exists");
    assert_eq!(next().await, NextIds { region: 5, arc: 10 }, "whatever is published");
    let ended = async |region| store.ended_region(&hall(), region).await.expect("reading works");
    let heirs = |region, heirs: &[_]| EndedRegion { region, heirs: heirs.to_vec() };
    assert_eq!(ended(1).await, Some((2, heirs(1, &[(0, 90), (3, 10)]))), "the first end counts");
    assert_eq!(ended(2).await, Some((2, heirs(2, &[]))), "without heirs");
    assert_eq!(ended(0).await, None, "it lives");
    assert_eq!(ended(u64::MAX).await, None, "it never was");
    let in_2 = store.regions_ended_in(&hall(), 2).await.expect("reading works");
    assert_eq!(in_2, [heirs(1, &[(0, 90), (3, 10)]), heirs(2, &[])], "by id");
    let version = store.version(&hall(), 2).await.expect("reading works");
    assert_eq!(version.map(|version| version.journal_seq), Some(JournalSeq(1)), "as before");
}
