//! Stars: the local topology of a place, as the order of its gateways.
//!
//! A star lists the gateways of a place clockwise, says by which control law one travels away
//! through each, and which two of them lie on one path fragment, so that a path passes through:
//! B. Kuipers, J. Modayil, P. Beeson et al., "Local metrical and global topological maps in
//! the hybrid Spatial Semantic Hierarchy", ICRA 2004 (below: HSSH 2004), sections III-B and III-C. The tuples of the paper that face inward on a fragment that ends at the place follow
//! from this list, and are left out.
//!
//! A star is read from a gateway, in practice the one where the robot came in. Two stars look
//! alike from two gateways if the two lists are equal; nothing else is compared.

use std::fmt;
use std::str::FromStr;

/// Gateways of a place, at most: no crossing in a building comes near.
pub(crate) const N_GATEWAYS_MAX: usize = 32;

/// How a robot travels away from a place through a gateway (HSSH 2004, section III-C).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ControlLaw {
    /// In the middle between the walls; not written.
    Midline,
    /// Along the wall on its left, written `<`.
    LeftWall,
    /// Along the wall on its right, written `>`.
    RightWall,
    /// Straight on, where no wall is near, written `^`.
    BlindStep,
}

/// A gateway, as its star describes it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Opening {
    /// How many gateways on, clockwise, the path fragment of this one leaves the place again;
    /// 0 if it ends at the place. Less than the number of gateways.
    pub continues_after: u8,
    /// How one travels away from the place here.
    pub control_law: ControlLaw,
}

/// Gateways of a place in clockwise order, as read from one of them.
///
/// Written as one letter a gateway, the same for the two of one path fragment: `abab` is a
/// crossing of two paths, `aba` a place on path `a` where path `b` ends, `ab` a corner where two
/// paths end, `aa` a place that a path passes.
///
/// Invariant: at least one gateway; where one fragment leads, it leads back from.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Star(Vec<Opening>);

/// What is wrong with the description of a star.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InvalidStar {
    /// It has no gateway, or more than any place.
    #[error("a star of {0} gateways, where 1 to {N_GATEWAYS_MAX} are possible")]
    GatewayCount(usize),
    /// Two gateways do not agree on whether one path passes through both.
    #[error("the path fragment of gateway {0} does not lead back to it")]
    OneWay(usize),
    /// A path fragment with more than two gateways.
    #[error("path fragment `{0}` has more than two gateways")]
    Forked(char),
    /// A sign that is neither a lowercase letter nor a control law.
    #[error("`{0}` is neither a path fragment (a to z) nor a control law (<, > or ^)")]
    UnknownSign(char),
}

impl Star {
    /// A star of these gateways, clockwise.
    ///
    /// # Errors
    /// [`InvalidStar`] where the numbers contradict each other.
    pub fn new(openings: Vec<Opening>) -> Result<Self, InvalidStar> {
        let n = openings.len();
        if n == 0 || N_GATEWAYS_MAX < n {
            return Err(InvalidStar::GatewayCount(n));
        }
        for (index, opening) in openings.iter().enumerate() {
            let onward = usize::from(opening.continues_after);
            let back = usize::from(openings[(index + onward) % n].continues_after);
            let leads_back = onward == 0 || (onward < n && back == n - onward);
            if !leads_back {
                return Err(InvalidStar::OneWay(index));
            }
        }
        Ok(Self(openings))
    }

    /// The gateways, clockwise.
    pub fn openings(&self) -> &[Opening] {
        &self.0
    }

    /// Number of gateways, 1 to 32.
    #[expect(clippy::cast_possible_truncation, reason = "at most N_GATEWAYS_MAX")]
    pub fn n_gateways(&self) -> u8 {
        self.0.len() as u8
    }

    /// Number of path fragments, those that pass through counted once.
    pub fn n_fragments(&self) -> usize {
        let n_passing = self.0.iter().filter(|opening| opening.continues_after != 0).count();
        self.0.len() - n_passing / 2
    }

    /// The gateway where the fragment of `gateway` leaves the place again, if it does.
    pub fn continuation(&self, gateway: u8) -> Option<u8> {
        let onward = self.0[usize::from(gateway)].continues_after;
        (onward != 0).then(|| (gateway + onward) % self.n_gateways())
    }

    /// The same place as read from another of its gateways.
    pub fn read_from(&self, gateway: u8) -> Self {
        let mut openings = self.0.clone();
        openings.rotate_left(usize::from(gateway));
        Self(openings)
    }

    /// Whether this place, as seen from `gateway`, looks as `other` says.
    pub fn looks_from(&self, gateway: u8, other: &Self) -> bool {
        let (before, after) = self.0.split_at(usize::from(gateway));
        let n_after = after.len();
        self.0.len() == other.0.len()
            && after == &other.0[..n_after]
            && before == &other.0[n_after..]
    }
}

impl FromStr for Star {
    type Err = InvalidStar;

    fn from_str(text: &str) -> Result<Self, InvalidStar> {
        let mut letters = Vec::new();
        for sign in text.chars() {
            let law = match sign {
                'a'..='z' => {
                    letters.push((sign, ControlLaw::Midline));
                    continue;
                }
                '<' => ControlLaw::LeftWall,
                '>' => ControlLaw::RightWall,
                '^' => ControlLaw::BlindStep,
                _ => return Err(InvalidStar::UnknownSign(sign)),
            };
            letters.last_mut().ok_or(InvalidStar::UnknownSign(sign))?.1 = law;
        }
        let n = letters.len();
        if N_GATEWAYS_MAX < n {
            return Err(InvalidStar::GatewayCount(n));
        }
        let opening = |(index, &(letter, control_law)): (usize, &(char, ControlLaw))| {
            let mut others = (1..n).filter(|onward| letters[(index + onward) % n].0 == letter);
            let onward = others.next().unwrap_or(0);
            if others.next().is_some() {
                return Err(InvalidStar::Forked(letter));
            }
            let continues_after = u8::try_from(onward).map_err(|_| InvalidStar::GatewayCount(n))?;
            Ok(Opening { continues_after, control_law })
        };
        Self::new(letters.iter().enumerate().map(opening).collect::<Result<_, _>>()?)
    }
}

impl fmt::Display for Star {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut letters: Vec<char> = Vec::with_capacity(self.0.len());
        let mut unused = 'a'..;
        for (gateway, opening) in (0..).zip(&self.0) {
            let earlier = self.continuation(gateway).and_then(|at| letters.get(usize::from(at)));
            let letter = earlier.copied().or_else(|| unused.next()).unwrap_or('?');
            letters.push(letter);
            let law = match opening.control_law {
                ControlLaw::Midline => "",
                ControlLaw::LeftWall => "<",
                ControlLaw::RightWall => ">",
                ControlLaw::BlindStep => "^",
            };
            write!(f, "{letter}{law}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn star(text: &str) -> Star {
        text.parse().expect("a star")
    }

    #[test]
    fn letters_are_fragments() {
        let t_junction = star("xyx>");
        assert_eq!(t_junction.to_string(), "aba>", "letters have no meaning of their own");
        assert_eq!(t_junction.n_fragments(), 2, "one passes, one ends");
        assert_eq!(t_junction.continuation(2), Some(0), "x leads on clockwise past the end");
        assert_eq!(t_junction.continuation(1), None, "y ends");
    }

    #[test]
    fn a_crossing_looks_alike_from_everywhere_and_a_junction_does_not() {
        let (crossing, junction) = (star("abab"), star("aba"));
        let alike =
            |of: &Star| (0..of.n_gateways()).filter(|&gateway| of.looks_from(gateway, of)).count();
        assert_eq!(alike(&crossing), 4, "four-fold");
        assert_eq!(alike(&junction), 1, "no symmetry: left is not right");
        assert!(junction.looks_from(1, &star("abb")), "from the stem");
        assert_eq!(junction.read_from(1), star("abb"), "the same, written out");
    }

    #[test]
    fn nonsense_is_refused() {
        let error = |text: &str| text.parse::<Star>().expect_err("nonsense").to_string();
        assert_eq!(error(""), "a star of 0 gateways, where 1 to 32 are possible");
        assert_eq!(error("aaa"), "path fragment `a` has more than two gateways");
        assert_eq!(
            error("<a"),
            "`<` is neither a path fragment (a to z) nor a control law (<, > or ^)"
        );
        let one_way = Opening { continues_after: 1, control_law: ControlLaw::Midline };
        let ends = Opening { continues_after: 0, ..one_way };
        assert_eq!(
            Star::new(vec![one_way, ends]),
            Err(InvalidStar::OneWay(0)),
            "ends, or leads on"
        );
    }
}
