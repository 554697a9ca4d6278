//! What the service does about maps of places, whichever protocol carries it.

use meetpoint_client::v1;
use serde_json::json;

use crate::causal_json;
use crate::door::{Answer, Door, Page};
use crate::graph_json;
use crate::grpc_door::{GrpcDoor, filled};
use crate::hypothesis_json;
use crate::place_json;
use crate::rest_door::{RestDoor, answered_bytes, paged, version_name};

/// The operations. An empty hypothesis is the first; of what is taken back, the last.
pub(crate) trait PlaceDoor: Door {
    /// A page of the places of a version's grid.
    async fn grid_places(&self, request: v1::ListPlacesRequest) -> Answer<v1::ListPlacesResponse>;
    async fn hypotheses(
        &self,
        request: v1::ListHypothesesRequest,
    ) -> Answer<v1::ListHypothesesResponse>;
    async fn hypothesis(
        &self,
        tree: &v1::TreeName,
        hypothesis: &str,
    ) -> Answer<v1::GetHypothesisResponse>;
    /// A map in the words of a graph.
    async fn hypothesis_graph(&self, tree: &v1::TreeName, hypothesis: &str) -> Answer<v1::Graph>;
    /// The bytes of a PNG.
    async fn drawing(&self, tree: &v1::TreeName, hypothesis: &str) -> Answer<Vec<u8>>;
    async fn assert_true(
        &self,
        tree: &v1::TreeName,
        hypothesis: &str,
    ) -> Answer<v1::HypothesisTree>;
    async fn take_back(&self, tree: &v1::TreeName, hypothesis: &str) -> Answer<v1::HypothesisTree>;
    async fn travel(&self, request: v1::PlanTravelRequest) -> Answer<v1::PlanTravelResponse>;
    /// What was seen of a place of the first map on one visit, or any, without the cells.
    async fn seen(
        &self,
        tree: &v1::TreeName,
        at: (u32, Option<u32>),
    ) -> Answer<v1::GetPlaceMapResponse>;
    async fn schemas(&self, map: &str, session: &str) -> Answer<v1::ListCausalSchemasResponse>;
    async fn next_travel(
        &self,
        tree: &v1::TreeName,
        selection: v1::TravelSelection,
    ) -> Answer<v1::GetNextTravelResponse>;
}

/// Why something is said, and who says so.
const SAID: [&str; 2] = ["the lift is there once", "anna"];

impl PlaceDoor for GrpcDoor {
    async fn grid_places(&self, request: v1::ListPlacesRequest) -> Answer<v1::ListPlacesResponse> {
        Ok(self.places.clone().list_places(request).await?.into_inner())
    }

    async fn hypotheses(
        &self,
        request: v1::ListHypothesesRequest,
    ) -> Answer<v1::ListHypothesesResponse> {
        Ok(self.places.clone().list_hypotheses(request).await?.into_inner())
    }

    async fn hypothesis(
        &self,
        tree: &v1::TreeName,
        hypothesis: &str,
    ) -> Answer<v1::GetHypothesisResponse> {
        let (tree, hypothesis) = (Some(tree.clone()), hypothesis.to_owned());
        let request = v1::GetHypothesisRequest { tree, hypothesis, picture: false };
        Ok(self.places.clone().get_hypothesis(request).await?.into_inner())
    }

    async fn hypothesis_graph(&self, tree: &v1::TreeName, hypothesis: &str) -> Answer<v1::Graph> {
        let request = v1::GetGraphRequest {
            map: tree.map.clone(),
            hypothesis: named(hypothesis, "simplest").to_owned(),
            tree: Some(tree.clone()),
            ..Default::default()
        };
        Ok(filled(self.graphs.clone().get_graph(request).await?.into_inner().graph))
    }

    async fn drawing(&self, tree: &v1::TreeName, hypothesis: &str) -> Answer<Vec<u8>> {
        let (tree, hypothesis) = (Some(tree.clone()), hypothesis.to_owned());
        let request = v1::GetHypothesisRequest { tree, hypothesis, picture: true };
        Ok(self.places.clone().get_hypothesis(request).await?.into_inner().png)
    }

    async fn assert_true(
        &self,
        tree: &v1::TreeName,
        hypothesis: &str,
    ) -> Answer<v1::HypothesisTree> {
        let [reason, author] = SAID.map(str::to_owned);
        let (tree, hypothesis) = (Some(tree.clone()), hypothesis.to_owned());
        let request = v1::AssertHypothesisRequest { tree, hypothesis, reason, author };
        let reply = self.places.clone().assert_hypothesis(request).await?.into_inner();
        Ok(reply.tree.expect("the tree as it is"))
    }

    async fn take_back(&self, tree: &v1::TreeName, hypothesis: &str) -> Answer<v1::HypothesisTree> {
        let [reason, author] = SAID.map(str::to_owned);
        let (tree, hypothesis) = (Some(tree.clone()), hypothesis.to_owned());
        let request = v1::UndoHypothesisRequest { tree, hypothesis, reason, author };
        let reply = self.places.clone().undo_hypothesis(request).await?.into_inner();
        Ok(reply.tree.expect("the tree as it is"))
    }

    async fn travel(&self, request: v1::PlanTravelRequest) -> Answer<v1::PlanTravelResponse> {
        Ok(self.places.clone().plan_travel(request).await?.into_inner())
    }

    async fn seen(
        &self,
        tree: &v1::TreeName,
        (place, visit): (u32, Option<u32>),
    ) -> Answer<v1::GetPlaceMapResponse> {
        let (tree, hypothesis) = (Some(tree.clone()), String::new());
        let request = v1::GetPlaceMapRequest { tree, hypothesis, place, visit, picture: true };
        let mut told = self.places.clone().get_place_map(request).await?.into_inner();
        let grid = told.grid.as_mut().expect("cells");
        assert_eq!(grid.cells.len(), (grid.width * grid.height) as usize, "one byte each");
        // What REST's picture is alone.
        (grid.cells, grid.map) = (Vec::new(), String::new());
        Ok(told)
    }

    async fn schemas(&self, map: &str, session: &str) -> Answer<v1::ListCausalSchemasResponse> {
        let (map, session) = (map.to_owned(), session.to_owned());
        let request = v1::ListCausalSchemasRequest { map, session };
        Ok(self.places.clone().list_causal_schemas(request).await?.into_inner())
    }

    async fn next_travel(
        &self,
        tree: &v1::TreeName,
        selection: v1::TravelSelection,
    ) -> Answer<v1::GetNextTravelResponse> {
        let (tree, selection) = (Some(tree.clone()), selection.into());
        let request = v1::GetNextTravelRequest { tree, selection };
        Ok(self.places.clone().get_next_travel(request).await?.into_inner())
    }
}

/// `session=..&planar=..&circles=..`
fn asked(tree: &v1::TreeName) -> String {
    let v1::TreeName { map: _, session, planar, circles, metrical } = tree;
    format!("session={session}&planar={planar}&circles={circles}&metrical={metrical}")
}

fn named<'a>(hypothesis: &'a str, alias: &'a str) -> &'a str {
    if hypothesis.is_empty() { alias } else { hypothesis }
}

impl PlaceDoor for RestDoor {
    async fn grid_places(&self, request: v1::ListPlacesRequest) -> Answer<v1::ListPlacesResponse> {
        let v1::ListPlacesRequest { map, version, page_size, page_token } = &request;
        let (version, page) = (version_name(*version), paged(Page(*page_size, page_token)));
        let path = format!("/v1/maps/{map}/places?version={version}&{page}");
        Ok(place_json::places(&self.get(&path)?))
    }

    async fn hypotheses(
        &self,
        request: v1::ListHypothesesRequest,
    ) -> Answer<v1::ListHypothesesResponse> {
        let v1::ListHypothesesRequest { tree, page_size, page_token } = request;
        let tree = tree.unwrap_or_default();
        let (map, asked) = (&tree.map, asked(&tree));
        let page = format!("page_size={page_size}&page_token={page_token}");
        let body = self.get(&format!("/v1/maps/{map}/hypotheses?{asked}&{page}"))?;
        Ok(hypothesis_json::list(&body))
    }

    async fn hypothesis(
        &self,
        tree: &v1::TreeName,
        hypothesis: &str,
    ) -> Answer<v1::GetHypothesisResponse> {
        let (map, id, asked) = (&tree.map, named(hypothesis, "simplest"), asked(tree));
        let body = self.get(&format!("/v1/maps/{map}/hypotheses/{id}?{asked}"))?;
        Ok(hypothesis_json::detail(&body))
    }

    async fn hypothesis_graph(&self, tree: &v1::TreeName, hypothesis: &str) -> Answer<v1::Graph> {
        let (map, id, asked) = (&tree.map, named(hypothesis, "simplest"), asked(tree));
        let body = self.get(&format!("/v1/maps/{map}/graph?hypothesis={id}&{asked}"))?;
        Ok(graph_json::graph(&body))
    }

    async fn drawing(&self, tree: &v1::TreeName, hypothesis: &str) -> Answer<Vec<u8>> {
        let (map, id, asked) = (&tree.map, named(hypothesis, "simplest"), asked(tree));
        let path = format!("/v1/maps/{map}/hypotheses/{id}?format=png&{asked}");
        answered_bytes(self.0.get(&path))
    }

    async fn assert_true(
        &self,
        tree: &v1::TreeName,
        hypothesis: &str,
    ) -> Answer<v1::HypothesisTree> {
        let (map, id, asked) = (&tree.map, named(hypothesis, "simplest"), asked(tree));
        let path = format!("/v1/maps/{map}/hypotheses/{id}/assert?{asked}");
        let body = json!({"reason": SAID[0], "author": SAID[1]});
        Ok(hypothesis_json::tree(&self.post(&path, &body, &[200])?))
    }

    async fn take_back(&self, tree: &v1::TreeName, hypothesis: &str) -> Answer<v1::HypothesisTree> {
        let (map, id, asked) = (&tree.map, named(hypothesis, "last"), asked(tree));
        let path = format!("/v1/maps/{map}/hypotheses/{id}/undo?{asked}");
        let body = json!({"reason": SAID[0], "author": SAID[1]});
        Ok(hypothesis_json::tree(&self.post(&path, &body, &[200])?))
    }

    async fn travel(&self, request: v1::PlanTravelRequest) -> Answer<v1::PlanTravelResponse> {
        let v1::PlanTravelRequest { tree, hypothesis, from_place, to_place } = request;
        let tree = tree.unwrap_or_default();
        let (map, id, asked) = (&tree.map, named(&hypothesis, "simplest"), asked(&tree));
        let from = from_place.map_or_else(String::new, |from| format!("&from={from}"));
        let path = format!("/v1/maps/{map}/hypotheses/{id}/route?{asked}{from}&to={to_place}");
        Ok(hypothesis_json::plan(&self.get(&path)?))
    }

    async fn seen(
        &self,
        tree: &v1::TreeName,
        (place, visit): (u32, Option<u32>),
    ) -> Answer<v1::GetPlaceMapResponse> {
        let (map, id, asked) = (&tree.map, named("", "simplest"), asked(tree));
        let visit = visit.map_or_else(String::new, |visit| format!("&visit={visit}"));
        let path = format!("/v1/maps/{map}/hypotheses/{id}/places/{place}?{asked}{visit}");
        let told = place_json::seen(&self.get(&path)?);
        let png = answered_bytes(self.0.get(&format!("{path}&format=png")))?;
        Ok(v1::GetPlaceMapResponse { png, ..told })
    }

    async fn schemas(&self, map: &str, session: &str) -> Answer<v1::ListCausalSchemasResponse> {
        let body = self.get(&format!("/v1/maps/{map}/schemas?session={session}"))?;
        Ok(causal_json::schemas(&body))
    }

    async fn next_travel(
        &self,
        tree: &v1::TreeName,
        selection: v1::TravelSelection,
    ) -> Answer<v1::GetNextTravelResponse> {
        let (map, asked) = (&tree.map, asked(tree));
        let selection = match selection {
            v1::TravelSelection::MostRotation => "MOST_ROTATION",
            _ => "LEAST_ROTATION",
        };
        let path = format!("/v1/maps/{map}/next-travel?{asked}&selection={selection}");
        Ok(hypothesis_json::next_travel(&self.get(&path)?))
    }
}
