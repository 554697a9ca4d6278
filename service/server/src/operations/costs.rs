//! Costs: closures, tolls, obstacles, zones; each change a decision in the journal.

use meetpoint_proto::v1;
use meetpoint_storage::NewCostDecision;
use uuid::Uuid;

use crate::convert::cost::{self, Said};
use crate::live::Event;
use crate::planning::{Cost, CostKind, Costs, Decision, Removal, Standing};
use crate::{clock, error::Error, service::Service};

/// Attempts to record a decision while others change the same map's costs.
const N_ATTEMPTS: usize = 100;

/// What is to be done about a change, once it is known what is in force.
pub(super) enum Change<T> {
    /// Nothing; the answer.
    Settled(T),
    /// To be recorded.
    Needed(Decision),
}

impl Service {
    /// What is in force.
    pub(crate) async fn list_costs(
        &self,
        request: v1::ListCostsRequest,
    ) -> Result<v1::ListCostsResponse, Error> {
        let costs = self.standing(&request.map).await?.costs;
        Ok(v1::ListCostsResponse {
            costs: costs.in_force().iter().map(cost::cost_to_wire).collect(),
            cost_revision: costs.revision(),
        })
    }

    /// Puts something in force.
    pub(crate) async fn create_cost(
        &self,
        request: v1::CreateCostRequest,
    ) -> Result<v1::CreateCostResponse, Error> {
        let v1::CreateCostRequest { map, cost } = request;
        let wire = cost.ok_or_else(|| Error::field("cost", "missing"))?;
        let new = cost::cost(Uuid::now_v7().to_string(), wire)?;
        self.require_arc(&map, new.kind.arc()).await?;
        let (cost, cost_revision) = self.put(&map, new).await?;
        Ok(v1::CreateCostResponse { cost: Some(cost), cost_revision })
    }

    /// Takes something back.
    pub(crate) async fn delete_cost(
        &self,
        request: v1::DeleteCostRequest,
    ) -> Result<v1::DeleteCostResponse, Error> {
        let v1::DeleteCostRequest { map, id, reason, author, origin } = request;
        let Said { reason, author, origin } = cost::said(&reason, &author, origin)?;
        let id = cost::cost_id(&id)?;
        let removal = Removal { id: id.clone(), reason, author, origin };
        let decide = |costs: &Costs| match costs.get(&id) {
            Some(_) => Ok(Change::<()>::Needed(Decision::Remove(removal.clone()))),
            None => Err(Error::NoSuchCost(id.clone())),
        };
        let (now, _) = self.decide(&map, decide).await?;
        Ok(v1::DeleteCostResponse { cost_revision: now.costs.revision() })
    }

    /// Closes an arc.
    pub(crate) async fn close_arc(
        &self,
        request: v1::CloseArcRequest,
    ) -> Result<v1::CloseArcResponse, Error> {
        let v1::CloseArcRequest { map, arc, reason, author, origin } = request;
        let said = cost::said(&reason, &author, origin)?;
        self.require_arc(&map, Some(arc)).await?;
        let (cost, cost_revision) = self.put(&map, of_arc(CostKind::Closure(arc), said)).await?;
        Ok(v1::CloseArcResponse { cost: Some(cost), cost_revision })
    }

    /// Makes an arc dearer.
    pub(crate) async fn set_arc_toll(
        &self,
        request: v1::SetArcTollRequest,
    ) -> Result<v1::SetArcTollResponse, Error> {
        let v1::SetArcTollRequest { map, arc, toll_m, reason, author, origin } = request;
        let said = cost::said(&reason, &author, origin)?;
        let kind = CostKind::Toll { arc, toll_m: cost::checked_toll_m(toll_m)? };
        self.require_arc(&map, Some(arc)).await?;
        let (cost, cost_revision) = self.put(&map, of_arc(kind, said)).await?;
        Ok(v1::SetArcTollResponse { cost: Some(cost), cost_revision })
    }

    /// Takes closure or toll of an arc back.
    pub(crate) async fn open_arc(
        &self,
        request: v1::OpenArcRequest,
    ) -> Result<v1::OpenArcResponse, Error> {
        let v1::OpenArcRequest { map, arc, reason, author, origin } = request;
        let Said { reason, author, origin } = cost::said(&reason, &author, origin)?;
        let is_priced = self.standing(&map).await?.costs.of_arc(arc).is_some();
        if !is_priced {
            self.require_arc(&map, Some(arc)).await?;
        }
        let decide = |costs: &Costs| {
            Ok(match costs.of_arc(arc) {
                None => Change::Settled(()),
                Some(cost) => Change::Needed(Decision::Remove(Removal {
                    id: cost.id.clone(),
                    reason: reason.clone(),
                    author: author.clone(),
                    origin,
                })),
            })
        };
        let (now, _) = self.decide(&map, decide).await?;
        Ok(v1::OpenArcResponse { cost_revision: now.costs.revision() })
    }

    /// Puts a cost in force, unless it is: the one in force, and the revision.
    async fn put(&self, map: &str, new: Cost) -> Result<(v1::Cost, u64), Error> {
        let limit = self.settings.planning.n_costs_max;
        let decide = |costs: &Costs| {
            if let Some(before) = costs.by_key(&new.client_key) {
                let is_same = before.kind == new.kind;
                return if is_same {
                    Ok(Change::Settled(before.clone()))
                } else {
                    Err(Error::CostKeyTaken)
                };
            }
            let on_arc = new.kind.arc().and_then(|arc| costs.of_arc(arc));
            if let Some(before) = on_arc
                && before.kind == new.kind
                && new.client_key.is_empty()
            {
                return Ok(Change::Settled(before.clone()));
            }
            if on_arc.is_none() && limit <= costs.in_force().len() {
                return Err(Error::TooManyCosts { limit });
            }
            Ok(Change::Needed(Decision::Put(new.clone())))
        };
        let (now, settled) = self.decide(map, decide).await?;
        let cost = settled.or_else(|| now.costs.get(&new.id).cloned()).unwrap_or(new);
        Ok((cost::cost_to_wire(&cost), now.costs.revision()))
    }

    /// Records what `decide` says is needed on top of what is in force, however many others do the
    /// same; then what holds, and what `decide` settled by itself.
    pub(super) async fn decide<T>(
        &self,
        map: &str,
        decide: impl Fn(&Costs) -> Result<Change<T>, Error>,
    ) -> Result<(Standing, Option<T>), Error> {
        for _ in 0..N_ATTEMPTS {
            let standing = self.standing(map).await?;
            let decision = match decide(&standing.costs)? {
                Change::Settled(answer) => return Ok((standing, Some(answer))),
                Change::Needed(decision) => decision,
            };
            let new = NewCostDecision {
                map: standing.map.clone(),
                revision: standing.costs.revision(),
                payload: cost::payload(&decision),
                time_ns: clock::now_ns(),
            };
            let cost_revision = match self.store.decide_cost(&new).await {
                Ok(revision) => revision,
                Err(meetpoint_storage::Error::CostsChanged { .. }) => {
                    // Whoever changed them is about to say so; look again.
                    tokio::task::yield_now().await;
                    self.planner.standings.forget(map);
                    continue;
                }
                Err(error) => return Err(error.into()),
            };
            let changed = v1::CostsChanged { map: map.to_owned(), cost_revision };
            self.live.announce(standing.map, Event::Costs(changed));
            return Ok((self.standing(map).await?, None));
        }
        Err(Error::StorageBusy)
    }

    /// Checks that the published version has an arc, if one is named.
    async fn require_arc(&self, map: &str, arc: Option<u64>) -> Result<(), Error> {
        let Some(arc) = arc else { return Ok(()) };
        let found = self.version_topology(map, 0).await?;
        if found.topology.ids().arcs.iter().any(|id| id.0 == arc) {
            return Ok(());
        }
        Err(Error::NoSuchArc { map: map.to_owned(), arc, version: found.version })
    }
}

/// What is new on an arc.
fn of_arc(kind: CostKind, said: Said) -> Cost {
    let Said { reason, author, origin } = said;
    let id = Uuid::now_v7().to_string();
    Cost { id, kind, reason, author, origin, revision: 0, time_ns: 0, client_key: String::new() }
}
