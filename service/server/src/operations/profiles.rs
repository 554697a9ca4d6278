//! Profiles: the robots that plan tables are made for.

use meetpoint_proto::v1;

use super::costs::Change;
use crate::convert::{cost, slug};
use crate::planning::{Costs, Decision};
use crate::{error::Error, service::Service};

impl Service {
    /// The profiles of a map, by name.
    pub(crate) async fn list_profiles(
        &self,
        request: v1::ListProfilesRequest,
    ) -> Result<v1::ListProfilesResponse, Error> {
        let standing = self.standing(&request.map).await?;
        let profiles = standing.profiles(&self.settings.planning);
        Ok(v1::ListProfilesResponse {
            profiles: profiles.iter().map(cost::profile_to_wire).collect(),
            cost_revision: standing.costs.revision(),
        })
    }

    /// Declares a profile, or changes it.
    pub(crate) async fn set_profile(
        &self,
        request: v1::SetProfileRequest,
    ) -> Result<v1::SetProfileResponse, Error> {
        let v1::SetProfileRequest { map, profile } = request;
        let wire = profile.ok_or_else(|| Error::field("profile", "missing"))?;
        let profile = cost::profile(wire)?;
        let limit = self.settings.planning.n_profiles_max;
        let decide = |costs: &Costs| {
            let declared = costs.profiles();
            if declared.get(&profile.name) == Some(&profile) {
                return Ok(Change::Settled(()));
            }
            if !declared.contains_key(&profile.name) && limit <= declared.len() {
                let problem = format!("{limit} are declared, no more are taken");
                return Err(Error::field("profile.name", problem));
            }
            Ok(Change::Needed(Decision::Declare(profile.clone())))
        };
        let (now, _) = self.decide(&map, decide).await?;
        let profile = Some(cost::profile_to_wire(&profile));
        Ok(v1::SetProfileResponse { profile, cost_revision: now.costs.revision() })
    }

    /// Takes a profile back.
    pub(crate) async fn delete_profile(
        &self,
        request: v1::DeleteProfileRequest,
    ) -> Result<v1::DeleteProfileResponse, Error> {
        let v1::DeleteProfileRequest { map, name } = request;
        let name = slug::slug("name", &name)?;
        let decide = |costs: &Costs| {
            if costs.profiles().contains_key(&name) {
                return Ok(Change::<()>::Needed(Decision::Undeclare(name.clone())));
            }
            Err(Error::NoSuchProfile { map: map.clone(), name: name.clone() })
        };
        let (now, _) = self.decide(&map, decide).await?;
        Ok(v1::DeleteProfileResponse { cost_revision: now.costs.revision() })
    }
}
