//! What carries a mind about: the robot that does what the explorer tells, and senses.

use super::explorer::{Explorer, ExplorerParams, ExplorerState};
use super::readings::{Command, Readings};

/// A robot that turns on the spot, moves ahead and senses where it then stands.
pub trait Body {
    /// What it sensed when it did last what it was told, or where it began.
    fn readings(&self) -> Readings<'_>;

    /// Turns on the spot, counter-clockwise, and senses.
    fn turn(&mut self, by_rad: f64);

    /// Moves straight ahead, or back, as far as nothing is in its way, and senses.
    fn advance(&mut self, by_m: f64);

    /// Stays, and senses again.
    fn look(&mut self);

    /// Does what it is told; nothing where nothing is left to be done.
    fn carry_out(&mut self, command: Command) {
        match command {
            Command::Turn { by_rad } => self.turn(by_rad),
            Command::Move { by_m } => self.advance(by_m),
            Command::Look => self.look(),
            Command::Done => {}
        }
    }
}

/// How an exploration ended.
#[derive(Clone, Debug)]
pub struct Explored {
    /// What it knows.
    pub explorer: Explorer,
    /// Whether nothing was left to explore.
    pub is_complete: bool,
    /// Commands that moved the body.
    pub n_steps: u32,
    /// Times that it sensed.
    pub n_firings: u32,
}

/// Has a body explore until nothing is left, or it has sensed `n_firings_max` times; `watch` is shown
/// the explorer, the body and each command before it is carried out.
pub fn explore<B: Body>(
    body: &mut B,
    params: ExplorerParams,
    n_firings_max: u32,
    mut watch: impl FnMut(&Explorer, &B, Command),
) -> Explored {
    let mut explorer = Explorer::new(params);
    let (mut n_steps, mut n_firings) = (0, 1);
    let is_complete = loop {
        let command = explorer.next(&body.readings());
        watch(&explorer, body, command);
        if command == Command::Done {
            break explorer.state() == ExplorerState::Complete;
        }
        body.carry_out(command);
        n_steps += u32::from(matches!(command, Command::Move { .. }));
        n_firings += 1;
        if n_firings_max < n_firings {
            break false;
        }
    };
    Explored { explorer, is_complete, n_steps, n_firings }
}
