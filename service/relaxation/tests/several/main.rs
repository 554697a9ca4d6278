//! Several travels of unknown relative start: localisation, joint expectation maximisation and alignment
//! of maps, against their definitions and on worlds whose answer is known.

mod alignment;
#[path = "../em/definition.rs"]
mod definition;
mod joint_em;
mod localization;
mod one_em;
#[path = "../em/worlds.rs"]
#[expect(dead_code, reason = "shared with the tests of one travel, which use all of it")]
mod worlds;
