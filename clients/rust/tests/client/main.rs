//! The client against a session service on loopback that misbehaves.

mod delivery;
mod fake;
