//! `deliver` against a session service that misbehaves in every way the contract allows.

use std::{io, time::Duration};

use crate::FAST;
use crate::fake::{Fake, Faults, N_BATCHES_UNRELIABLE, N_IN_FLIGHT_MAX};
use meetpoint_client::{
    BatchSource, Client, DeliveryEvent, DeliveryParams, Error, Outgoing, SessionName, deliver,
    v1::{Batch, Mark, Observation, observation::Kind},
};

/// Batches 1 to `last_number`, but for those that were dropped.
struct Batches {
    last_number: u64,
    dropped: Option<(u64, u64)>,
    forgotten_through: u64,
}

impl Batches {
    fn new(last_number: u64) -> Self {
        Self { last_number, dropped: None, forgotten_through: 0 }
    }
}

impl BatchSource for Batches {
    async fn get(&mut self, number: u64) -> io::Result<Outgoing> {
        assert!(self.forgotten_through < number, "{number} was forgotten");
        tokio::task::yield_now().await;
        if self.last_number < number {
            return Ok(Outgoing::End);
        }
        match self.dropped {
            Some((from, through)) if (from..=through).contains(&number) => {
                Ok(Outgoing::Skip { through, reason: "dropped by the test".to_owned() })
            }
            _ => Ok(Outgoing::Batch(batch(number))),
        }
    }

    async fn forget_through(&mut self, number: u64) -> io::Result<()> {
        self.forgotten_through = number;
        Ok(())
    }
}

fn batch(number: u64) -> Batch {
    let mark = Kind::Mark(Mark { label: format!("mark {number}") });
    let observation = Observation { kind: Some(mark), ..Observation::default() };
    Batch { number, observations: vec![observation] }
}

fn session(epoch: u64, acked_through: u64) -> SessionName {
    SessionName { id: "session".to_owned(), epoch, acked_through }
}

/// All batches but the dropped ones, once each and in order.
fn check_received(fake: &Fake, source: &Batches) {
    let expected: Vec<_> = (1..=source.last_number)
        .filter(|number| !source.dropped.is_some_and(|(a, b)| (a..=b).contains(number)))
        .map(batch)
        .collect();
    assert_eq!(fake.durable("session"), expected, "once each, in order");
}

#[tokio::test]
async fn a_calm_service_gets_everything() {
    let (fake, url) = Fake::start(Faults::NONE, 0).await;
    let client = Client::connect(&url).expect("a good address");
    let mut source = Batches::new(200);
    let mut acked = 0;
    let events = |event| {
        if let DeliveryEvent::Acked { through } = event {
            assert!(acked < through, "acks grow: {through} after {acked}");
            acked = through;
        }
    };
    let delivered = deliver(&client, &session(1, 0), &mut source, &FAST, events)
        .await
        .expect("nothing goes wrong");
    assert_eq!((delivered.acked_through, delivered.n_reconnects), (200, 0), "in one go");
    assert_eq!(source.forgotten_through, 200, "the source may forget all");
    assert_eq!(acked, 200, "and the caller hears of it");
    check_received(&fake, &source);
    assert!(fake.n_in_flight_seen("session") <= N_IN_FLIGHT_MAX, "the window is respected");
}

#[tokio::test]
async fn an_unreliable_service_gets_everything_once_and_in_order() {
    for seed in 0..12 {
        let (fake, url) = Fake::start(Faults::ALL, seed).await;
        let client = Client::connect(&url).expect("a good address");
        let mut source = Batches::new(N_BATCHES_UNRELIABLE);
        if seed % 3 == 0 {
            source.dropped = Some((40, 60));
        }
        let mut n_reconnects = 0;
        let events = |event| {
            n_reconnects += u64::from(matches!(event, DeliveryEvent::Reconnecting { .. }));
        };
        let delivered = deliver(&client, &session(1, 0), &mut source, &FAST, events)
            .await
            .unwrap_or_else(|error| panic!("seed {seed}: {error}"));
        assert_eq!(delivered.acked_through, N_BATCHES_UNRELIABLE, "seed {seed}");
        assert_eq!(delivered.n_reconnects, n_reconnects, "each is told, seed {seed}");
        assert!(0 < n_reconnects, "the faults were felt, seed {seed}");
        check_received(&fake, &source);
    }
}

#[tokio::test]
async fn a_delivery_goes_on_where_an_earlier_one_stopped() {
    let (fake, url) = Fake::start(Faults::NONE, 0).await;
    let client = Client::connect(&url).expect("a good address");
    let mut first = Batches::new(30);
    deliver(&client, &session(1, 0), &mut first, &FAST, |_| {}).await.expect("the first half");
    let mut second = Batches::new(50);
    let mut sent = Vec::new();
    let events = |event| {
        if let DeliveryEvent::Sent { through } = event {
            sent.push(through);
        }
    };
    deliver(&client, &session(1, 30), &mut second, &FAST, events).await.expect("the second half");
    assert_eq!(sent, (31..=50).collect::<Vec<_>>(), "nothing twice");
    check_received(&fake, &second);
}

#[tokio::test]
async fn what_is_final_is_not_tried_again() {
    let (_fake, url) = Fake::start(Faults::NONE, 0).await;
    let client = Client::connect(&url).expect("a good address");
    let events = |event| assert!(!matches!(event, DeliveryEvent::Reconnecting { .. }), "{event:?}");
    let error = deliver(&client, &session(0, 0), &mut Batches::new(3), &FAST, events)
        .await
        .expect_err("epoch 0 is fenced");
    assert_eq!(error.code(), Some("SESSION_FENCED"), "{error}");
}

#[tokio::test]
async fn a_service_that_lost_data_is_told_apart() {
    let (_fake, url) = Fake::start(Faults::NONE, 0).await;
    let client = Client::connect(&url).expect("a good address");
    let error = deliver(&client, &session(1, 7), &mut Batches::new(9), &FAST, |_| {})
        .await
        .expect_err("it has nothing and had acknowledged 7");
    assert!(matches!(error, Error::Forgotten { expected: 1, acked_through: 7 }), "{error}");
}

#[tokio::test]
async fn giving_up_is_possible() {
    let params = DeliveryParams { give_up_after: Some(Duration::ZERO), ..FAST };
    let client = Client::connect("http://127.0.0.1:1").expect("a good address");
    let error = deliver(&client, &session(1, 0), &mut Batches::new(1), &params, |_| {})
        .await
        .expect_err("nobody listens on port 1");
    assert!(matches!(error, Error::Unreachable(_)), "{error}");
}
