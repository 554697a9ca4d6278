//! What a robot tells the explorer, and what it is told to do.

/// What a robot senses where it stands now, having done what it was told last.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Readings<'a> {
    /// Distances in metres, one a sonar, evenly around: ahead first, then counter-clockwise;
    /// `+inf` where nothing came back.
    pub ranges_m: &'a [f64],
    /// Heading, counter-clockwise: by a compass, or summed up from the turns of the wheels.
    pub heading_rad: f64,
    /// How far the wheels went since the last readings, in metres.
    pub moved_m: f64,
    /// Whether the mark is seen here that one place only has: "home".
    pub sees_home: bool,
}

/// The next small motion, or what else is to be done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Command {
    /// Turn on the spot, counter-clockwise.
    Turn {
        /// By so much.
        by_rad: f64,
    },
    /// Straight ahead.
    Move {
        /// So far.
        by_m: f64,
    },
    /// Stay, and read the sonars again.
    Look,
    /// Nothing is left to be done.
    Done,
}
