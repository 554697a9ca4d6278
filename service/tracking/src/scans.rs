//! Scans matched with one another, along the way and across its passes.

pub(crate) mod believed_information;
pub(crate) mod calibration;
pub(crate) mod chain;
pub(crate) mod key_scan;
pub(crate) mod landmark_sighting;
pub(crate) mod laser_travel;
pub(crate) mod map_matching;
pub(crate) mod neighbours;
pub(crate) mod placing;
pub(crate) mod scan_pair;
pub(crate) mod surface;
pub(crate) mod sweep;
pub(crate) mod travels;
