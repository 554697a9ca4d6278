//! Where the batches of a session come from.

use std::{future::Future, io};

use meetpoint_proto::v1::Batch;

/// What stands at a number of a session.
#[derive(Clone, Debug, PartialEq)]
pub enum Outgoing {
    /// This batch; its number is the one asked for.
    Batch(Batch),
    /// The numbers from the one asked for to `through` were dropped and will never come.
    Skip {
        /// Last number of the hole.
        through: u64,
        /// Why, for people: up to 200 characters.
        reason: String,
    },
    /// Nothing, now or later: the session ends before this number.
    End,
}

/// Gives the batches of one session by their numbers, and gives each again until it is
/// acknowledged.
pub trait BatchSource: Send {
    /// What stands at `number`, which is above all that were forgotten. Waits until it is there:
    /// a robot waits for its sensors, a paced replay for the clock.
    ///
    /// The future may be dropped half way and asked for again; nothing may be lost by that.
    ///
    /// # Errors
    ///
    /// If the batch was there and can no longer be read.
    fn get(&mut self, number: u64) -> impl Future<Output = io::Result<Outgoing>> + Send;

    /// The service keeps all batches up to `number`; they will not be asked for again.
    ///
    /// # Errors
    ///
    /// If the batches cannot be removed.
    fn forget_through(&mut self, number: u64) -> impl Future<Output = io::Result<()>> + Send;
}
