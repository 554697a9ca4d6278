//! From what a robot sends to what is durable: checks, group commit, acknowledgement.

mod checks;
mod group_commit;
mod known_sessions;
mod stamps;

pub(crate) use group_commit::{JournalWriter, Outcome};
pub(crate) use known_sessions::{KnownSession, KnownSessions};
