//! Regions of drawn and of random buildings, seen from outside.

mod building;
mod bytes;
mod change;
mod graph;
mod ids;
mod regions;
mod rooms;
mod skeleton;
mod transform;
