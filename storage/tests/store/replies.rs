//! Remembered replies.

use meetpoint_storage::{ContentHash, RememberedReply};

use crate::fixture::Fixture;

fn reply(body: &str, time_ns: i64) -> RememberedReply {
    RememberedReply {
        fingerprint: ContentHash::of(b"POST"),
        status: 201,
        body: body.as_bytes().to_vec(),
        time_ns,
    }
}

#[tokio::test]
async fn the_first_reply_to_a_key_stays() {
    let Fixture { store, .. } = &Fixture::new().await;
    let unknown = store.remembered_reply("k", "POST /v1/maps").await.expect("reading works");
    assert_eq!(unknown, None, "nothing was answered yet");
    for body in ["first", "second"] {
        store.remember_reply("k", "POST /v1/maps", &reply(body, 5)).await.expect("writing works");
    }
    let kept = store.remembered_reply("k", "POST /v1/maps").await.expect("reading works");
    assert_eq!(kept, Some(reply("first", 5)), "the second came too late");
    let elsewhere = store.remembered_reply("k", "POST /v1/jobs").await.expect("reading works");
    assert_eq!(elsewhere, None, "another route is another request");
}

#[tokio::test]
async fn old_replies_are_forgotten() {
    let Fixture { store, .. } = &Fixture::new().await;
    for (key, time_ns) in [("old", 5), ("new", 6)] {
        store.remember_reply(key, "r", &reply("b", time_ns)).await.expect("writing works");
    }
    let n_forgotten = store.forget_replies_before(6).await.expect("writing works");
    assert_eq!(n_forgotten, 1, "one of the two was given before 6");
    let old = store.remembered_reply("old", "r").await.expect("reading works");
    let new = store.remembered_reply("new", "r").await.expect("reading works");
    assert_eq!((old.is_none(), new.is_some()), (true, true), "the older one");
}
