//! Robots that plans are made for.

use meetpoint_planning::WeightParams;

use super::standing::Standing;
use crate::settings::PlanningSettings;

/// Radius of the largest robot, in metres: wider than any door.
pub(crate) const RADIUS_MAX_M: f64 = 5.0;

/// A robot, and how it is to drive.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Profile {
    /// Empty for a radius that a query asked for and no profile has.
    pub(crate) name: String,
    /// In metres, 0 to [`RADIUS_MAX_M`].
    pub(crate) radius_m: f64,
    pub(crate) weights: WeightParams,
}

impl Profile {
    /// The profile that every map has.
    pub(crate) const DEFAULT: &'static str = "default";

    /// For a robot of that radius, by length alone.
    pub(crate) fn of_radius(radius_m: f64) -> Self {
        Self { name: String::new(), radius_m, weights: WeightParams::LENGTH_ONLY }
    }

    /// All that tables depend on, to the last bit.
    pub(crate) fn bits(&self) -> [u64; 4] {
        let WeightParams { clearance_distance_m, clearance_factor, occupancy_factor } =
            self.weights;
        [self.radius_m, clearance_distance_m, clearance_factor, occupancy_factor].map(f64::to_bits)
    }
}

impl PlanningSettings {
    /// The default profile.
    pub(crate) fn profile(&self) -> Profile {
        let weights = WeightParams {
            clearance_distance_m: self.clearance_distance_m,
            clearance_factor: self.clearance_factor,
            occupancy_factor: self.occupancy_factor,
        };
        Profile { name: Profile::DEFAULT.to_owned(), radius_m: self.robot_radius_m, weights }
    }
}

/// What a question says of the robot.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Choice {
    Named(String),
    Radius(f64),
}

impl Standing {
    /// The profiles of the map, by name: those declared, and always the default.
    pub(crate) fn profiles(&self, settings: &PlanningSettings) -> Vec<Profile> {
        let declared = self.costs.profiles();
        let default = (!declared.contains_key(Profile::DEFAULT)).then(|| settings.profile());
        let mut profiles: Vec<_> = declared.values().cloned().chain(default).collect();
        profiles.sort_by(|a, b| a.name.cmp(&b.name));
        profiles
    }

    /// The profiles to try for a robot, one after the other; empty if none has that name.
    pub(crate) fn chosen(&self, choice: &Choice, settings: &PlanningSettings) -> Vec<Profile> {
        let mut profiles = self.profiles(settings);
        match choice {
            Choice::Named(name) => {
                profiles.retain(|profile| profile.name == *name);
                profiles
            }
            Choice::Radius(radius_m) => {
                profiles.retain(|profile| *radius_m <= profile.radius_m);
                profiles.sort_by(|a, b| a.radius_m.total_cmp(&b.radius_m));
                let mut chosen: Vec<_> = profiles.into_iter().take(1).collect();
                if chosen.first().is_none_or(|profile| profile.radius_m != *radius_m) {
                    chosen.push(Profile::of_radius(*radius_m));
                }
                chosen
            }
        }
    }
}
