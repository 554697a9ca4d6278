//! The light client of Meetpoint, for robots: it knows the wire and nothing of the service.
//!
//! [`Client`] asks single questions. [`deliver`] drives the ingest stream of one session over any
//! [`BatchSource`]: it keeps a window of batches under way, reconnects with backoff and resumes
//! where the service stopped. [`Spool`] keeps batches on disk until they are acknowledged, and
//! [`RobotSession`] puts the three together for a robot that may be offline for hours.

mod backoff;
mod client;
mod delivery;
mod error;
mod plan_tables;
mod robot_session;
mod source;
mod spool;

pub use backoff::{Backoff, BackoffParams};
pub use client::Client;
pub use delivery::{Delivered, DeliveryEvent, DeliveryParams, SessionName, deliver};
pub use error::{Error, Refusal};
pub use plan_tables::{GoalPlan, InvalidPlanTables, PlanTables, PlannedMotion};
pub use robot_session::{RobotEvent, RobotParams, RobotSession, Run};
pub use source::{BatchSource, Outgoing};
pub use spool::{Spool, SpoolParams, SpoolSource, SpoolWriter, Spooled, spool_channel};

/// The messages, as generated from the `.proto` files.
pub use meetpoint_proto::v1;
