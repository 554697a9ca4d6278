//! What a robot sees when it arrives at a place.

use std::fmt;

use crate::star::Star;

/// The outcome of the caller's comparison of local perceptual maps, as a name: places whose local
/// maps match have the same, others have different ones (HSSH 2004, section III-D, second test).
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct View {
    /// The name, compared and nothing else.
    pub name: String,
    /// Whether no two places have this view: a place marked as "home" (Kuipers and Byun 1988,
    /// section 2.5). Where a robot sees the mark, it is there; where it would see it and does
    /// not, the caller gives any other view.
    pub is_unique: bool,
}

/// What a robot sees when it arrives at a place.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Observation {
    /// Local topology, read from the gateway where the robot came in.
    pub star: Star,
    /// What else is known of the looks of the place; `None` where nobody compared it, which
    /// fits every place.
    pub view: Option<View>,
}

impl Observation {
    /// Whether the two may be of one place, as far as their views tell.
    pub fn fits(&self, view: Option<&View>) -> bool {
        match (&self.view, view) {
            (Some(seen), Some(view)) => seen.name == view.name,
            _ => true,
        }
    }
}

impl From<Star> for Observation {
    fn from(star: Star) -> Self {
        Self { star, view: None }
    }
}

/// `aba`, `aba@hall` or, for a view that one place only has, `aba@home!`.
impl fmt::Display for Observation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.star)?;
        if let Some(View { name, is_unique }) = &self.view {
            write!(f, "@{name}{}", if *is_unique { "!" } else { "" })?;
        }
        Ok(())
    }
}
