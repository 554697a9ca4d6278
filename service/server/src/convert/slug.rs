//! Ids chosen by people.

use crate::error::Error;

/// Characters of a map's or robot's id.
const SLUG_LEN_MAX: usize = 63;

/// Checks an id: 1 to 63 of a-z, 0-9, `-`, `_`, beginning with a letter or digit.
pub(crate) fn slug(field: &str, text: &str) -> Result<String, Error> {
    let inner = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-' || c == '_';
    let first = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit();
    let good = (1..=SLUG_LEN_MAX).contains(&text.len())
        && text.starts_with(first)
        && text.chars().all(inner);
    if good {
        return Ok(text.to_owned());
    }
    let shown: String = text.chars().take(SLUG_LEN_MAX + 1).collect();
    Err(Error::field(
        field,
        format!(
            "`{shown}` is not an id: 1 to {SLUG_LEN_MAX} of a-z, 0-9, `-`, `_`, beginning with a letter or digit"
        ),
    ))
}

/// Checks text for people.
pub(crate) fn text(field: &str, text: &str, n_chars_max: usize) -> Result<String, Error> {
    let n_chars = text.chars().count();
    if n_chars > n_chars_max {
        return Err(Error::field(
            field,
            format!("{n_chars} characters, at most {n_chars_max} are taken"),
        ));
    }
    if text.chars().any(char::is_control) {
        return Err(Error::field(field, "control characters are not taken"));
    }
    Ok(text.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn takes_what_it_says() {
        for good in ["a", "intel", "level-2_east", "7th"] {
            assert!(slug("map", good).is_ok(), "`{good}` is an id");
        }
        for bad in ["", "-a", "Intel", "a b", "ä", "a/b", &"a".repeat(64)] {
            assert!(slug("map", bad).is_err(), "`{bad}` is none");
        }
    }
}
