//! Which page of a list is asked for.

use serde::Deserialize;
use utoipa::IntoParams;

/// Paging of a list.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct Page {
    /// Rows wanted: 0 or absent for the default of 100; cut at 1000.
    #[serde(default)]
    #[param(minimum = 0, maximum = 4_294_967_295_u32, example = 100)]
    pub(crate) page_size: u32,
    /// The previous reply's `next_page_token`; absent or empty for the first page.
    #[serde(default)]
    #[param(example = "")]
    pub(crate) page_token: String,
}

/// Paging of what a version of a map has.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct VersionPage {
    /// Number of the version that is asked about, from 1 on; absent or `latest` for the published one.
    #[param(pattern = "^(latest|[1-9][0-9]*)$", example = "latest")]
    pub(crate) version: Option<String>,
    /// Rows wanted: 0 or absent for the default of 100; cut at 1000.
    #[serde(default)]
    #[param(minimum = 0, maximum = 4_294_967_295_u32, example = 100)]
    pub(crate) page_size: u32,
    /// The previous reply's `next_page_token`; absent or empty for the first page.
    #[serde(default)]
    #[param(example = "")]
    pub(crate) page_token: String,
}
