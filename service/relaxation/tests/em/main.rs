//! Expectation maximisation against its definition, and on worlds whose answer is known.

mod baum_welch;
mod camera;
mod definition;
mod paths;
mod resume;
mod square_loop;
mod wild_data;
mod worlds;
