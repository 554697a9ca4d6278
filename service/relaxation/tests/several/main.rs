//! Several travels of unknown relative start: localisation, joint expectation maximisation and alignment
//! of maps, against their definitions and on worlds whose answer is known.

mod alignment;
