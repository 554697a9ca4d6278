//! Leases of maps: one holder, takeover, fences.

use meetpoint_storage::{Error, MapId};
use uuid::Uuid;

use crate::fixture::{Fixture, hall};

const ANN: Uuid = Uuid::from_u128(1);
const BOB: Uuid = Uuid::from_u128(2);

#[tokio::test]
async fn one_process_holds_a_map_until_its_lease_runs_out() {
    let Fixture { store, .. } = &Fixture::new().await;
    let first = store.acquire_map_lease(&hall(), ANN, 0, 10).await.expect("the map exists");
    let first = first.expect("nobody holds it");
    let refused = store.acquire_map_lease(&hall(), BOB, 9, 10).await.expect("the map exists");
    assert_eq!(refused, None, "it is held until 10");
    assert!(store.renew_map_lease(&first, 9, 10).await.expect("writing works"), "still ours");
    let refused = store.acquire_map_lease(&hall(), BOB, 18, 10).await.expect("the map exists");
    assert_eq!(refused, None, "it is held until 19 now");
    let second = store.acquire_map_lease(&hall(), BOB, 19, 10).await.expect("the map exists");
    let second = second.expect("it ran out");
    assert!(first.fence < second.fence, "every change of hands raises the fence");
    assert!(!store.renew_map_lease(&first, 20, 10).await.expect("writing works"), "not ours");
}

#[tokio::test]
async fn a_released_lease_is_free_at_once() {
    let Fixture { store, .. } = &Fixture::new().await;
    let lease = store.acquire_map_lease(&hall(), ANN, 0, 100).await.expect("the map exists");
    let lease = lease.expect("nobody holds it");
    store.release_map_lease(&lease).await.expect("writing works");
    let next = store.acquire_map_lease(&hall(), BOB, 1, 100).await.expect("the map exists");
    let next = next.expect("it was released");
    store.release_map_lease(&lease).await.expect("writing works");
    assert!(
        store.renew_map_lease(&next, 2, 100).await.expect("writing works"),
        "an old lease \
        releases nothing"
    );
}

#[tokio::test]
async fn a_holder_who_asks_again_voids_its_older_lease() {
    let Fixture { store, .. } = &Fixture::new().await;
    let old = store.acquire_map_lease(&hall(), ANN, 0, 100).await.expect("the map exists");
    let old = old.expect("nobody holds it");
    let new = store.acquire_map_lease(&hall(), ANN, 1, 100).await.expect("the map exists");
    assert!(new.is_some_and(|new| old.fence < new.fence), "a new fence");
    assert!(!store.renew_map_lease(&old, 2, 100).await.expect("writing works"), "the old is void");
}

#[tokio::test]
async fn all_leases_are_void_after_a_start() {
    let Fixture { store, .. } = &Fixture::new().await;
    store.acquire_map_lease(&hall(), ANN, 0, i64::MAX).await.expect("the map exists");
    store.release_all_leases().await.expect("writing works");
    let next = store.acquire_map_lease(&hall(), BOB, 1, 10).await.expect("the map exists");
    assert!(next.is_some_and(|lease| lease.fence == 2), "the dead holder's fence is passed");
}

#[tokio::test]
async fn a_lease_needs_a_map() {
    let Fixture { store, .. } = &Fixture::new().await;
    let lease = store.acquire_map_lease(&MapId("attic".to_owned()), ANN, 0, 10).await;
    assert!(matches!(lease, Err(Error::NoSuchMap(_))), "there is no attic");
}
