//! Costs as what they exceed the least of their group by, in 16 bits where all do fit.
//!
//! Half the memory, so that more of it is near the processor, and eight of them are added and
//! compared at once (`least_sums.rs`).

use std::ops::Range;

use crate::cost::{Cost, UNREACHABLE};

/// Differences to the least; the largest value of the type is [`UNREACHABLE`].
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Differences {
    Narrow(Vec<u16>),
    Wide(Vec<u32>),
}

/// A row of them.
#[derive(Clone, Copy, Debug)]
pub(crate) enum DifferenceRow<'a> {
    Narrow(&'a [u16]),
    Wide(&'a [u32]),
}

impl Differences {
    /// So many, all [`UNREACHABLE`].
    pub(crate) fn new(n: usize) -> Self {
        Self::Narrow(vec![u16::MAX; n])
    }

    /// Makes room for differences of 32 bits.
    pub(crate) fn widen(&mut self) {
        if let Self::Narrow(narrow) = self {
            let widened = |&more: &u16| if more == u16::MAX { u32::MAX } else { u32::from(more) };
            *self = Self::Wide(narrow.iter().map(widened).collect());
        }
    }

    /// Writes a cost that is not below the least, and tells whether another was there.
    pub(crate) fn put(&mut self, place: usize, cost: Cost, least: Cost) -> bool {
        if let Self::Narrow(narrow) = self {
            if let Some(more) = narrowed(cost, least) {
                return std::mem::replace(&mut narrow[place], more) != more;
            }
            self.widen();
        }
        let Self::Wide(wide) = self else { return false };
        let more = if cost < UNREACHABLE { cost - least } else { u32::MAX };
        std::mem::replace(&mut wide[place], more) != more
    }

    /// The cost at a place, given the least.
    pub(crate) fn cost(&self, place: usize, least: Cost) -> Cost {
        self.row(place..place + 1).cost(0, least)
    }

    /// What [`halves`] parted, or stands in one word of 32 bits.
    pub(crate) fn joined(&self, place: usize) -> Cost {
        match self {
            Self::Narrow(narrow) => {
                Cost::from(narrow[place]) | Cost::from(narrow[place + 1]) << u16::BITS
            }
            Self::Wide(wide) => wide[place],
        }
    }

    /// Some of them.
    pub(crate) fn row(&self, places: Range<usize>) -> DifferenceRow<'_> {
        match self {
            Self::Narrow(narrow) => DifferenceRow::Narrow(&narrow[places]),
            Self::Wide(wide) => DifferenceRow::Wide(&wide[places]),
        }
    }

    /// Memory, in bytes.
    pub(crate) fn n_bytes(&self) -> usize {
        match self {
            Self::Narrow(narrow) => size_of_val(narrow.as_slice()),
            Self::Wide(wide) => size_of_val(wide.as_slice()),
        }
    }
}

impl<'a> DifferenceRow<'a> {
    /// Some of the row.
    pub(crate) fn part(self, places: Range<usize>) -> DifferenceRow<'a> {
        match self {
            Self::Narrow(narrow) => Self::Narrow(&narrow[places]),
            Self::Wide(wide) => Self::Wide(&wide[places]),
        }
    }

    /// The cost at a place, given the least.
    pub(crate) fn cost(self, place: usize, least: Cost) -> Cost {
        match self {
            Self::Narrow(narrow) => cost_of_narrow(narrow[place], least),
            Self::Wide(wide) => cost_of_wide(wide[place], least),
        }
    }

    /// All costs of the row, given the least; as many as fit in `to`.
    pub(crate) fn costs(self, least: Cost, to: &mut [Cost]) {
        match self {
            Self::Narrow(narrow) => {
                for (to, &more) in to.iter_mut().zip(narrow) {
                    *to = cost_of_narrow(more, least);
                }
            }
            Self::Wide(wide) => {
                for (to, &more) in to.iter_mut().zip(wide) {
                    *to = cost_of_wide(more, least);
                }
            }
        }
    }
}

/// The lower and the upper half of a cost.
#[expect(clippy::cast_possible_truncation, reason = "halves")]
pub(crate) fn halves(cost: Cost) -> [u16; 2] {
    [cost as u16, (cost >> u16::BITS) as u16]
}

/// What a cost exceeds the least by; `None` if that does not fit.
pub(crate) fn narrowed(cost: Cost, least: Cost) -> Option<u16> {
    if UNREACHABLE <= cost {
        return Some(u16::MAX);
    }
    u16::try_from(cost - least).ok().filter(|&more| more < u16::MAX)
}

fn cost_of_narrow(more: u16, least: Cost) -> Cost {
    if more == u16::MAX { UNREACHABLE } else { least + Cost::from(more) }
}

fn cost_of_wide(more: u32, least: Cost) -> Cost {
    if more == u32::MAX { UNREACHABLE } else { least + more }
}
