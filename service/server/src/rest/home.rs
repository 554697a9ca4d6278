//! `/`: a plain page for whoever opens the address in a browser.

use std::fmt::Write;

use axum::extract::State;
use axum::response::{Html, IntoResponse, Response};
use meetpoint_proto::v1;

use super::Rest;
use super::problem::Refusal;

const HEAD: &str = "<!doctype html>
<html lang=\"en\">
<meta charset=\"utf-8\">
<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">
<title>Meetpoint</title>
<style>
body { font-family: system-ui, sans-serif; max-width: 50rem; margin: 2rem auto; padding: 0 1rem; }
img { max-width: 100%; image-rendering: pixelated; border: 1px solid #ccc; }
</style>
<h1>Meetpoint</h1>
<p><a href=\"/docs/\">Interface</a> · <a href=\"/openapi.json\">OpenAPI</a> ·
<a href=\"/metrics\">Metrics</a> · <a href=\"/readyz\">Health</a> ·
<a href=\"/v1/sessions\">Sessions</a> · <a href=\"/v1/jobs\">Jobs</a></p>
";

/// The maps of the first page, with their pictures.
pub(super) async fn home(State(rest): State<Rest>) -> Result<Response, Refusal> {
    let reply = rest.service.list_maps(v1::ListMapsRequest::default()).await?;
    Ok(Html(page(&reply)).into_response())
}

fn page(reply: &v1::ListMapsResponse) -> String {
    let v1::ListMapsResponse { maps, next_page_token } = reply;
    let mut html = HEAD.to_owned();
    for map in maps {
        section(&mut html, map);
    }
    if maps.is_empty() {
        html.push_str("<p>There is no map yet.</p>\n");
    }
    if !next_page_token.is_empty() {
        html.push_str("<p>There are more: see <a href=\"/v1/maps\">all maps</a>.</p>\n");
    }
    html
}

fn section(html: &mut String, map: &v1::Map) {
    let (id, name) = (escaped(&map.id), escaped(&map.display_name));
    // Writing to a string cannot fail.
    let _ = writeln!(html, "<h2>{id}</h2>\n<p>{name}</p>");
    let version = map.published_version;
    if version == 0 {
        html.push_str("<p>Nothing is published yet.</p>\n");
        return;
    }
    let grid = format!("/v1/maps/{id}/grid");
    let _ = writeln!(
        html,
        "<p>Version {version}: <a href=\"{grid}?format=png\">PNG</a> · \
         <a href=\"{grid}?format=pgm\">PGM</a> and <a href=\"{grid}?format=yaml\">YAML</a> · \
         <a href=\"{grid}?format=npy\">NPY</a> · \
         <a href=\"/v1/maps/{id}/versions\">all versions</a></p>\n\
         <p><a href=\"{grid}?format=png\"><img src=\"{grid}?format=png\" alt=\"Map {id}\"></a></p>"
    );
}

/// Text that cannot be taken for HTML.
fn escaped(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            other => safe.push(other),
        }
    }
    safe
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_text() {
        let map = v1::Map {
            id: "intel".to_owned(),
            display_name: "<script>\"&'".to_owned(),
            published_version: 3,
            ..v1::Map::default()
        };
        let html = page(&v1::ListMapsResponse { maps: vec![map], next_page_token: String::new() });
        assert!(html.contains("&lt;script&gt;&quot;&amp;&#39;"), "escaped");
        assert!(html.contains("/v1/maps/intel/grid?format=png"), "its picture");
    }
}
