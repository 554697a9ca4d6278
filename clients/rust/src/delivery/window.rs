//! Which number to send next, and whether to: the book-keeping of a delivery, without any input
//! or output.

use crate::error::Error;

/// Batches under way in one session.
///
/// Invariant: `acked_through < next`, and `resume_from <= next`.
#[derive(Clone, Debug)]
pub(crate) struct Window {
    /// All up to this number are durable at the service.
    acked_through: u64,
    /// The number to send next.
    next: u64,
    /// The first number sent on the present stream.
    resume_from: u64,
    /// What the service expected when the present stream began.
    expected: u64,
    /// The last number that there is, once known.
    last: Option<u64>,
    n_in_flight_max: u64,
}

impl Window {
    /// Nothing sent yet, all up to `acked_through` known to be durable.
    pub(crate) fn new(acked_through: u64) -> Self {
        let next = acked_through + 1;
        Self {
            acked_through,
            next,
            resume_from: next,
            expected: next,
            last: None,
            n_in_flight_max: 1,
        }
    }

    /// A new stream began, and the service expects the number `expected`.
    ///
    /// What was taken in but not yet acknowledged is not known to be durable: its last batch is
    /// sent once more, for its acknowledgement.
    pub(crate) fn attach(&mut self, expected: u64, n_in_flight_max: u32) -> Result<(), Error> {
        if expected <= self.acked_through {
            return Err(Error::Forgotten { expected, acked_through: self.acked_through });
        }
        self.expected = expected;
        self.next = (expected - 1).max(self.acked_through + 1);
        self.resume_from = self.next;
        self.allow(n_in_flight_max.max(1));
        Ok(())
    }

    /// So many batches may be under way from now on.
    pub(crate) fn allow(&mut self, n_in_flight_max: u32) {
        self.n_in_flight_max = n_in_flight_max.into();
    }

    /// The number to send next, or `None` while nothing may or need be sent.
    pub(crate) fn to_send(&self) -> Option<u64> {
        let ended = self.last.is_some_and(|last| last < self.next);
        (!ended && self.n_in_flight() < self.n_in_flight_max).then_some(self.next)
    }

    /// Batches sent on the present stream and not acknowledged.
    pub(crate) fn n_in_flight(&self) -> u64 {
        self.next - (self.acked_through + 1).max(self.resume_from).min(self.next)
    }

    /// All up to `number` was handed to the stream.
    pub(crate) fn sent_through(&mut self, number: u64) {
        self.next = number + 1;
    }

    /// The numbers from the next one to `through` were dropped; which of them the service must be
    /// told of: none if it has them all.
    pub(crate) fn skip_from(&self, through: u64) -> Option<u64> {
        let from = self.next.max(self.expected);
        (from <= through).then_some(from)
    }

    /// The source ends before the next number.
    pub(crate) fn ended(&mut self) {
        if self.next == self.resume_from && self.acked_through + 1 < self.next {
            // The service has more than the source remembers: hear about all that it does.
            self.next = self.acked_through + 1;
            self.resume_from = self.next;
        } else {
            self.last = Some(self.next - 1);
        }
    }

    /// The service keeps all up to `through`. True if that is news.
    pub(crate) fn ack(&mut self, through: u64) -> bool {
        let news = self.acked_through < through;
        if news {
            self.acked_through = through;
            self.next = self.next.max(through + 1);
        }
        news
    }

    /// All up to this number is durable.
    pub(crate) fn acked_through(&self) -> u64 {
        self.acked_through
    }

    /// True if all that there is, is durable.
    pub(crate) fn is_done(&self) -> bool {
        self.last.is_some_and(|last| last <= self.acked_through)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The service by its contract: numbers without gaps, duplicates answered, acks that lag.
    #[derive(Default)]
    struct Service {
        received: u64,
        durable: u64,
    }

    impl Service {
        fn take(&mut self, number: u64) {
            assert!(number <= self.received + 1, "gap: {number} after {}", self.received);
            self.received = self.received.max(number);
        }
    }

    proptest! {
        #[test]
        fn everything_arrives_without_gaps(
            n_batches in 0_u64..40,
            n_in_flight_max in 0_u32..6,
            events in prop::collection::vec(0_u8..4, 0..200),
        ) {
            let mut service = Service::default();
            let mut window = Window::new(0);
            let attach = |window: &mut Window, service: &Service| {
                window.attach(service.received + 1, n_in_flight_max)
            };
            attach(&mut window, &service).expect("nothing was forgotten");
            // After the random part all goes well.
            let calm = [0_u8, 2].repeat(100);
            for event in events.into_iter().chain(calm) {
                match event {
                    0 | 1 => match window.to_send() {
                        Some(number) if number <= n_batches => {
                            service.take(number);
                            window.sent_through(number);
                        }
                        Some(_) => window.ended(),
                        None => {}
                    },
                    2 => {
                        service.durable = service.received;
                        window.ack(service.durable);
                    }
                    _ => {
                        // The service fell and kept what was durable.
                        service.received = service.durable;
                        attach(&mut window, &service).expect("acks are for ever");
                    }
                }
                prop_assert!(window.n_in_flight() <= u64::from(n_in_flight_max.max(1)));
            }
            prop_assert!(window.is_done());
            prop_assert_eq!(service.durable, n_batches);
        }
    }

    #[test]
    fn what_is_received_but_not_acknowledged_is_sent_once_more() {
        let mut window = Window::new(3);
        window.attach(8, 4).expect("8 is above 3");
        assert_eq!(window.to_send(), Some(7), "7 for its ack");
        assert_eq!(window.n_in_flight(), 0, "4 to 6 are not under way on this stream");
    }

    #[test]
    fn a_source_that_remembers_less_sends_all_it_has() {
        let mut window = Window::new(3);
        window.attach(8, 4).expect("8 is above 3");
        window.ended();
        assert_eq!(window.to_send(), Some(4), "from the first one not acknowledged");
    }

    #[test]
    fn a_service_that_forgot_is_noticed() {
        let error = Window::new(5).attach(5, 4).expect_err("5 was acknowledged");
        assert!(matches!(error, Error::Forgotten { expected: 5, acked_through: 5 }), "{error}");
    }

    #[test]
    fn a_hole_begins_where_the_service_stopped() {
        let mut window = Window::new(3);
        window.attach(8, 4).expect("8 is above 3");
        assert_eq!(window.skip_from(20), Some(8), "7 is there already");
        assert_eq!(window.skip_from(7), None, "all of it is there already");
    }

    #[test]
    fn zero_from_the_service_pauses() {
        let mut window = Window::new(0);
        window.attach(1, 4).expect("a fresh session");
        window.allow(0);
        assert_eq!(window.to_send(), None, "paused");
        window.allow(1);
        assert_eq!(window.to_send(), Some(1), "going again");
    }
}
