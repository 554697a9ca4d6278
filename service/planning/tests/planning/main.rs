//! Planning against its definitions.

mod exact;
