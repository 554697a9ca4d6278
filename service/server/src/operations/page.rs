//! Pages of lists.

use crate::{error::Error, settings::Limits};

/// The rows to give: 0 for the default, cut at the maximum.
pub(crate) fn size(asked: u32, limits: &Limits) -> u32 {
    if asked == 0 { limits.page_size_default } else { asked.min(limits.page_size_max) }
}

/// The token after a page: the last row's key if the page is full, or empty.
pub(crate) fn token<T>(rows: &[T], size: u32, key: impl Fn(&T) -> String) -> String {
    match rows.last() {
        Some(last) if rows.len() >= size as usize => key(last),
        _ => String::new(),
    }
}

/// What a token holds; `None` for the first page.
pub(crate) fn after<T>(token: &str, parse: impl Fn(&str) -> Option<T>) -> Result<Option<T>, Error> {
    if token.is_empty() {
        return Ok(None);
    }
    parse(token).map(Some).ok_or_else(|| Error::field("page_token", "not a token of this list"))
}
